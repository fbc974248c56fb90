"""What is hidden is carried from where it was seen last and is seen next, moved and turned as what is seen beside it."""

import numpy as np
from scipy.spatial.transform import Rotation

from doo3d.kernels import carry_hidden
from doo3d.types import Bools, Floats

SEGMENT = 0.01
FRAMES, JOINTS = 9, 60


def bent_cable() -> Floats:
    """Return (JOINTS, 3) m, an arc that lies a meter before the camera."""
    angles = np.linspace(0.0, 2.0, JOINTS)
    radius = SEGMENT * (JOINTS - 1) / 2.0
    return radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(JOINTS)]) + [0.0, 0.0, 1.0]


def swung(cable: Floats) -> Floats:
    """Return (FRAMES, JOINTS, 3) m, the cable that moves and turns as one, faster and faster."""
    steps = np.arange(FRAMES) ** 2
    turns = Rotation.from_rotvec(0.01 * steps[:, None] * np.array([0.3, 0.2, 1.0])).as_matrix()
    return np.einsum("tij,kj->tki", turns, cable) + 0.001 * steps[:, None, None] * np.array([1.0, 2.0, 0.5])


def hidden(first: int, end: int) -> Bools:
    """Return which joints are seen: in the first frame and the last all, in between not those from `first` to before `end`."""
    seen = np.ones((FRAMES, JOINTS), dtype=bool)
    seen[1:-1, first:end] = False
    return seen


def test_hidden_parts_of_a_cable_that_swings_as_one_are_where_they_are() -> None:
    truth = swung(bent_cable())
    for seen in (hidden(0, 25), hidden(20, 35), hidden(40, JOINTS)):
        unknown = np.where(seen[:, :, None], truth, 0.0)
        assert np.abs(carry_hidden(unknown, seen, SEGMENT) - truth).max() < 3e-4


def test_a_hidden_part_lies_between_where_it_was_seen_last_and_is_seen_next() -> None:
    """A part swings round the joint beside it; in between it has turned by its share of the time, and is as long."""
    cable = bent_cable()
    truth = np.repeat(cable[None], FRAMES, axis=0)
    turns = Rotation.from_rotvec(np.linspace(0.0, 0.6, FRAMES)[:, None] * [0.0, 0.0, 1.0]).as_matrix()
    truth[:, 40:] = cable[39] + np.einsum("tij,kj->tki", turns, cable[40:] - cable[39])
    seen = hidden(40, JOINTS)
    result = carry_hidden(np.where(seen[:, :, None], truth, 0.0), seen, SEGMENT)
    assert np.abs(result - truth).max() < 1e-3
    assert np.allclose(np.linalg.norm(np.diff(result, axis=1), axis=2), SEGMENT, rtol=1e-3)
    assert np.array_equal(result[:, :40], truth[:, :40])


def test_an_error_of_one_place_stays_there() -> None:
    """A few joints of a hidden part are seen between fingers, and laid where they are not."""
    truth = swung(bent_cable())
    seen = hidden(10, 50)
    seen[4, 28:32] = True
    wrong = truth.copy()
    wrong[4, 28:32] += [0.0, 0.0, 0.03]
    off = np.linalg.norm(carry_hidden(wrong, seen, SEGMENT) - truth, axis=2)
    assert off[[3, 5], 28:32].min() > 0.01  # the error is carried with the joints
    assert off[[3, 5], 10:24].max() < 1e-3
    assert off[[3, 5], 36:50].max() < 1e-3


def test_a_hidden_end_turns_with_what_is_seen_beside_it() -> None:
    """The cable bends far from the hidden end, which turns with the part before it, and not with the whole."""
    cable = bent_cable()
    truth = np.repeat(cable[None], FRAMES, axis=0)
    turns = Rotation.from_rotvec(np.linspace(0.0, 0.9, FRAMES)[:, None] * [0.0, 0.0, 1.0]).as_matrix()
    truth[:, 20:] = cable[19] + np.einsum("tij,kj->tki", turns, cable[20:] - cable[19])
    seen = hidden(54, JOINTS)
    seen[-1, 54:] = False  # never seen again
    assert np.abs(carry_hidden(np.where(seen[:, :, None], truth, 0.0), seen, SEGMENT) - truth).max() < 0.2 * SEGMENT


def test_what_is_never_seen_and_frames_that_show_nothing_stay() -> None:
    truth = swung(bent_cable())
    seen = hidden(20, 35)
    seen[:, 50:] = False
    seen[4] = False
    result = carry_hidden(truth, seen, SEGMENT)
    assert np.array_equal(result[:, 50:], truth[:, 50:])
    assert np.array_equal(result[4], truth[4])
    assert np.isfinite(result).all()


def test_a_straight_line_does_not_tell_how_far_it_turns_round_itself() -> None:
    rng = np.random.default_rng(0)
    straight = np.column_stack([SEGMENT * np.arange(JOINTS), np.zeros(JOINTS), np.ones(JOINTS)])
    straight[40:, 1] = SEGMENT * np.arange(JOINTS - 40)
    truth = np.repeat(straight[None], FRAMES, axis=0)
    noisy = truth + 1e-4 * rng.normal(size=truth.shape)
    assert np.abs(carry_hidden(noisy, hidden(40, JOINTS), SEGMENT) - truth).max() < 2e-3


def test_two_joints_in_common_are_enough() -> None:
    truth = swung(bent_cable())
    result = carry_hidden(truth, hidden(2, JOINTS), SEGMENT)
    assert np.isfinite(result).all()
    assert np.abs(np.linalg.norm(np.diff(result[1], axis=0), axis=1) - SEGMENT).max() < 1e-3

"""Hidden parts of an object lie behind what hides them."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.sequence.background import BackgroundView
from doo3d.sequence.hiding import behind_occluders

SEGMENT, RADIUS = 0.01, 0.003
FOCAL, WIDTH, HEIGHT = 80.0, 96, 72
SEEN = np.arange(51) < 30


@pytest.fixture
def joints():
    """A straight object of 0.5 m, 0.6 m before the camera, of which the first 30 joints are seen."""
    return np.column_stack((np.arange(51) * SEGMENT - 0.25, np.zeros(51), np.full(51, 0.6)))


def view(hand, near=0.45, beyond=0.9):
    """A wall with a hand before it: rows and columns, and their distances in m; 0 is none."""
    inverse = np.full((HEIGHT, WIDTH), 1 / beyond if beyond else 0.0)
    inverse[hand] = 1 / near
    intrinsics = np.array([FOCAL, FOCAL, (WIDTH - 1) / 2, (HEIGHT - 1) / 2])
    return BackgroundView(np.full(inverse.shape, 100, dtype=np.uint8), inverse.astype(np.float16), intrinsics)


BESIDE = (slice(38, 60), slice(None))  # the object is at row 35.5


def hide(joints, shown, seen=SEEN):
    return behind_occluders(joints, seen, shown, 0.5, RADIUS)


def test_what_is_in_plain_view_moves_behind_the_hand(joints):
    """The hand begins 2 pixels of the small image, 1.5 cm, beside the hidden part."""
    result = hide(joints, view(BESIDE))
    rows = FOCAL * result[:, 1] / result[:, 2] + (HEIGHT - 1) / 2
    assert (np.rint(rows[36:]) >= 37).all()
    assert np.abs(result[:25] - joints[:25]).max() < 1e-3
    assert np.linalg.norm(np.diff(result, axis=0), axis=1).sum() == pytest.approx(0.5, rel=0.02)


@pytest.mark.parametrize(
    "shown",
    [
        view((slice(30, 60), slice(None))),  # hidden as it is
        view((slice(60, 72), slice(None))),  # the hand is farther away than a place may be wrong
        view(BESIDE, near=0.7),  # a hand behind the object
        view(BESIDE, beyond=0.0),  # no depth where the hidden part is
        view((slice(0, 0), slice(None))),  # no hand
    ],
    ids=["hidden", "far", "behind", "unknown", "none"],
)
def test_other_parts_stay(joints, shown):
    np.testing.assert_array_equal(hide(joints, shown), joints)


def test_before_the_object_itself_nothing_is_in_plain_view(joints):
    shown = view(BESIDE)
    shown.gray[34:38] = 0
    np.testing.assert_array_equal(hide(joints, shown), joints)


def test_outside_of_the_image_nothing_is_known(joints):
    far = joints + np.array((0.9, 0.0, 0.0))
    np.testing.assert_array_equal(hide(far, view(BESIDE)), far)


def test_a_hidden_part_that_reaches_the_camera_stays(joints):
    joints[30:, 2] = np.linspace(0.6, -0.1, 21)
    joints[47, 2] = 0.0
    np.testing.assert_array_equal(hide(joints, view(BESIDE)), joints)


def test_an_object_that_is_seen_stays(joints):
    np.testing.assert_array_equal(hide(joints, view(BESIDE), np.ones(51, dtype=bool)), joints)

"""True crossings by formula, and how detections of them are counted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders.chains import along

from doo3d.evaluation.metrics.crossings import true_crossings
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.scenes.model import Truth
from doo3d.types import Crossing, SegmentRef

RADIUS, STEP = 0.004, 0.01
X = np.linspace(-0.2, 0.2, 801)


def across(angle, z, middle=(0.05, 0.0)):
    """A straight cable of 0.4 m at a depth, through a place of the view at z = 0.6 m: it is at arc 0.2 m there."""
    scale = z / 0.6
    return np.column_stack((middle[0] * scale + X * np.cos(angle), middle[1] * scale + X * np.sin(angle), np.full(801, z)))


def knot():
    """A trefoil: three crossings, over and under in turn."""
    t = np.linspace(0, 2 * np.pi, 2401)[:-1]
    flat = 0.05 * np.column_stack((np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t)))
    return np.column_stack((flat, 0.6 - 0.03 * np.sin(3 * t)))


def test_two_cables():
    truths = [Truth(across(0.2, 0.62), RADIUS), Truth(across(1.4, 0.6), RADIUS)]
    found = true_crossings(truths)
    assert found.cable.tolist() == [[1, 0]]
    np.testing.assert_allclose(found.arc, [[0.2, 0.2]], atol=1e-6)
    assert found.seen.tolist() == [True]
    assert true_crossings(truths[::-1]).cable.tolist() == [[0, 1]]
    assert len(true_crossings([]).cable) == len(true_crossings(truths[:1]).cable) == 0


@pytest.mark.parametrize("closed", [True, False])
def test_a_knot_goes_over_and_under_in_turn(closed):
    axis = knot() if closed else np.roll(knot(), 137, axis=0)[: 2400 - 60]
    found = true_crossings([Truth(axis, RADIUS, closed=closed)])
    assert len(found.cable) == 3
    visits = sorted([(arc, True) for arc in found.arc[:, 0]] + [(arc, False) for arc in found.arc[:, 1]])
    over = [upper for _, upper in visits]
    assert over in ([True, False] * 3, [False, True] * 3)


def test_a_cable_towards_the_camera_does_not_cross_itself():
    t = np.linspace(0, 1, 400)
    wriggling = np.column_stack((1e-4 * np.sin(40 * t), 1e-4 * np.cos(33 * t), 0.5 + 0.01 * t))
    assert len(true_crossings([Truth(wriggling, RADIUS)]).cable) == 0


LOWER, UPPER, THIRD = across(0.2, 0.62), across(1.4, 0.6), across(2.3, 0.61, (-0.06, 0.02))
TRUTHS = [Truth(LOWER, RADIUS), Truth(UPPER, RADIUS), Truth(THIRD, RADIUS)]
CHAINS = [along(axis) for axis in (LOWER, UPPER, THIRD)]


def crossing_of(true, row, flip=False):
    places = [SegmentRef(int(cable), int(arc / STEP)) for cable, arc in zip(true.cable[row], true.arc[row], strict=True)]
    return Crossing(*(places[::-1] if flip else places), point=np.zeros(3))


def counts(crossings, chains=CHAINS, truths=TRUTHS):
    got = score(chains, truths, crossings)
    return got.crossings, got.crossings_correct, got.crossings_extra


def test_right_wrong_missing_and_extra():
    true = true_crossings(TRUTHS)
    assert len(true.cable) == 3
    right = [crossing_of(true, k) for k in range(3)]
    assert counts(right) == counts(right[::-1]) == (3, 3, 0)
    assert counts([*right[:2], crossing_of(true, 2, flip=True)]) == (3, 2, 0)
    assert counts(right[1:]) == (3, 2, 0)
    assert counts([*right, Crossing(SegmentRef(0, 2), SegmentRef(1, 3), np.zeros(3))]) == (3, 3, 1)
    assert counts([*right, right[0]]) == (3, 3, 1)
    assert counts([]) == (3, 0, 0)
    assert counts(None) == (0, 0, 0)


def test_a_chain_may_run_either_way():
    true = true_crossings(TRUTHS)
    turned = [along(axis[::-1]) for axis in (LOWER, UPPER, THIRD)]
    found = []
    for k in range(3):
        crossing = crossing_of(true, k)
        upper, lower = (SegmentRef(c, len(turned[c].joints) - 2 - s) for c, s in (crossing.upper, crossing.lower))
        found.append(Crossing(upper, lower, crossing.point))
    assert counts(found, turned) == (3, 3, 0)


def test_what_the_camera_does_not_see_does_not_count():
    true = true_crossings(TRUTHS)
    row = next(k for k in range(3) if true.cable[k, 0] == 2)
    hidden = np.abs(TRUTHS[2].arcs - true.arc[row, 0]) > 0.03
    truths = [*TRUTHS[:2], replace(TRUTHS[2], seen=hidden)]
    every = [crossing_of(true, k) for k in range(3)]
    assert counts(every, truths=truths) == (2, 2, 0)
    assert counts([crossing for k, crossing in enumerate(every) if k != row], truths=truths) == (2, 2, 0)


def test_a_small_loop_is_not_taken_the_wrong_way_round():
    """The two strands are so near each other along the cable that either order is near."""
    t = np.linspace(-2.2, 2.2, 3000)
    loop = 0.012 * np.column_stack((t**3 / 3 - t, t**2)) * (1, 0.7)
    axis = np.column_stack((loop, 0.6 - 0.004 * t))
    length = np.concatenate(([0], np.cumsum(np.linalg.norm(np.diff(axis, axis=0), axis=1))))
    axis = np.column_stack([np.interp(np.arange(0, length[-1], 0.0005), length, axis[:, k]) for k in range(3)])
    truth, chain = Truth(axis, 0.003), along(axis)
    true = true_crossings([truth])
    assert len(true.cable) == 1
    places = [SegmentRef(0, int(arc / STEP)) for arc in true.arc[0]]
    for pair, right in ((places, 1), (places[::-1], 0)):
        assert counts([Crossing(*pair, np.zeros(3))], [chain], [truth]) == (1, right, 0)

"""Ends that touch a strand from the side: the path round the corner is cut where a straight continuation waits."""

from __future__ import annotations

import numpy as np
import pytest
from builders.contexts import context_of
from builders.drawn_masks import axis_error, frame_of, line

from doo3d import load_config
from doo3d.geometry.polyline import densify, steps
from doo3d.pipeline import run_with_stages
from doo3d.stages.traverse.corners import cut_corners
from doo3d.types import Path

RADIUS = 0.005
CONTEXT = context_of(radius=RADIUS, voxel=RADIUS / 2)
DEPTH = 0.5


def path(*corners, closed=False):
    return Path(densify(np.array(corners, dtype=float), 0.001), closed=closed)


def length(paths):
    return sum(float(steps(part.points, part.closed).sum()) for part in paths)


WAITING = path([0.015, 0, 0], [0.1, 0, 0])
ROUND = path([-0.1, 0, 0], [0, 0, 0], [0, 0.1, 0])


def arc(bend, degrees=180):
    t = np.radians(np.linspace(0, degrees, 100))
    return bend * np.column_stack((np.sin(t), 1 - np.cos(t), 0 * t))


def test_a_corner_is_cut_where_a_strand_goes_on_straight():
    cut = cut_corners([ROUND, WAITING], CONTEXT)
    assert cut.corners == 1
    assert len(cut.paths) == 3
    before, after, other = cut.paths
    assert other is WAITING
    np.testing.assert_allclose(before.points[0], [-0.1, 0, 0])
    np.testing.assert_allclose(after.points[-1], [0, 0.1, 0])
    assert np.abs(before.points[:, 1]).max() < 1e-9
    assert np.abs(after.points[:, 0]).max() < 1e-9
    assert cut.length == pytest.approx(length([ROUND]) - length([before, after]))
    assert 0 < cut.length < 4 * RADIUS


def test_a_corner_beyond_which_nothing_waits_stays():
    aside = path([0.015, 0.03, 0], [0.1, 0.03, 0])
    across = path([0.015, -0.05, 0], [0.015, 0, 0])
    for others in ([], [aside], [across]):
        cut = cut_corners([ROUND, *others], CONTEXT)
        assert cut.corners == 0
        assert cut.paths[0] is ROUND


def test_the_end_that_waits_may_be_that_of_the_path_itself():
    own = path([-0.1, 0, 0], [0, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0], [0.1, 0, 0], [0.015, 0, 0])
    assert cut_corners([own], CONTEXT).corners == 1


@pytest.mark.parametrize("bend", [2.0, 3.0, 4.0])
def test_a_soft_object_keeps_its_tight_bends(bend):
    bends = [arc(bend * RADIUS), arc(bend * RADIUS) * (-1, 1, 1) + (0, 2 * bend * RADIUS, 0)]
    soft = Path(densify(np.concatenate((*bends, [[0.05, 4 * bend * RADIUS, 0]])), 0.001))
    wait = path([-0.015, 0, 0], [-0.03, 0, 0])
    assert cut_corners([soft, wait], CONTEXT).corners == 0


def test_a_fork_of_strands_side_by_side_is_left_to_fit():
    fork = path([-0.1, 0, 0], [0, 0, 0], [-0.1, 0.02, 0])
    assert cut_corners([fork, WAITING], CONTEXT).corners == 0


def test_a_corner_of_a_ring_opens_it():
    square = path([0, 0, 0], [0, 0.1, 0], [-0.1, 0.1, 0], [-0.1, 0, 0], [-0.001, 0, 0], closed=True)
    cut = cut_corners([square, WAITING], CONTEXT)
    assert cut.corners == 1
    assert not cut.paths[0].closed
    start, end = cut.paths[0].points[[0, -1]]
    assert start @ start < (3 * RADIUS) ** 2
    assert end @ end < (3 * RADIUS) ** 2


def test_short_paths_and_none_are_left():
    stub = path([-0.01, 0, 0], [0, 0, 0], [0, 0.01, 0])
    assert cut_corners([stub, WAITING], CONTEXT).paths == [stub, WAITING]
    assert cut_corners([], CONTEXT).paths == []


@pytest.mark.parametrize("dive", [0.0, 2 * RADIUS], ids=("beside", "on top"))
@pytest.mark.parametrize("chains", [2, None])
def test_an_end_on_another_strand(dive, chains):
    """The strand from the side hides 15 mm of a straight one beyond the place where it touches."""
    whole = line([-0.15, 0, DEPTH], [0.15, 0, DEPTH])
    side = line([0, 0, DEPTH - dive], [0, 0.12, DEPTH - dive])
    frame, mask = frame_of(whole[whole[:, 0] < -RADIUS], whole[whole[:, 0] > 0.018], side, radius=RADIUS)
    _, stages = run_with_stages(frame, load_config("default", {"merge.chains": chains}), mask)
    assert stages.traversal.corners == 1
    assert len(stages.chains) == 2
    assert axis_error(stages.chains[0], whole).uncovered < 0.008
    assert axis_error(stages.chains[1], side).uncovered < 0.015


@pytest.mark.parametrize("chains", [1, None])
def test_an_end_on_its_own_strand(chains):
    """A cable comes back in a loop and ends on its own side."""
    t = np.linspace(0, 1.5 * np.pi, 400)
    loop = np.column_stack((0.06 * np.sin(t) + 0.06, 0.06 - 0.06 * np.cos(t), 0 * t))
    own = np.concatenate((line([-0.15, 0, 0], [0.06, 0, 0]), loop, line([0, 0.06, 0], [0, 0, 0])))
    own[:, 2] = DEPTH
    hidden = (np.abs(own[:, 1]) < 1e-9) & (own[:, 0] > -RADIUS) & (own[:, 0] < 0.018)
    seen = own[~hidden]
    cut = int(np.argmax(steps(seen)[: len(seen) // 2])) + 1
    frame, mask = frame_of(seen[:cut], seen[cut:], radius=RADIUS)
    _, stages = run_with_stages(frame, load_config("default", {"merge.chains": chains}), mask)
    assert stages.traversal.corners == 1
    assert len(stages.chains) == 1
    assert axis_error(stages.chains[0], own).uncovered < 0.015
    assert stages.chains[0].length == pytest.approx(length([Path(own)]), abs=0.03)

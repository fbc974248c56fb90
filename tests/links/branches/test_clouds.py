"""Branches in clouds, where no camera tells what is empty: points that lead to a strand, and windows without any."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d import Cloud, detect

RADIUS = 0.005

ENDS = [(-1, -0.2, -0.15), (-1, -0.2, 0.15), (1, 0.2, -0.15), (1, 0.2, 0.15)]


def tube(start, end, spacing=0.0015, radius=RADIUS, seed=0):
    """Points on the upper half of a straight tube, (N, 3) m, `spacing` m apart on average."""
    start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    rng = np.random.default_rng(seed)
    length = np.linalg.norm(end - start)
    axis = (end - start) / length
    side = np.cross(axis, [0, 0, 1.0])
    count = int(length * np.pi * radius / spacing**2)
    angle = rng.uniform(0, np.pi, count)[:, None]
    return start + rng.uniform(0, length, count)[:, None] * axis + radius * (np.cos(angle) * side + np.sin(angle) * [0, 0, 1.0])


def t_piece(branch=(0.06, 0.15, 0.0)):
    return np.concatenate((tube((-0.25, 0, 0), (0.25, 0, 0)), tube((0, 0, 0), branch, radius=0.8 * RADIUS, seed=1)))


def outside(points, middle, width):
    return points[np.linalg.norm(points - middle, axis=1) > width / 2]


def shape(points):
    detection = detect(Cloud(points), "harness")
    return len(detection.objects), len(detection.junctions), len(detection.chains)


def test_a_branch_of_a_cloud_is_found():
    assert shape(t_piece()) == (1, 1, 3)


@pytest.mark.parametrize("width", [0.05, 0.1, 0.15])
@pytest.mark.parametrize("middle", [(0.11, 0, 0), (-0.11, 0, 0), (0.035, 0.085, 0)])
def test_a_window_beside_the_junction_parts_nothing(middle, width):
    assert shape(outside(t_piece((0.08, 0.2, 0)), middle, width)) == (1, 1, 3)


@pytest.mark.parametrize("width", [0.05, 0.1])
def test_a_junction_in_a_window_is_found(width):
    assert shape(outside(t_piece(), (0, 0, 0), width)) == (1, 1, 3)


def test_cables_beside_each_other_stay_apart():
    assert shape(np.concatenate((tube((-0.2, 0, 0), (0.2, 0, 0)), tube((-0.2, 0.06, 0), (0.2, 0.08, 0))))) == (2, 0, 2)


def test_an_end_that_points_elsewhere_stays_a_tip():
    assert shape(np.concatenate((tube((-0.2, 0, 0), (0.2, 0, 0)), tube((0.0, 0.14, 0), (0.2, 0.15, 0))))) == (2, 0, 2)


def test_a_trunk_that_was_not_measured_is_found_between_its_branches():
    """The four branches are joined straight across the window, where the two joins meet at one depth."""
    branches = [tube((side * 0.05, 0, 0), (x, y, 0), seed=k) for k, (side, x, y) in enumerate(ENDS)]
    whole = np.concatenate((tube((-0.05, 0, 0), (0.05, 0, 0), seed=4), *branches))
    assert shape(outside(whole, (0, 0, 0), 0.14)) == (1, 2, 5)


def test_connections_may_cost_anything():
    detection = detect(Cloud(t_piece()), {"merge.branches": True, "merge.max_cost": np.inf})
    assert len(detection.junctions) == 1

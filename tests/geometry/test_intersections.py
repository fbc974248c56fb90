"""Intersections of polylines, against every pair of segments one by one."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from doo3d.geometry.curves import Curves
from doo3d.geometry.intersections import find_intersections


def one_by_one(lines, closed):
    """(chain, segment, chain, segment) of every pair of segments that meet, by solving for each pair."""
    rows = [(c, s) for c, line in enumerate(lines) for s in range(len(line) - 1)]
    found = []
    for (c, s), (d, t) in combinations(rows, 2):
        count = len(lines[c]) - 1
        if c == d and (t - s == 1 or (closed[c] and s == 0 and t == count - 1)):
            continue
        a, b = lines[c][s], lines[d][t]
        matrix = np.column_stack((lines[c][s + 1] - a, b - lines[d][t + 1]))
        if abs(np.linalg.det(matrix)) > 0 and ((0 <= (part := np.linalg.solve(matrix, b - a))) & (part < 1)).all():
            found.append((c, s, d, t))
    return found


def rows(found):
    return [(int(a), int(s), int(b), int(t)) for (a, b), (s, t) in zip(found.chain, found.segment, strict=True)]


@pytest.mark.parametrize("seed", range(8))
def test_every_intersection_is_found_once_and_in_order(seed):
    rng = np.random.default_rng(seed)
    lines = [np.cumsum(rng.normal(size=(n, 2)), axis=0) for n in rng.integers(2, 40, size=3)]
    closed = [False, False, True]
    lines[2] = np.concatenate((lines[2], lines[2][:1]))
    found = find_intersections(Curves.of(lines, closed))
    assert rows(found) == one_by_one(lines, closed)
    assert len(found.angle) > 0


def test_point_parameter_and_angle():
    slope = np.radians(40)
    one = np.array([[0.0, 0], [4, 0]])
    other = np.array([1.0, 0]) + np.outer((-2, 3), (np.cos(slope), np.sin(slope)))
    for turned in (other, other[::-1]):
        found = find_intersections(Curves.of([one, turned], [False, False]))
        np.testing.assert_allclose(found.point, [[1, 0]], atol=1e-12)
        assert found.t[0, 0] == pytest.approx(0.25)
        assert found.angle[0] == pytest.approx(slope)


def test_a_joint_on_another_strand_counts_once():
    found = find_intersections(Curves.of([np.array([[-1.0, 0], [1, 0]]), np.array([[0.0, -1], [0, 0], [0, 1]])], [False, False]))
    assert rows(found) == [(0, 0, 1, 1)]


def test_nothing_meets():
    assert len(find_intersections(Curves.of([], [])).angle) == 0
    assert len(find_intersections(Curves.of([np.array([[0.0, 0], [1, 0]])], [False])).angle) == 0
    side_by_side = [np.array([[0.0, y], [1, y], [2, y]]) for y in (0, 0.1)]
    assert len(find_intersections(Curves.of(side_by_side, [False, False])).angle) == 0
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1], [0, 0]])
    assert len(find_intersections(Curves.of([square], [True])).angle) == 0


def test_what_cannot_be_seen_does_not_meet():
    cross = [np.array([[-1.0, 0], [1, 0]]), np.array([[0.0, -1], [np.nan, np.nan], [0, 1]])]
    assert len(find_intersections(Curves.of(cross, [False, False])).angle) == 0

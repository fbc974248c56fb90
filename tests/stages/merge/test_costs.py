"""The paper's equations 1 to 3, against the formulas as they stand."""

from __future__ import annotations

import numpy as np
import pytest
from builders.contexts import context_of
from builders.errors import refuses

from doo3d.geometry.polyline import unit
from doo3d.stages.merge import costs

ENDS = 8


def ends(dim):
    random = np.random.default_rng(dim)
    return random.normal(size=(ENDS, dim)), unit(random.normal(size=(ENDS, dim)))


def between(a, b):
    return np.arccos(a @ b / (np.linalg.norm(a) * np.linalg.norm(b)))


pairs = [(i, j) for i in range(ENDS) for j in range(ENDS) if i != j]


@pytest.mark.parametrize("dim", [2, 3])
def test_literally(dim):
    points, directions = ends(dim)
    distance, turn, bend = costs.euclidean(points), costs.direction(directions), costs.curvature(points, directions)
    for i, j in pairs:
        s1, s2 = directions[i], directions[j]
        assert distance[i, j] == pytest.approx(np.linalg.norm(points[i] - points[j]))
        assert turn[i, j] == pytest.approx(abs(between(-s1, s2)))
        s21, s12 = points[j] - points[i], points[i] - points[j]
        assert bend[i, j] == pytest.approx(max(abs(between(s1, s21)), abs(between(s2, s12))))


@pytest.mark.parametrize("dim", [2, 3])
def test_either_end_may_come_first(dim):
    points, directions = ends(dim)
    for cost in (costs.euclidean(points), costs.direction(directions), costs.curvature(points, directions)):
        assert cost.shape == (ENDS, ENDS)
        np.testing.assert_allclose(cost, cost.T)


@pytest.mark.parametrize("dim", [2, 3])
def test_known_pairs(dim):
    x, y = np.eye(dim)[:2]
    points = np.array([0 * x, 2 * x, 2 * x + y])
    facing = np.array([x, -x, x])
    assert costs.direction(facing)[0, 1] == 0
    assert costs.curvature(points, facing)[0, 1] == 0
    assert costs.direction(facing)[0, 2] == pytest.approx(np.pi)
    assert costs.curvature(points, facing)[0, 2] == pytest.approx(np.pi - np.arctan(0.5))
    assert costs.curvature(points, -facing)[0, 1] == pytest.approx(np.pi)


@pytest.mark.parametrize("dim", [2, 3])
def test_ends_that_coincide_need_no_bend(dim):
    points, directions = np.zeros((2, dim)), np.array([np.eye(dim)[0], np.eye(dim)[1]])
    assert costs.curvature(points, directions)[0, 1] == 0
    assert costs.direction(directions)[0, 1] == pytest.approx(np.pi / 2)
    assert costs.euclidean(points)[0, 1] == 0


@pytest.mark.parametrize("dim", [2, 3])
def test_exact_where_arccos_is_not(dim):
    """Directions 1e-9 radians apart: the cosine is 1 to the last digit."""
    x, y = np.eye(dim)[:2]
    assert costs.direction(unit(np.array([x, -x + 1e-9 * y])))[0, 1] == pytest.approx(1e-9, rel=1e-3)


def test_marked_ends_of_each_pair_are_counted():
    assert costs.count_in(np.array([True, False, True])).tolist() == [[2, 1, 2], [1, 0, 1], [2, 1, 2]]


def test_a_custom_cost_decides_between_equal_pairs(monkeypatch):
    """Two pairs that the paper's costs hold equal, of which the custom cost forbids one."""
    from doo3d.config import MergeConfig
    from doo3d.geometry.curves import Curves
    from doo3d.stages.merge import costs
    from doo3d.stages.merge.merge import merge

    def line(x, y):
        return np.column_stack((np.arange(x, x + 0.101, 0.01), np.full(11, y), np.zeros(11)))

    pieces = Curves.of([line(-0.13, 0.0), line(0.0, 0.01), line(0.0, -0.01)])

    def joined(**custom):
        merged = merge(
            pieces, context_of(radius=0.003), MergeConfig(chains=2, free_space_weight=0, unknown_weight=0, custom_costs=custom)
        )
        return {round(piece[0, 1], 3) for piece in merged.assemblies[0].pieces}

    monkeypatch.setitem(
        costs.CUSTOM_COSTS, "left", lambda points, directions: np.maximum(0, points[:, None, 1] + points[None, :, 1])
    )
    monkeypatch.setitem(
        costs.CUSTOM_COSTS, "right", lambda points, directions: np.maximum(0, -points[:, None, 1] - points[None, :, 1])
    )
    assert joined(left=1e4) == {0.0, -0.01}
    assert joined(right=1e4) == {0.0, 0.01}


def test_an_unknown_custom_cost_is_refused_by_name():
    from doo3d.errors import ConfigError
    from doo3d.stages.merge.costs import custom_cost

    with refuses("cost-unknown", "height", kind=ConfigError):
        custom_cost("height")

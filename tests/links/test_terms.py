"""The terms of the cost of a link: the paper's equations 1 to 3 against the formulas as they stand, and the costs of the user."""

from __future__ import annotations

import numpy as np
import pytest
from builders.errors import refuses
from builders.scenes import EmptyScene, empty_scene

from doo3d.config import MergeConfig
from doo3d.errors import ConfigError
from doo3d.geometry.curves import Curves
from doo3d.geometry.polyline import unit
from doo3d.links import merge
from doo3d.links.ends import Ends
from doo3d.links.terms import TERMS, cost_terms
from doo3d.plugins import CUSTOM_COSTS

ENDS = 8


def ends(dim):
    random = np.random.default_rng(dim)
    return random.normal(size=(ENDS, dim)), unit(random.normal(size=(ENDS, dim)))


def terms_of(points, directions):
    """Return distance, direction and curvature of each pair of ends, with weights of 1, in px and radians or m and radians."""
    config = MergeConfig(direction_weight=1, curvature_weight=1)
    straight = np.zeros(len(points), dtype=bool), 1.0
    costs = cost_terms(Ends(points, directions, *straight, config), empty_scene(points.shape[1]))
    return costs["distance"] / (1000 if points.shape[1] == 3 else 1), costs["direction"], costs["curvature"]


def between(a, b):
    return np.arccos(a @ b / (np.linalg.norm(a) * np.linalg.norm(b)))


pairs = [(i, j) for i in range(ENDS) for j in range(ENDS) if i != j]


@pytest.mark.parametrize("dim", [2, 3])
def test_literally(dim):
    points, directions = ends(dim)
    distance, turn, bend = terms_of(points, directions)
    for i, j in pairs:
        s1, s2 = directions[i], directions[j]
        assert distance[i, j] == pytest.approx(np.linalg.norm(points[i] - points[j]))
        assert turn[i, j] == pytest.approx(abs(between(-s1, s2)))
        s21, s12 = points[j] - points[i], points[i] - points[j]
        assert bend[i, j] == pytest.approx(max(abs(between(s1, s21)), abs(between(s2, s12))))


@pytest.mark.parametrize("dim", [2, 3])
def test_either_end_may_come_first(dim):
    points, directions = ends(dim)
    for cost in terms_of(points, directions):
        assert cost.shape == (ENDS, ENDS)
        np.testing.assert_allclose(cost, cost.T)


@pytest.mark.parametrize("dim", [2, 3])
def test_known_pairs(dim):
    x, y = np.eye(dim)[:2]
    points = np.array([0 * x, 2 * x, 2 * x + y])
    facing = np.array([x, -x, x])
    _, turn, bend = terms_of(points, facing)
    assert turn[0, 1] == bend[0, 1] == 0
    assert turn[0, 2] == pytest.approx(np.pi)
    assert bend[0, 2] == pytest.approx(np.pi - np.arctan(0.5))
    assert terms_of(points, -facing)[2][0, 1] == pytest.approx(np.pi)


@pytest.mark.parametrize("dim", [2, 3])
def test_ends_that_coincide_need_no_bend(dim):
    points, directions = np.zeros((2, dim)), np.array([np.eye(dim)[0], np.eye(dim)[1]])
    distance, turn, bend = terms_of(points, directions)
    assert distance[0, 1] == bend[0, 1] == 0
    assert turn[0, 1] == pytest.approx(np.pi / 2)


@pytest.mark.parametrize("dim", [2, 3])
def test_exact_where_arccos_is_not(dim):
    """Directions 1e-9 radians apart: the cosine is 1 to the last digit."""
    x, y = np.eye(dim)[:2]
    directions = unit(np.array([x, -x + 1e-9 * y]))
    assert terms_of(np.zeros((2, dim)), directions)[1][0, 1] == pytest.approx(1e-9, rel=1e-3)


def test_ends_in_plain_view_of_each_pair_cost_extra(monkeypatch):
    points, directions = np.zeros((3, 3)), unit(np.ones((3, 3)))
    straight = np.zeros(3, dtype=bool), 1.0
    scene = empty_scene()
    monkeypatch.setattr(EmptyScene, "sees_space", True)
    monkeypatch.setattr(EmptyScene, "is_exposed", lambda *_: np.array([True, False, True]))
    costly = Ends(points, directions, *straight, MergeConfig(exposed_end_cost=10))
    assert cost_terms(costly, scene)["exposed ends"].tolist() == [[20, 10, 20], [10, 0, 10], [20, 10, 20]]
    assert "exposed ends" not in cost_terms(Ends(points, directions, *straight, MergeConfig()), scene)


def line(x, y):
    return np.column_stack((np.arange(x, x + 0.101, 0.01), np.full(11, y), np.zeros(11)))


FORK = Curves.of([line(-0.13, 0.0), line(0.0, 0.01), line(0.0, -0.01)])


def joined(**settings):
    """Return on which lines of FORK the pieces of the longest object are, when it costs nothing to pass through free space."""
    config = MergeConfig(chains=2, free_space_weight=0, unknown_weight=0, **settings)
    merged = merge(FORK, empty_scene(radius=0.003), 1.0, config)
    return {round(piece[0, 1], 3) for piece in merged.assemblies[0].pieces}


def test_a_custom_cost_decides_between_equal_pairs(monkeypatch):
    """Two pairs that the paper's costs hold equal, of which the custom cost forbids one."""
    monkeypatch.setitem(CUSTOM_COSTS, "left", lambda points, directions: np.maximum(0, points[:, None, 1] + points[None, :, 1]))
    monkeypatch.setitem(CUSTOM_COSTS, "right", lambda points, directions: np.maximum(0, -points[:, None, 1] - points[None, :, 1]))
    assert joined(custom_costs={"left": 1e4}) == {0.0, -0.01}
    assert joined(custom_costs={"right": 1e4}) == {0.0, 0.01}


def test_a_term_is_a_line_in_the_table(monkeypatch):
    """A function of the ends and the scene that is entered in TERMS decides between equal pairs."""
    monkeypatch.setitem(TERMS, "low", lambda ends, _: 1e4 * np.maximum(0, np.add.outer(*[ends.points[:, 1]] * 2)))
    assert joined() == {0.0, -0.01}


def test_an_unknown_custom_cost_is_refused_by_name():
    with refuses("cost-unknown", "height", "doo3d.plugins.CUSTOM_COSTS", kind=ConfigError):
        joined(custom_costs={"height": 1.0})


@pytest.mark.parametrize("allow_closed", [True, False])
def test_pairs_beyond_a_limit_are_not_allowed(allow_closed):
    rng = np.random.default_rng(0)
    points, tangents, cost, closed = (
        rng.random((12, 3)),
        unit(rng.normal(size=(12, 3))),
        rng.random((12, 12)),
        np.arange(12) // 2 == 2,
    )
    config = MergeConfig(chains=None, max_gap=0.9, max_cost=0.8, allow_closed_chains=allow_closed)
    ends = Ends(points, tangents, closed, 0.01, config, max_turn=2.0)
    expected = cost.copy()
    expected[(ends.distance > 0.9) | (cost > 0.8) | (ends.turns > 2.0) | np.tri(12, dtype=bool)] = np.inf
    expected[closed] = expected[:, closed] = np.inf
    if not allow_closed:
        expected[np.arange(0, 12, 2), np.arange(1, 12, 2)] = np.inf
    np.testing.assert_array_equal(ends.limited(cost, empty_scene()), expected)
    assert np.isfinite(expected).any()

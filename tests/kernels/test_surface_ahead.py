"""Surface points ahead of free ends, against all points and all samples compared."""

import numpy as np
import pytest

from doo3d.kernels import surface_ahead, visits


def slow_surface_ahead(points, samples, ends, tangents, reach, max_offset, max_gap, window):
    found = []
    for end, tangent, half_edge, offset, gap in zip(ends, tangents, reach, max_offset, max_gap, strict=True):
        step = points - samples[end]
        axial = step @ tangent
        lateral = np.linalg.norm(step - axial[:, None] * tangent, axis=1)
        near = (np.abs(step) < half_edge).all(axis=1) & (lateral < offset)
        own = np.linalg.norm(points[:, None] - samples, axis=2).argmin(axis=1)
        near &= np.abs(own - end) <= window
        axial, lateral = axial[near], lateral[near]
        order = np.argsort(axial)
        axial, lateral = axial[order], lateral[order]
        empty = np.flatnonzero((np.diff(axial) > gap) & (axial[1:] > 0))
        stop = empty[0] + 1 if len(empty) else len(axial)
        found.append((axial[:stop], lateral[:stop]))
    return found


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_points_ahead_are_those_of_a_comparison_of_all(dim, seed):
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 12, 60)
    line = np.column_stack([t, np.sin(t), 0.1 * t])[:, :dim]
    samples = np.concatenate([line + np.eye(dim)[1] * 1.5 * k for k in range(4)]) + 1e3
    points = samples[rng.integers(0, len(samples), 3000)] + rng.normal(0, 0.6, (3000, dim))
    points[5] = np.nan
    ends = np.array([0, 59, 60, 119, 180, 239])
    tangents = rng.normal(size=(6, dim))
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    settings = (rng.uniform(2, 4, 6), rng.uniform(0.5, 1, 6), rng.uniform(0.05, 0.3, 6), 5)
    axial, lateral, bounds = surface_ahead(points, samples, ends, tangents, *settings)
    expected = slow_surface_ahead(np.delete(points, 5, axis=0), samples, ends, tangents, *settings)
    assert bounds.tolist() == np.cumsum([0, *(len(each[0]) for each in expected)]).tolist()
    np.testing.assert_allclose(axial, np.concatenate([each[0] for each in expected]), atol=1e-9)
    np.testing.assert_allclose(lateral, np.concatenate([each[1] for each in expected]), atol=1e-9)
    assert len(axial) > 100


def test_no_ends_and_no_points():
    none = np.zeros(0)
    axial, _, bounds = surface_ahead(np.ones((5, 2)), np.zeros((3, 2)), none.astype(int), np.zeros((0, 2)), none, none, none, 1)
    assert not len(axial)
    assert bounds.tolist() == [0]
    one = np.ones(1)
    axial, _, bounds = surface_ahead(np.zeros((0, 2)), np.zeros((3, 2)), np.array([2]), np.ones((1, 2)), one, one, one, 1)
    assert not len(axial)
    assert bounds.tolist() == [0, 0]


def test_points_all_around_a_thick_path_are_not_each_compared_with_most_samples():
    rng = np.random.default_rng(0)
    y, x = np.mgrid[0:8:100j, 0:8:200j].reshape(2, -1)
    points = np.column_stack((x, y, rng.uniform(0, 4, len(x))))
    row, along = np.mgrid[0:8:40j, 0:8:100j].reshape(2, -1)
    samples = np.column_stack((along, row, np.full(len(row), 2.0)))
    ends, tangents, reach = np.array([2000, 2099]), np.array([[-1.0, 0, 0], [1.0, 0, 0]]), np.full(2, 8.0)
    visits()
    surface_ahead(points, samples, ends, tangents, reach, reach / 4, reach, 5)
    assert visits() < 80 * len(points)

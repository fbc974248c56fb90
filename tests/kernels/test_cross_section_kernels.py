"""Cross-section kernels against loops in Python."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.kernels import axis_depth, fit_circles, half_shell_spread, nearest, section_axes, section_offsets, window_sum

PATH = np.repeat([0, 1, 2], [12, 1, 17])


def pooled(values, half):
    size = len(PATH)
    return [sum(values[j] for j in range(size) if PATH[j] == PATH[i] and abs(i - j) <= half) for i in range(size)]


@pytest.mark.parametrize("half", [0, 1, 4, 100, 2**62])
def test_window_sum(half):
    values = np.random.default_rng(0).normal(size=30)
    np.testing.assert_allclose(window_sum(values, PATH, half), pooled(values, half), atol=1e-12)


def test_offsets_are_along_both_axes_of_the_nearest_sample():
    rng = np.random.default_rng(1)
    points, positions = rng.normal(size=(200, 3)), rng.normal(size=(9, 3))
    lateral, depth = rng.normal(size=(2, 9, 3))
    reach = rng.uniform(0.3, 1.5, 9)
    distance, index = nearest(points, positions, 1.5)
    kept = [n for n in range(200) if distance[n] < reach[index[n]]]
    assert 20 < len(kept) < 180
    sample, u, w = section_offsets(points, distance, index, positions, lateral, depth, reach)
    assert sample.tolist() == [index[n] for n in kept]
    np.testing.assert_allclose(u, [(points[n] - positions[index[n]]) @ lateral[index[n]] for n in kept])
    np.testing.assert_allclose(w, [(points[n] - positions[index[n]]) @ depth[index[n]] for n in kept])


@pytest.mark.parametrize("points", [0, 1, 2, 601])
def test_axis_depth_is_the_mean_without_outliers(points):
    rng = np.random.default_rng(2)
    sample, radius = rng.integers(0, 30, points), rng.uniform(1, 2, 30)
    lateral, depth = rng.uniform(-2, 2, points), rng.normal(0, 0.1, points) + 5 * (rng.random(points) < 0.05)
    members = [
        (s, w + np.sqrt(radius[s] ** 2 - u**2))
        for s, u, w in zip(sample, lateral, depth, strict=True)
        if abs(u) < 0.8 * radius[s]
    ]

    def means(members):
        count, total = np.zeros(30), np.zeros(30)
        for s, value in members:
            count[s] += 1
            total[s] += value
        count, total = np.array(pooled(count, 3)), np.array(pooled(total, 3))
        return total / np.maximum(count, 1e-9), count

    first, _ = means(members)
    if members:
        limit = 4.5 * np.median([abs(value - first[s]) for s, value in members])
        inside = [(s, value) for s, value in members if abs(value - first[s]) <= max(limit, 1e-9)]
        assert points < 600 or len(members) - len(inside) > 5
        members = inside
    mean, count = axis_depth(sample, lateral, depth, PATH, radius, 3, 0.8, 4.5)
    expected, number = means(members)
    np.testing.assert_allclose(count, number)
    np.testing.assert_allclose(mean, expected, atol=1e-9)


def circle_by_numpy(u, w, count, radius):
    """Kasa's fit and eight steps of Gauss-Newton through the points of one cross-section."""
    mean = u.mean(), w.mean()
    u, w = u - mean[0], w - mean[1]
    rows, q = np.column_stack((u, w, np.ones_like(u))), u * u + w * w
    ridge = 1e-6 * max(q.sum(), 1e-18) * np.diag((1.0, 1.0, 0.0))
    a, b, c = np.linalg.solve(rows.T @ rows + ridge, rows.T @ q)
    center, size = np.array((a, b)) / 2, np.sqrt(max(c + (a * a + b * b) / 4, 0)) if radius is None else radius
    for _ in range(8):
        off = np.column_stack((u, w)) - center
        distance = np.linalg.norm(off, axis=1)
        rows = np.column_stack((off / distance[:, None], np.full(len(u), float(radius is None))))
        step = np.linalg.solve(rows.T @ rows + 1e-3 * count * np.eye(3), rows.T @ (distance - size))
        limit = max(size, 1e-9) / 2
        center += np.clip(step[:2], -limit, limit)
        size += np.clip(step[2], -limit, limit)
    return center + mean, size


def test_points_of_neighbors_are_pooled_and_too_few_have_no_circle():
    angle = np.linspace(0, 3, 12)
    lateral, depth = 0.01 * np.cos(angle), 0.01 * np.sin(angle)
    center, radii, count = fit_circles(np.arange(12), lateral, depth, PATH, np.zeros(0), 3, 8, 5.0)
    assert count[:13].tolist() == [4, 5, 6, 7, 7, 7, 7, 7, 7, 6, 5, 4, 0]
    np.testing.assert_array_equal(np.isnan(radii), count < 5)
    assert np.isfinite(center).all()


@pytest.mark.parametrize("known", [False, True])
def test_circles_without_neighbors_are_exactly_those_of_numpy(known):
    rng = np.random.default_rng(4)
    sample, angle = np.repeat(np.arange(30), 20), rng.uniform(0, 4, 600)
    lateral, depth = (0.01 * f(angle) + rng.normal(0, 0.001, 600) for f in (np.cos, np.sin))
    center, radii, _ = fit_circles(sample, lateral, depth, PATH, np.full(30, 0.009) if known else np.zeros(0), 0, 8, 5.0)
    for s in range(30):
        wanted, size = circle_by_numpy(lateral[sample == s], depth[sample == s], 20, 0.009 if known else None)
        np.testing.assert_allclose(radii[s], size, rtol=1e-9)
        np.testing.assert_allclose(center[s], wanted, atol=1e-11)


def test_spread_of_half_shells():
    rng = np.random.default_rng(5)
    sample, lateral = rng.integers(0, 29, 500), rng.normal(0.3, 1, 500)
    middle, variance, count, fourth = half_shell_spread(sample, lateral, PATH, 2)
    number = np.bincount(sample, minlength=30)
    np.testing.assert_array_equal(count, pooled(number, 2))
    own = np.array(pooled(np.bincount(sample, lateral, 30), 2)) / np.maximum(count, 1e-9)
    np.testing.assert_allclose(middle, own)
    square = np.array(pooled(np.bincount(sample, (lateral - own[sample]) ** 2, 30), 2)) / np.maximum(count, 1e-9)
    np.testing.assert_allclose(variance, square)
    np.testing.assert_allclose(fourth, ((lateral - own[sample]) / np.sqrt(square[sample])) ** 4, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("viewpoint", [np.zeros(0), np.array([0.1, -3.0, 0.2])])
def test_section_axes_are_right_handed_and_turn_little(viewpoint):
    t = np.linspace(0, 6, 200)
    positions = np.column_stack((np.cos(t), np.sin(t), 0.2 * t))
    tangents = np.gradient(positions, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    lateral, depth = section_axes(positions, tangents, viewpoint)
    axes = np.stack((tangents, lateral, depth), axis=1)
    np.testing.assert_allclose(axes @ axes.transpose(0, 2, 1), np.broadcast_to(np.eye(3), (200, 3, 3)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(axes), 1)
    if not len(viewpoint):
        assert (lateral[1:] * lateral[:-1]).sum(axis=1).min() > 0.99
    else:
        np.testing.assert_allclose(((positions - viewpoint) * lateral).sum(axis=1), 0, atol=1e-12)
        along = positions - viewpoint
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        facing, _ = section_axes(positions, along, viewpoint)
        np.testing.assert_allclose(np.linalg.norm(facing, axis=1), 1)

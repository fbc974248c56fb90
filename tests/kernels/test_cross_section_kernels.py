"""Cross-section kernels against loops in Python."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.kernels import axis_depth, nearest, section_offsets, window_sum

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
    distance, index = nearest(points, positions, 1.5, True)
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

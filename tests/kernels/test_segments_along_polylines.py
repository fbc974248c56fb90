"""Chains of equal segments along polylines, against the steps in NumPy."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from doo3d.geometry.polyline import arc_length, resample, steps, unit
from doo3d.kernels import equal_segments


def compensated(points, length, most_samples):
    """The points moved outwards at their bends by two thirds of a chord's sagitta."""
    spacing = np.median(steps(points))
    apart = 1 if length <= most_samples * spacing else min(round(length / spacing / 4), (len(points) - 1) // 2)
    bend = np.zeros_like(points)
    bend[apart:-apart] = (points[2 * apart :] - 2 * points[apart:-apart] + points[: -2 * apart]) / (apart * spacing) ** 2
    bend[:apart], bend[-apart:] = bend[apart], bend[-apart - 1]
    bend[[0, -1]] = 0
    curvature = np.linalg.norm(bend, axis=1, keepdims=True)
    return points - length**2 / 12 * bend / np.maximum(1.0, 2 * length * curvature)


def shifted(line, shift):
    """The line lengthened or shortened at its last point."""
    if shift >= 0:
        return np.concatenate((line, [line[-1] + shift * unit(line[-1] - line[-2])]))
    along = arc_length(line)
    end = max(along[-1] + shift, along[1])
    return np.concatenate((line[along < end], resample(line, np.array([end]))))


def wave(random, count, dim):
    t = np.linspace(0, random.uniform(1, 6), count)[:, None]
    return t * np.arange(1, dim + 1) + 0.4 * np.sin(2 * t + np.arange(dim)) + random.normal(scale=1e-3, size=(count, dim))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(12))
def test_chains_cover_the_shifted_curves_from_end_to_end(seed, dim):
    random = np.random.default_rng(seed)
    lines = [wave(random, int(random.integers(4, 400)), dim) for _ in range(4)]
    bounds, closed = np.cumsum([0, *map(len, lines)]), np.array([False, True, False, False])
    shifts, length, most = random.uniform(-0.3, 0.3, 8), random.uniform(0.2, 0.6), 10
    joints, starts = equal_segments(np.concatenate(lines), bounds, closed, shifts, length, most)
    for k, (a, b) in enumerate(pairwise(starts.tolist())):
        if closed[k]:
            assert a == b
            continue
        line = shifted(shifted(compensated(lines[k], length, most), shifts[2 * k + 1])[::-1], shifts[2 * k])[::-1]
        chain, total = joints[a:b], arc_length(line)[-1]
        np.testing.assert_allclose(steps(chain), length, rtol=1e-9)
        dense = resample(line, np.linspace(0, total, 5000))
        inside = chain[1:-1]
        assert np.linalg.norm(inside[:, None] - dense[None], axis=2).min(axis=1).max(initial=0) < 1e-3 * length + total / 5000
        beyond = [np.linalg.norm(chain[end] - line[end]) for end in (0, -1)]
        assert max(beyond) < 0.6 * length


def test_repeated_ends_have_no_direction():
    points = np.array([(0.0, 0.0), (0.0, 0.0), (1.0, 0.0), (2.2, 0.0), (2.2, 0.0)])
    joints, _ = equal_segments(points, np.array([0, 5]), np.zeros(1, dtype=bool), np.zeros(2), 1.0, 0)
    np.testing.assert_allclose(joints, [(0.1, 0), (1.1, 0), (2.1, 0)], atol=1e-12)


def test_a_polyline_shorter_than_half_a_segment_has_no_chain():
    points = np.array([(0.0, 0.0), (0.4, 0.0), (0.0, 0.0), (0.6, 0.0)])
    joints, starts = equal_segments(points, np.array([0, 2, 4]), np.zeros(2, dtype=bool), np.zeros(4), 1.0, 0)
    assert starts.tolist() == [0, 0, 2]
    np.testing.assert_allclose(joints, [(-0.2, 0), (0.8, 0)], atol=1e-12)

"""Lines through neighborhoods, against the same in NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from doo3d.kernels import fit_lines

CANDIDATES, RATIO = 8, 1 / 12


def fit_by_numpy(offset, distance, scale, width):
    """Points, center, direction, variances, length, and squared distance of the point itself: one neighborhood (K, 3), (K,)."""
    inside = distance <= 1.2 * scale
    pick = np.minimum(np.maximum(1, inside.sum() * np.arange(1, CANDIDATES + 1) // (CANDIDATES + 1)), len(offset) - 1)
    norm = np.linalg.norm(offset[pick], axis=1, keepdims=True)
    tried = offset[pick] / np.where(norm > 0, norm, 1)
    axial = offset @ tried.T
    lateral = distance[:, None] ** 2 - axial**2
    counted = (np.abs(axial) <= scale) & inside[:, None]
    direction = tried[(np.maximum(0.0, 1 - lateral / width**2) * counted).sum(axis=0).argmax()]
    center = np.zeros(3)
    for _ in range(3):
        moved = offset - center
        lateral = (moved**2).sum(axis=1) - (moved @ direction) ** 2
        member = (lateral <= width**2) & (np.abs(offset @ direction) <= scale)
        n = max(member.sum(), 1)
        center = offset[member].sum(axis=0) / n
        moved = offset[member] - center
        variance, vectors = np.linalg.eigh(moved.T @ moved / n)
        direction = vectors[:, 2]
    length = np.ptp(np.append(moved @ direction, 0.0))
    return member.sum(), center, direction, variance, length, (center**2).sum() - (center @ direction) ** 2


def lines_by_numpy(points, at, distance, index, scales, widths, least):
    """Found, center, direction, across, spacing, scale and count of each neighborhood."""
    rows = [(False, p, np.zeros(3), 0.0, 0.0, 0.0, 0) for p in at]
    for scale, width, wanted in zip(scales, widths, least, strict=True):
        todo = [s for s in range(len(at)) if not rows[s][0] and (distance[s, -1] >= scale or distance.shape[1] == len(points))]
        used = max(2, *(int(np.searchsorted(distance[s], 1.2 * scale)) for s in todo)) if todo else 2
        for s in todo:
            n, center, direction, variance, length, own = fit_by_numpy(
                points[index[s, :used]] - at[s], distance[s, :used], scale, width
            )
            across = max(variance[0] + variance[1], 0.0) * n / max(n - 2, 1)
            if n >= wanted and across <= RATIO * variance[2] and own <= 9 * across + (0.1 * scale) ** 2:
                rows[s] = (True, at[s] + center, direction, np.sqrt(across), length / (n - 1), scale, n)
    return [np.array(column) for column in zip(*rows, strict=True)]


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.04])
@pytest.mark.parametrize("kind", ["wires", "surface"])
def test_lines_are_those_of_numpy(kind, noise):
    rng = np.random.default_rng(1)
    points = rng.uniform(0, 5, (400, 3)) * ((1, 0, 0) if kind == "wires" else (1, 1, 0))
    points[:, 1] += 0.5 * rng.integers(0, 3, 400) if kind == "wires" else 0
    points += rng.normal(0, noise, points.shape)
    at = np.ascontiguousarray(points[::7])
    distance, index = cKDTree(points).query(at, k=48)
    scales = 0.1 * 1.4 ** np.arange(6)
    given = (points, at, distance, index, scales, 0.5 * scales, np.full(6, 7.0))
    found, center, direction, *rest = fit_lines(*given, CANDIDATES, RATIO)
    wanted = lines_by_numpy(*given)
    np.testing.assert_array_equal(found, wanted[0])
    assert (found.mean() > 0.6) == (kind == "wires")
    np.testing.assert_allclose(center, wanted[1], atol=1e-9)
    np.testing.assert_allclose(np.abs((direction * wanted[2]).sum(axis=1)), found, atol=1e-9)
    for column, other in zip(rest, wanted[3:], strict=True):
        np.testing.assert_allclose(column, other, atol=1e-7)


def test_equal_points_have_no_line():
    points = np.ones((20, 3))
    near = np.tile(np.arange(20), (20, 1))
    found, center, *_ = fit_lines(points, points, np.zeros((20, 20)), near, np.ones(2), np.ones(2), np.full(2, 7.0), 8, RATIO)
    assert np.isfinite(center).all()
    assert found.shape == (20,)

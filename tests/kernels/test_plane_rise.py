"""Axes raised out of a plane, against a plain computation in NumPy."""

import numpy as np

from doo3d.kernels import raised_to_plane

FX, FY, CX, CY = 300.0, 310.0, 59.5, 39.5
BESIDE = np.array([2.0, 4.0, 6.0])
NEAR, SUNK = 1.5, 3.0


def slow_raised(points, lateral, behind, target, radius, depth, mask, plane):
    *normal, level = plane
    normal, result = np.array(normal), target.copy()
    for i, axis in enumerate(target):
        low, slope = axis @ normal - level, -(behind[i] @ normal)
        if not (-SUNK * radius[i] < low < radius[i] and slope > 0):
            continue
        heights = []
        for offset in np.concatenate((-1, 1) * (radius[i] + BESIDE * points[i, 2] / FX)[:, None]):
            x, y, z = points[i] + offset * lateral[i]
            u, v = round(FX * x / z + CX), round(FY * y / z + CY)
            if 0 <= u < depth.shape[1] and 0 <= v < depth.shape[0] and not mask[v, u] and depth[v, u] > 0:
                reading = float(depth[v, u])
                heights.append(np.array(((u - CX) / FX, (v - CY) / FY, 1.0)) * reading @ normal - level)
        if heights and abs(np.median(heights)) < NEAR * radius[i]:
            result[i] -= min((radius[i] - low) / slope, (1 + SUNK) * radius[i]) * behind[i]
    return result


def test_axes_are_raised_as_by_a_plain_computation():
    rng = np.random.default_rng(0)
    points = np.column_stack((rng.uniform(-0.12, 0.12, 200), rng.uniform(-0.08, 0.08, 200), rng.uniform(0.48, 0.52, 200)))
    lateral, behind = (each / np.linalg.norm(each, axis=1, keepdims=True) for each in rng.normal((1, 0, 0), 0.2, (2, 200, 3)))
    behind = np.roll(behind, 1, axis=1)[:, ::-1].copy()
    behind[::10] *= -1  # seen from below
    target, radius = points + rng.normal(0, 0.002, points.shape), rng.uniform(0.003, 0.008, 200)
    depth = np.where(rng.random((80, 120)) < 0.8, 0.5 + 0.004 * rng.normal(size=(80, 120)), 0).astype(np.float32)
    depth[:, 90:] += 0.2  # beyond the edge of the table
    mask = rng.random((80, 120)) < 0.3
    plane = np.array((0.0, 0.06, -np.sqrt(1 - 0.06**2), -0.5))
    arguments = points, lateral, behind, target, radius, depth, mask
    raised = raised_to_plane(*arguments, np.array((FX, FY, CX, CY)), plane, BESIDE, NEAR, SUNK)
    np.testing.assert_allclose(raised, slow_raised(*arguments, plane), atol=1e-12)
    moved = (raised != target).any(axis=1)
    assert 20 < np.count_nonzero(moved) < 180

"""Depth readings beside the segments of chains, against a plain computation in NumPy."""

import numpy as np
import pytest

from doo3d.kernels import depth_support

FX, FY, CX, CY = 200.0, 210.0, 59.5, 39.5
POSITIONS = (np.arange(5) + 0.5) / 5
LATERAL = np.linspace(-0.7, 0.7, 5)
SURFACE, LEAST, MOST, FACTOR, LYING = 0.85, 1.2, 2.5, 3 * 1.4826, 1.5


def slow_depth_support(joints, radius, depth, mask, plane=None):
    axis = joints[:-1, None] + POSITIONS[:, None] * np.diff(joints, axis=0)[:, None]
    z = np.where(axis[..., 2] > 0, axis[..., 2], np.nan)
    centers = np.stack((FX * axis[..., 0] / z + CX, FY * axis[..., 1] / z + CY), axis=-1)
    along = centers[:, -1] - centers[:, 0]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    lateral = np.column_stack((-along[:, 1], along[:, 0]))
    pixels = centers[:, :, None] + ((radius * FX / z)[..., None] * LATERAL)[..., None] * lateral[:, None, None]
    in_view = np.isfinite(centers).all(axis=(1, 2))
    u, v = np.rint(np.where(in_view[:, None, None, None], pixels, -1.0)).astype(int).transpose(3, 0, 1, 2)
    inside = (u >= 0) & (v >= 0) & (u < mask.shape[1]) & (v < mask.shape[0])
    u, v = np.where(inside, u, 0), np.where(inside, v, 0)
    measured = inside & mask[v, u] & (depth[v, u] > 0)
    raw = error = depth[v, u] - (z[..., None] - SURFACE * radius)
    if plane is not None:
        *normal, level = plane
        height = axis @ np.array(normal) - level
        on_ray = level * z / (height + level)  # where the ray of the axis meets the plane
        below = np.where((height > 0) & (height < LYING * radius), np.maximum(0, on_ray - z + SURFACE * radius), 0.0)
        error = np.where(error > 0, np.maximum(0, error - below[..., None]), error)
    residual = np.abs(error)
    limit = min(max(FACTOR * float(np.median(residual[measured])), LEAST * radius), MOST * radius)
    with np.errstate(invalid="ignore"):
        shares = [(measured & (residual < most)).mean(axis=(1, 2)) for most in (LEAST * radius, limit)]
    medians = [
        [np.median(e[m]) / radius if m.sum() >= 3 else np.nan for e, m in zip(each, measured, strict=True)]
        for each in (error, raw)
    ]
    return *shares, np.abs(medians[0]), np.array(medians[1])


@pytest.mark.parametrize("plane", [None, np.array((0.0, 0.1, -np.sqrt(0.99), -0.56))])
def test_support_is_that_of_a_plain_computation(plane):
    rng = np.random.default_rng(0)
    chains = [np.cumsum(rng.normal(0.01, 0.02, (12, 3)), axis=0) + np.array((-0.1, -0.1, 0.5)) for _ in range(4)]
    chains[2][5:] -= (0, 0, 1.0)  # behind the camera
    radius = np.array([0.004, 0.01, 0.02, 0.003])
    depth = np.where(rng.random((80, 120)) < 0.8, 0.55 + 0.02 * rng.normal(size=(80, 120)), 0).astype(np.float32)
    mask = rng.random((80, 120)) < 0.7
    bounds = np.arange(0, 60, 12)
    found = depth_support(
        np.concatenate(chains), bounds, radius, depth, mask, np.array((FX, FY, CX, CY)),
        np.zeros(0) if plane is None else plane, POSITIONS, LATERAL, surface_radii=SURFACE, lying_radii=LYING, deviations=3.0,
    )  # fmt: skip
    slow = [slow_depth_support(chain, r, depth, mask, plane) for chain, r in zip(chains, radius, strict=True)]
    for values, expected in zip(found, zip(*slow, strict=True), strict=True):
        np.testing.assert_allclose(values, np.concatenate(expected), rtol=1e-9)
    assert 0 < found[0].max()
    assert np.isnan(found[2]).any()
    assert np.isfinite(found[2]).any()

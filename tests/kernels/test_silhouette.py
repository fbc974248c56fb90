"""The middle and the width of a mask across paths, against a plain computation in NumPy."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from doo3d.geometry.curves import Curves
from doo3d.geometry.polyline import unit
from doo3d.kernels import silhouette

CAMERA = np.array((300.0, 310.0, 80.0, 60.0))
STEP = 1e-4


def project(points):
    return np.column_stack([CAMERA[d] * points[:, d] / points[:, 2] + CAMERA[2 + d] for d in (0, 1)])


def slow_silhouette(positions, along, lateral, path, pixels, share, reach, half):
    seen, across, scale = positions, lateral, np.ones(len(positions))
    if positions.shape[1] == 3:
        seen = project(positions)
        ahead = unit(project(positions + STEP * along) - seen)
        across = np.column_stack((-ahead[:, 1], ahead[:, 0]))
        scale = ((project(positions + STEP * lateral) - seen) * across).sum(axis=1) / STEP
    distance, near = cKDTree(seen).query(pixels)
    own = distance < (reach * np.abs(scale))[near]
    beside = ((pixels - seen[near]) * across[near]).sum(axis=1)
    step = np.linalg.norm(np.diff(seen, axis=0), axis=1) * (np.diff(path) == 0)
    length = (np.append(0, step) + np.append(step, 0)) / 2
    offset, radius = np.zeros(len(path)), np.zeros(len(path))
    for s in range(len(path)):
        window = np.flatnonzero((np.abs(np.arange(len(path)) - s) <= half) & (path == path[s]))
        of_window = own & np.isin(near, window)
        if of_window.any():
            offset[s] = beside[of_window].mean() / scale[s]
            radius[s] = share * of_window.sum() / length[window].sum() / abs(scale[s]) / 2
    return offset, radius


@pytest.mark.parametrize("dim", [2, 3])
def test_middle_and_width_are_those_of_a_plain_computation(dim):
    t = np.linspace(0, 2, 40)
    lines = [np.column_stack((0.12 * t - 0.12, 0.03 * np.sin(3 * t) + y, 0.5 + 0.05 * t)) for y in (-0.04, 0.0, 0.03)]
    if dim == 2:
        lines = [np.ascontiguousarray(300 * line[:, :2] + (80, 60)) for line in lines]
    positions, along = np.concatenate(lines), np.concatenate([Curves.of([line]).tangents for line in lines])
    lateral = np.column_stack((-along[:, 1], along[:, 0]))
    lateral = lateral if dim == 2 else unit(np.cross(positions, along))
    path, reach = np.repeat([0, 1, 2], 40), np.linspace(0.01, 0.02, 120) * (1 if dim == 3 else 600)
    pixels = np.argwhere(np.random.default_rng(dim).random((160, 120)) < 0.6).astype(float, order="C")
    camera = np.zeros(0) if dim == 2 else CAMERA
    found = silhouette(positions, along, lateral, path, pixels, 1.5, camera, reach, 2)
    expected = slow_silhouette(positions, along, lateral, path, pixels, 1.5, reach, 2)
    for values, reference in zip(found, expected, strict=True):
        np.testing.assert_allclose(values, reference, rtol=1e-8, atol=1e-12)
    assert (found[1] > 0).any()


def test_a_sample_behind_the_camera_is_refused():
    axes = np.eye(3)
    with pytest.raises(ValueError, match="behind the camera"):
        silhouette(-axes[2:], axes[:1], axes[1:2], np.zeros(1, int), np.ones((1, 2)), 1.0, CAMERA, np.ones(1), 1)

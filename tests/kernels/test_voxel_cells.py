"""Voxels of points against NumPy's and SciPy's on the full grid."""

from __future__ import annotations

import math

import numpy as np
import pytest
from builders.blobs import component_of
from scipy import ndimage

from doo3d.kernels import VoxelCells, neighbor_table

ALL = np.zeros(0, dtype=np.int64)


def as_3d(coords):
    return coords if coords.shape[1] == 3 else np.column_stack((coords, np.ones(len(coords), dtype=np.int64)))


def slow_voxels(points, cells, size, keys, least):
    """Coords, centroids, counts and neighbors of the voxels with these keys, without small components."""
    coords = np.column_stack(np.unravel_index(keys, tuple(cells.shape)))
    cell = np.searchsorted(keys, np.ravel_multi_index(tuple(((points - cells.origin) / size).astype(int).T), tuple(cells.shape)))
    counts = np.bincount(cell, minlength=len(keys))
    sums = np.column_stack([np.bincount(cell, weights=column, minlength=len(keys)) for column in points.T])
    centers = cells.origin + (coords + 0.5) * size
    centroids = np.where(counts[:, None] > 0, sums / np.maximum(counts, 1)[:, None], centers)
    table = neighbor_table(as_3d(coords))
    label = component_of(table)
    for row in np.flatnonzero(counts == 0):
        near = table[row][table[row] >= 0]
        near = near[counts[near] > 0]
        if len(near):
            centroids[row] = centroids[near].sum(axis=0) / len(near)
    kept = np.bincount(label)[label] >= least
    return coords[kept], centroids[kept], counts[kept], neighbor_table(as_3d(coords[kept]))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("size", [2.0, 0.5, 0.2, 1e-5])
def test_cells_are_those_of_numpy(dim, size):
    points = np.random.default_rng(dim).normal(size=(3000, dim))
    cells = VoxelCells(points, size, 2, 4e18)
    assert cells.origin.tolist() == ((np.floor(points.min(axis=0) / size) - 2) * size).tolist()
    coords = np.floor((points - cells.origin) / size).astype(np.int64)
    assert cells.shape.tolist() == (coords.max(axis=0) + 3).tolist()
    assert cells.total == pytest.approx(math.prod(cells.shape.tolist()))
    np.testing.assert_array_equal(cells.keys, np.unique(np.ravel_multi_index(tuple(coords.T), tuple(cells.shape))))
    assert len(VoxelCells(points, size, 2, 0.99 * cells.total).keys) == 0


@pytest.mark.parametrize("shape", [(9, 14), (9, 8, 10)])
@pytest.mark.parametrize("iterations", [0, 1, 2])
@pytest.mark.parametrize("parts", [1, 3])
def test_closing_is_that_of_morphology_part_by_part(shape, iterations, parts):
    cube = np.ones((2 * iterations + 1,) * len(shape), bool)
    for seed in range(5):
        rng = np.random.default_rng(seed)
        points = np.ascontiguousarray(np.argwhere(rng.random(shape) < 0.25) + 0.5)
        part = rng.integers(0, parts, len(points))
        cells = VoxelCells(points, 1.0, iterations + 1, 1e18)
        expected = np.zeros(tuple(cells.shape), bool)
        for number in range(parts):
            own = np.zeros(tuple(cells.shape), bool)
            own[tuple((points[part == number] - cells.origin).astype(int).T)] = True
            expected |= own | (ndimage.binary_erosion(ndimage.binary_dilation(own, cube), cube) if iterations else own)
        closed = cells.closed(iterations, ALL if parts == 1 else part)
        assert closed.tolist() == np.flatnonzero(expected).tolist()
        assert closed.dtype == np.int64


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("least", [1, 4, 1000])
@pytest.mark.parametrize("seed", range(4))
def test_voxels_are_those_of_numpy_to_the_bit(dim, least, seed):
    points = np.random.default_rng(seed).uniform(-0.3, 0.3, (400, dim)) ** 3
    cells = VoxelCells(points, 0.003, 2, 1e18)
    keys = cells.closed(1, ALL)
    assert len(keys) > len(cells.keys)
    found, wanted = cells.voxels(keys, least), slow_voxels(points, cells, 0.003, keys, least)
    for one, other in zip(found, wanted, strict=True):
        np.testing.assert_array_equal(one, other)


def test_what_does_not_fit_is_refused():
    points = np.full((3, 3), 1.05)
    cells = VoxelCells(points, 0.1, 1, 1e18)
    for keys, sentence in ((cells.keys - 1, "occupied"), (cells.keys + 100, "box"), (np.append(cells.keys, 0), "ascending")):
        with pytest.raises(ValueError, match=sentence):
            cells.voxels(keys, 1)
    for part in (np.zeros(2, int), np.full(3, -1), np.full(3, 3)):
        with pytest.raises(ValueError, match="part"):
            cells.closed(1, part)
    for wrong in (np.nan, np.inf):
        with pytest.raises(ValueError, match="finite"):
            VoxelCells(points * wrong, 0.1, 1, 1e18)
    with pytest.raises(ValueError, match="neither"):
        VoxelCells(points[:, :1].copy(), 0.1, 1, 1e18)
    with pytest.raises(ValueError, match="64 bits"):
        VoxelCells(np.array([[0.0, 0.0, 0.0], [2e6, 2e6, 2e6]]), 1.0, 1, 9e18).voxels(ALL, 1)

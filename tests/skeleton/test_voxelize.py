"""Voxels: centroids, counts, closing, and grids that are too large."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders.blobs import component_of
from builders.blue_cable import scene_of
from builders.drawn_masks import CAMERA, frame_of, line, surface, wave
from builders.errors import refuses
from builders.scenes import cloud_scene, frame_scene, image_scene
from scipy.ndimage import binary_closing

from doo3d.config import SegmentConfig
from doo3d.kernels import neighbor_table
from doo3d.skeleton.core_pixels import occluding_edge_pixels
from doo3d.skeleton.voxelize import MAX_CELLS, voxelize
from doo3d.types import Frame

dims = pytest.mark.parametrize("dim", [2, 3])


@pytest.fixture
def constants(monkeypatch):
    """Set constants of the stage for one test, such as constants(MAX_CELLS=215)."""

    def put(**values):
        for name, value in values.items():
            monkeypatch.setattr(f"doo3d.skeleton.voxelize.{name}", value)

    return put


@pytest.fixture
def keep_small(constants):
    """Pieces of any size stay."""
    constants(MIN_COMPONENT=1)


def grid_of(points, **settings):
    return voxelize(cloud_scene(np.asarray(points, dtype=float), **({"voxel": 1.0, "radius": 2.0} | settings)))


def cells_of(solid):
    """Four points in each set cell of a bool array, and not on any border."""
    cells = np.argwhere(solid)
    around = np.random.default_rng(0).uniform(0.1, 0.9, (4, len(cells), solid.ndim))
    return (cells + around).reshape(-1, solid.ndim)


def back(grid, shape):
    """The grid as a bool array like the one that `cells_of` took."""
    found = np.zeros(shape, dtype=bool)
    found[tuple(np.rint(grid.coords + grid.origin / grid.size).astype(int).T)] = True
    return found


@dims
@pytest.mark.parametrize("size", [0.7, 3.0])
def test_centroids_and_counts(dim, size, constants):
    constants(MIN_COMPONENT=1, CLOSING_ITERATIONS=0)
    points = np.random.default_rng(dim).normal(scale=4, size=(500, dim))
    grid = grid_of(points, voxel=size)
    cell = np.floor(points / size)
    expected = {tuple(c): points[(cell == c).all(axis=1)] for c in np.unique(cell, axis=0)}
    assert len(grid.coords) == len(expected)
    assert grid.counts.sum() == 500
    place = np.rint(grid.coords + grid.origin / size)
    for c, centroid, count in zip(place, grid.centroids, grid.counts, strict=True):
        np.testing.assert_allclose(centroid, expected[tuple(c)].mean(axis=0))
        assert count == len(expected[tuple(c)])
    assert grid.size == size
    assert (grid.coords >= 1).all()
    assert (np.diff(np.ravel_multi_index(tuple(grid.coords.T), tuple(grid.coords.max(axis=0) + 1))) > 0).all()


@dims
@pytest.mark.parametrize("times", [1, 2])
@pytest.mark.parametrize("seed", range(3))
def test_closing_is_that_of_morphology(dim, times, seed, constants):
    constants(MIN_COMPONENT=1, CLOSING_ITERATIONS=times)
    solid = np.zeros([16] * dim, dtype=bool)
    solid[(slice(4, -4),) * dim] = np.random.default_rng(seed).random([8] * dim) < 0.4
    expected = binary_closing(solid, np.ones([2 * times + 1] * dim)) | solid
    assert expected.sum() > solid.sum()
    np.testing.assert_array_equal(back(grid_of(cells_of(solid)), solid.shape), expected)


@dims
@pytest.mark.usefixtures("keep_small")
def test_closing_fills_a_hole_and_leaves_a_box(dim):
    solid = np.zeros([12] * dim, dtype=bool)
    solid[(slice(3, 9),) * dim] = True
    np.testing.assert_array_equal(back(grid_of(cells_of(solid)), solid.shape), solid)
    holed = solid.copy()
    holed[(5,) * dim] = False
    grid = grid_of(cells_of(holed))
    np.testing.assert_array_equal(back(grid, solid.shape), solid)
    (added,) = np.flatnonzero(grid.counts == 0)
    near = np.abs(grid.coords - grid.coords[added]).max(axis=1) == 1
    np.testing.assert_allclose(grid.centroids[added], grid.centroids[near].mean(axis=0))


@dims
def test_small_components_are_removed(dim, constants):
    solid = np.zeros([20] * dim, dtype=bool)
    solid[(slice(2, 12), *[3] * (dim - 1))] = True
    solid[(slice(15, 18), *[15] * (dim - 1))] = True
    for least, count in ((3, 13), (4, 10), (11, 0)):
        constants(MIN_COMPONENT=least)
        assert len(grid_of(cells_of(solid)).coords) == count


@dims
def test_empty_in_empty_out(dim):
    grid = voxelize(image_scene(np.zeros((4, 4), bool)) if dim == 2 else cloud_scene(np.zeros((0, dim))))
    assert grid.coords.shape == grid.centroids.shape == (0, dim)
    assert grid.counts.shape == (0,)


@dims
@pytest.mark.parametrize("count", [1, 7])
@pytest.mark.parametrize("size", [None, 0.01])
@pytest.mark.usefixtures("keep_small")
def test_points_in_one_position(dim, count, size):
    scene = cloud_scene(np.tile(np.arange(1.0, dim + 1), (count, 1)), voxel=size)
    grid = voxelize(scene)
    assert grid.counts.tolist() == [count]
    np.testing.assert_allclose(grid.centroids, [np.arange(1.0, dim + 1)])
    assert np.isfinite(grid.size)
    assert np.isfinite(scene.radius)


def test_a_grid_too_large_is_refused_with_the_number(constants):
    points = cells_of(np.ones((6, 6, 6), dtype=bool))
    constants(MAX_CELLS=216)
    assert len(grid_of(points).coords) == 216
    constants(MAX_CELLS=215)
    with refuses("voxels-too-many", "216", "215", "voxelize.size"):
        grid_of(np.concatenate((points, points)))


def test_a_box_that_no_number_can_count_is_refused():
    with refuses("voxels-too-many", "1e-06", "voxelize.size"):
        grid_of([[0, 0, 0], [1e3, 1e3, 1e3]], voxel=1e-6)


@pytest.mark.usefixtures("keep_small")
def test_a_far_point_costs_nothing():
    near = cells_of(np.ones((5, 5, 5), dtype=bool))
    grid = grid_of(np.concatenate((near, [[3e4, 3e4, 3e4]])))
    assert len(grid.coords) == 126


@pytest.mark.slow
def test_a_million_points_in_a_plane_are_handled_or_refused(constants):
    points = np.column_stack((np.random.default_rng(0).uniform(-0.5, 0.5, (1_000_000, 2)), np.full(1_000_000, 1.0)))
    grid = voxelize(cloud_scene(points))
    assert 0 < len(grid.coords) <= MAX_CELLS
    constants(MAX_CELLS=1000)
    with refuses("voxels-too-many", "1000"):
        voxelize(cloud_scene(points, voxel=0.01))


@pytest.mark.parametrize("shift", [(0, 0, 0), (-3, 2, 7)])
def test_the_order_of_points_does_not_matter(shift):
    points = surface(wave(), 0.004) + np.array(shift)
    one = grid_of(points, voxel=0.003)
    other = grid_of(np.random.default_rng(0).permutation(points), voxel=0.003)
    np.testing.assert_array_equal(other.coords, one.coords)
    np.testing.assert_array_equal(other.counts, one.counts)
    np.testing.assert_allclose(other.centroids, one.centroids, atol=1e-12)


@pytest.mark.usefixtures("keep_small")
def test_filtered_points_are_voxelized():
    filtered = np.array([[0.5, 0.5, 0.5], [0.6, 0.5, 0.5], [5.5, 0.5, 0.5]])
    grid = voxelize(replace(cloud_scene(filtered + 0.7, voxel=1.0), filtered=filtered))
    assert grid.counts.tolist() == [2, 1]
    np.testing.assert_allclose(grid.centroids, [[0.55, 0.5, 0.5], [5.5, 0.5, 0.5]])


def test_coarse_voxels_need_fewer_for_a_component():
    axis = np.column_stack((np.linspace(0, 5, 6), np.zeros((6, 2)))) + 0.5
    assert len(grid_of(axis, radius=2.0).coords) == 0
    assert len(grid_of(axis, radius=1.0).coords) == 6


def test_small_components_of_a_frame_are_torn_strands():
    """Six voxels are no component of a cloud, but a piece of a strand far away; two of a frame are none either."""
    frame, sizes = Frame(None, np.full((480, 640), 0.5, np.float32), CAMERA), {"voxel": 0.005, "radius": 0.01}
    for length, stays in ((0.03, True), (0.004, False)):
        piece = np.zeros((480, 640), dtype=bool)
        piece[240, 320 : 320 + int(length * CAMERA.fx / 0.5)] = True
        scene = frame_scene(frame, piece, **sizes)
        assert len(voxelize(cloud_scene(scene.points, **sizes)).coords) == 0
        assert (len(voxelize(scene).coords) >= 6) == stays


@pytest.mark.parametrize("radius", [0.001, 0.004, 0.02])
@pytest.mark.parametrize("view", ["whole", "half", "image"])
def test_the_radius_is_about_right_before_there_is_a_chain(radius, view):
    axis = line([-0.15, 0.02, 0.5], [0.15, -0.03, 0.55])
    if view == "image":
        scene = frame_scene(*frame_of(axis, radius=radius))
    else:
        scene = cloud_scene(surface(axis, radius, None if view == "whole" else np.zeros(3), spacing=radius / 4))
    assert scene.radius == pytest.approx(radius, rel=0.35)
    assert scene.voxel <= 2.5 * max(radius, 0.55 / CAMERA.fx)
    assert voxelize(scene).size == scene.voxel


def test_a_known_radius_is_used():
    assert cloud_scene(surface(wave(), 0.004), radius=0.007).radius == 0.007


def test_closing_does_not_bridge_background_of_the_mask():
    """Two cables of 5 mm radius side by side with 7 to 12 mm between them; holes inside the mask are closed all the same."""
    for gap in (0.007, 0.009, 0.012):
        axes = [line([-0.1, y, 0.5], [0.1, y + 0.01, 0.5]) for y in (0, 0.01 + gap)]
        frame, mask = frame_of(*axes)
        depth = frame.depth.copy()
        depth[np.random.default_rng(0).random(depth.shape) < 0.3] = 0
        grid = voxelize(frame_scene(Frame(None, depth, CAMERA), mask))
        label = component_of(neighbor_table(grid.coords))
        assert sorted(np.bincount(label) > 200) == [True, True]
        assert (grid.counts == 0).any()


def strands(below, tilt=0.0):
    """A strand of 8 mm radius across another one whose axis is `below` m farther away; tilted by a slope away from the camera."""
    across = line([0.0, -0.1, 0.5 - 0.1 * tilt], [0.0, 0.1, 0.5 + 0.1 * tilt])
    along = line([-0.12, 0.0, 0.5 + below], [0.12, 0.0, 0.5 + below])
    frame, mask = frame_of(*([across] if below == 0 else [across, along]), radius=0.008)
    return scene_of(frame, SegmentConfig(), mask)


def test_a_strand_beneath_another_has_occluding_edges():
    """Touching, two radii apart: the edge pixels are two bars across the lower strand, beside the upper one."""
    scene = strands(0.017)
    shown = occluding_edge_pixels(scene, 1.2 * 0.008, 0.008 * CAMERA.fx / 0.5)
    assert (scene.depth[shown] > 0.505).all()
    for side in (-1, 1):
        x = np.round(CAMERA.project(np.array([[side * 0.0095, 0.0, 0.509]]))).astype(int)[0]
        assert shown[x[1], x[0]]


@pytest.mark.parametrize("slope", [0.0, 1.0, 2.5])
def test_a_strand_that_runs_away_steeply_has_no_occluding_edge(slope):
    assert not occluding_edge_pixels(strands(0.0, slope), 1.2 * 0.008, 0.008 * CAMERA.fx / 0.5).any()


@pytest.mark.parametrize("least", [1, 12])
def test_the_neighbors_are_those_of_the_voxels_that_stay(least, constants):
    constants(MIN_COMPONENT=least)
    points = np.concatenate((surface(wave(), 0.004), [[9.0, 9.0, 9.0]]))
    grid = grid_of(points, voxel=0.003, radius=0.006)
    np.testing.assert_array_equal(grid.neighbors, neighbor_table(grid.coords))
    assert not grid.neighbors.flags.writeable

"""Thinning: the topology stays, the ends stay, and only what must stay is left."""

from __future__ import annotations

import numpy as np
import pytest
from builders.blobs import blob, coords_of, ring, solid_of, swept, topology, trefoil
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from skimage.measure import euler_number, label
from skimage.morphology import skeletonize as lee

from doo3d.kernels import neighbor_table, thin_voxels

OFFSETS = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)])


def skeletonize(coords):
    """Which of the voxels (M, 3) are the curve skeleton: (M,) bool."""
    return thin_voxels(neighbor_table(coords))


WIDE = (34, 34, 22)


def box(*edges):
    solid = np.zeros([edge + 2 for edge in edges], dtype=bool)
    solid[1:-1, 1:-1, 1:-1] = True
    return solid


def helix():
    t = np.linspace(0, 3 * np.pi, 300)
    return np.column_stack((16 + 10 * np.cos(t), 16 + 10 * np.sin(t), 4 + 1.5 * t))


def shell():
    solid = box(9, 8, 7)
    solid[3:-3, 3:-3, 3:-3] = False
    return solid


def sheet():
    x, y = np.meshgrid(np.arange(24), np.arange(20), indexing="ij")
    solid = np.zeros((24, 20, 12), dtype=bool)
    height = np.rint(5 + 3 * np.sin(x / 5) + np.cos(y / 3)).astype(int)
    solid[x, y, height] = solid[x, y, height + 1] = True
    return solid


def holed_sheet():
    solid = np.zeros((20, 20, 5), dtype=bool)
    solid[1:19, 1:19, 2] = True
    solid[4:7, 4:7] = solid[12:15, 3:9] = solid[10, 14] = False
    return solid


def half_tube():
    solid = swept(helix(), 3.2, WIDE)
    inner = swept(helix(), 2.1, WIDE)
    front = np.arange(WIDE[2])[None, None] >= 11
    return solid & ~inner & front


def knotted():
    return swept(trefoil(np.array([16.5, 16.5, 10.0]), 4.2), 1.8, WIDE)


SHAPES = {
    "tube": (swept(helix(), 2.6, WIDE), (1, 0, 0)),
    "torus": (swept(ring(np.array([16, 16, 10]), 10), 2.4, WIDE), (1, 1, 0)),
    "two tori linked": (
        swept(ring(np.array([12, 16, 10]), 8), 1.8, WIDE) | swept(ring(np.array([21, 16, 10]), 8, 1), 1.8, WIDE),
        (2, 2, 0),
    ),
    "trefoil": (knotted(), (1, 1, 0)),
    "box": (box(9, 7, 5), (1, 0, 0)),
    "rod": (box(20, 3, 3), (1, 0, 0)),
    "shell": (shell(), (1, 0, 1)),
    "sheet": (sheet(), (1, 0, 0)),
    "holed sheet": (holed_sheet(), (1, 3, 0)),
    "half tube": (half_tube(), None),
}


@pytest.mark.parametrize("name", SHAPES)
def test_shapes_keep_pieces_loops_and_cavities(name):
    solid, known = SHAPES[name]
    before = topology(solid)
    assert known in (None, before)
    coords = coords_of(solid)
    kept = skeletonize(coords)
    assert topology(solid_of(coords[kept], solid.shape)) == before
    assert kept.sum() < len(coords) / 2


@given(st.integers(0, 10**6), st.floats(0.05, 0.8), st.floats(0.4, 1.6))
def test_random_blobs_keep_pieces_loops_and_cavities(seed, share, blur):
    solid = blob(seed, 14, share, blur)
    coords = coords_of(solid)
    skeleton = solid_of(coords[skeletonize(coords)], solid.shape)
    assert topology(skeleton) == topology(solid)
    pieces = label(solid, connectivity=3)
    assert (np.bincount(pieces[skeleton], minlength=pieces.max() + 1)[1:] > 0).all()


@pytest.mark.parametrize("name", ["tube", "torus", "two tori linked", "trefoil", "box", "rod"])
def test_agrees_with_lee(name):
    solid, _ = SHAPES[name]
    coords = coords_of(solid)
    ours, theirs = coords[skeletonize(coords)], coords_of(lee(solid) > 0)
    assert topology(solid_of(ours, solid.shape)) == topology(solid_of(theirs, solid.shape))
    assert cKDTree(ours).query(theirs)[0].max() <= 3
    assert cKDTree(theirs).query(ours)[0].max() <= 3
    assert len(ours) <= 1.2 * len(theirs) + 2


def slow_table(coords):
    index = {tuple(voxel): i for i, voxel in enumerate(coords.tolist())}
    return np.array([[index.get(tuple(voxel + offset), -1) for offset in OFFSETS] for voxel in coords])


@pytest.mark.parametrize("seed", range(5))
def test_neighbours_against_a_dictionary(seed):
    shape = np.random.default_rng(seed).integers(3, 12, 3)
    solid = np.random.default_rng(seed).random(shape) < 0.3
    coords = coords_of(solid)
    np.testing.assert_array_equal(neighbor_table(coords), slow_table(coords))


@pytest.mark.parametrize("pair", [[[1, 1, 5], [1, 2, 1]], [[1, 5, 5], [2, 1, 1]], [[1, 1, 5], [2, 1, 1]]])
def test_opposite_sides_of_the_box_are_no_neighbours(pair):
    assert (neighbor_table(np.array([*pair, [5, 5, 5]])) == -1).all()


def slow_simple(solid: np.ndarray) -> bool:
    """Lee's rule: without its middle the Euler number is the same, and what surrounds it is in one piece."""
    without = solid.copy()
    without[1, 1, 1] = False
    same = euler_number(np.pad(solid, 1), connectivity=3) == euler_number(np.pad(without, 1), connectivity=3)
    return bool(same and label(without, connectivity=3).max() == 1)


@pytest.mark.parametrize("seed", range(6))
def test_nothing_is_left_that_could_go(seed):
    solid = blob(seed, 14, 0.35)
    coords = coords_of(solid)
    skeleton = np.pad(solid_of(coords[skeletonize(coords)], solid.shape), 1)
    for x, y, z in np.argwhere(skeleton):
        near = skeleton[x - 1 : x + 2, y - 1 : y + 2, z - 1 : z + 2]
        assert near.sum() <= 2 or not slow_simple(near)


def drawn(points):
    """A one voxel wide line through points: one voxel for each step along the longest axis."""
    pairs = zip(np.array(points[:-1]), np.array(points[1:]), strict=True)
    parts = [np.linspace(a, b, np.abs(b - a).max() + 1) for a, b in pairs]
    return np.unique(np.rint(np.concatenate(parts)).astype(np.int64), axis=0)


@pytest.mark.parametrize("points", [[[2, 2, 2], [20, 2, 2]], [[1, 1, 1], [15, 9, 4]], [[3, 3, 3], [10, 20, 3], [24, 24, 18]]])
def test_ends_of_a_line_stay(points):
    coords = drawn(points)
    kept = {tuple(voxel) for voxel in coords[skeletonize(coords)].tolist()}
    assert tuple(points[0]) in kept
    assert tuple(points[-1]) in kept


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("thick", [1, 2, 3])
@pytest.mark.parametrize("width", [1, 2, 3, 4, 5, 6, 8])
def test_a_strip_along_an_axis_keeps_its_length(axis, thick, width):
    """What a straight cable along the image is. Deleting one voxel after the other in order would eat it from its end."""
    for first, second in ((width, thick), (thick, width)):
        edges = [first, second]
        edges.insert(axis, 50)
        coords = coords_of(box(*edges))
        left = coords[skeletonize(coords)]
        assert np.ptp(left[:, axis]) >= 49 - max(width, thick)
        assert len(left) <= 50 + 2 * max(width, thick)


@pytest.mark.parametrize("seed", range(8))
def test_a_strip_in_any_direction_keeps_its_length(seed):
    random = np.random.default_rng(seed)
    axes = np.linalg.qr(random.normal(size=(3, 3)))[0]
    width, thick = random.uniform(1.5, 6), random.uniform(1.8, 3)
    grid = np.stack(np.meshgrid(*[np.arange(60)] * 3, indexing="ij"), axis=-1) - 30.0
    coords = coords_of((np.abs(grid @ axes) <= np.array([25, width / 2, thick / 2])).all(axis=-1))
    assert np.ptp(coords[skeletonize(coords)] @ axes[:, 0]) >= 50 - width - 3


@pytest.mark.parametrize("shift", [(1, 0, 0), (0, 7, 300), (1000, 2000, 3000)])
def test_the_place_in_the_box_does_not_matter(shift):
    coords = np.concatenate([coords_of(blob(seed, 12, 0.3)) + np.array([13 * seed, 0, 0]) for seed in range(3)])
    np.testing.assert_array_equal(skeletonize(coords + np.array(shift)), skeletonize(coords))


def test_a_far_piece_changes_nothing():
    coords = coords_of(SHAPES["tube"][0])
    with_far = np.concatenate((coords, [[10**5, 10**5, 10**5]]))
    np.testing.assert_array_equal(skeletonize(with_far)[:-1], skeletonize(coords))


@pytest.mark.parametrize("coords", [np.zeros((0, 3)), [[1, 1, 1]], [[1, 1, 1], [2, 2, 2]], [[1, 1, 1], [1, 1, 3]]])
def test_few_voxels_stay(coords):
    assert skeletonize(np.array(coords, dtype=np.int64).reshape(-1, 3)).sum() == len(coords)


def test_a_flat_mask_thins_like_a_mask():
    solid = holed_sheet()[:, :, 2:3]
    coords = coords_of(solid)
    assert topology(solid_of(coords[skeletonize(coords)], solid.shape)) == (1, 3, 0)

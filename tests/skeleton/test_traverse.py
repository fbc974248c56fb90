"""The skeleton as a graph: every branch one ordered path."""

from __future__ import annotations

import numpy as np
import pytest
from builders.scenes import empty_scene
from scipy.spatial import cKDTree

from doo3d.config import TraverseConfig
from doo3d.geometry.polyline import densify, steps
from doo3d.kernels import neighbor_table, thin_voxels
from doo3d.skeleton.traverse import traverse
from doo3d.types import Skeleton

SIZE, RADIUS = 0.003, 0.005


def skeletonize(coords):
    """Which of the voxels (M, 3) are the curve skeleton: (M,) bool."""
    return thin_voxels(neighbor_table(coords))


RING = 0.08
SCENE = empty_scene(radius=RADIUS, voxel=SIZE)


def skeleton_of(*curves, dim=3):
    """What thinning leaves of curves (P, 3) m drawn in voxels; flat ones as a mask would give them for D = 2."""
    voxels = np.concatenate([np.rint(densify(np.asarray(curve, dtype=float), SIZE / 20) / SIZE) for curve in curves])
    coords = np.unique(voxels.astype(np.int64), axis=0)
    low = coords.min(axis=0) - 1
    coords = coords[skeletonize(coords - low)]
    if dim == 2:
        assert (coords[:, 2] == coords[0, 2]).all()
        coords, low = coords[:, :2], low[:2]
    return Skeleton(coords - low, coords * SIZE)


def spoke(degrees, length=0.1, dive=0.0):
    """A straight line out from the origin."""
    way = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), dive])
    return np.array([0 * way, length * way])


def ring(x=0.0, radius=RING, tilt=0.0):
    t = np.linspace(0, 2 * np.pi, 400)
    return np.column_stack((x + radius * np.cos(t), radius * np.sin(t) * np.cos(tilt), radius * np.sin(t) * np.sin(tilt)))


def run(*curves, dim=3, **settings):
    return traverse(skeleton_of(*curves, dim=dim), SCENE, TraverseConfig(**settings)).paths


def check_ordered(path, curve, skip=0.0):
    """The path lies on the curve and runs along it without turning back or jumping; the curve but `skip` m of it is covered."""
    curve = densify(curve, SIZE / 20)[:, : path.points.shape[1]]
    away, place = cKDTree(curve).query(path.points)
    assert away.max() < 1.5 * SIZE
    assert steps(path.points, path.closed).max() < 4 * SIZE
    along = place * SIZE / 20
    if path.closed:
        along = np.unwrap(along, period=len(curve) * SIZE / 20)
    assert (np.diff(along) > -0.5 * SIZE).all() or (np.diff(along) < 0.5 * SIZE).all()
    assert np.ptp(along) > len(curve) * SIZE / 20 - skip


both = pytest.mark.parametrize("dim", [2, 3])


@both
@pytest.mark.parametrize("count", [3, 4])
def test_arms_that_meet_are_a_path_each(dim, count):
    """A Y and an X."""
    arms = [spoke(17 + 360 / count * i, dive=(i % 2) * 0.6 * (dim == 3)) for i in range(count)]
    paths = run(*arms, dim=dim)
    assert len(paths) == count
    assert not any(path.closed for path in paths)
    for arm in arms:
        nearest = min(paths, key=lambda path: np.linalg.norm(path.points.mean(axis=0) - arm.mean(axis=0)[:dim]))
        check_ordered(nearest, arm, skip=8 * RADIUS)


def test_paths_stop_where_strands_touch():
    """At a flat X the paths end where the surfaces part, and no two paths come nearer than that."""
    paths = run(spoke(0), spoke(180), spoke(70), spoke(250))
    assert len(paths) == 4
    ends = [end for path in paths for end in path.points[[0, -1]]]
    inner = sorted(ends, key=np.linalg.norm)[:4]
    gaps = [np.linalg.norm(a - b) for i, a in enumerate(inner) for b in inner[:i]]
    assert min(gaps) > 1.8 * RADIUS


@both
def test_a_line(dim):
    (path,) = run(spoke(25, 0.3), dim=dim)
    check_ordered(path, spoke(25, 0.3), skip=4 * RADIUS)
    assert not path.closed


@pytest.mark.parametrize("tilt", [0.0, 0.9])
def test_a_ring_is_closed(tilt):
    (path,) = run(ring(tilt=tilt))
    assert path.closed
    check_ordered(path, ring(tilt=tilt), skip=4 * SIZE)
    assert steps(path.points, closed=True).sum() == pytest.approx(2 * np.pi * RING, rel=0.1)


@both
def test_a_lollipop_is_a_loop_and_a_stick(dim):
    stick = np.array([[RING, 0, 0], [RING + 0.12, 0, 0]])
    paths = sorted(run(ring(), stick, dim=dim), key=lambda path: steps(path.points).sum())
    assert len(paths) == 2
    assert not any(path.closed for path in paths)
    check_ordered(paths[0], stick, skip=8 * RADIUS)
    check_ordered(paths[1], ring(), skip=12 * RADIUS)


@both
@pytest.mark.parametrize("kept", [False, True])
def test_spurs_are_removed_and_branches_stay(dim, kept):
    length = (4.5 if kept else 1.5) * RADIUS
    spur = np.array([[0, 0, 0], [0, length, 0]])
    paths = run(spoke(0, 0.15), spoke(180, 0.15), spur, dim=dim, min_branch=3.0)
    assert len(paths) == (3 if kept else 1)
    if not kept:
        check_ordered(paths[0], np.array([[-0.15, 0, 0], [0.15, 0, 0]]), skip=4 * RADIUS)


@both
def test_a_ring_with_a_spur_is_a_ring(dim):
    spur = np.array([[RING, 0, 0], [RING + 1.5 * RADIUS, 0, 0]])
    (path,) = run(ring(), spur, dim=dim)
    assert path.closed
    check_ordered(path, ring(), skip=4 * SIZE)


@both
def test_a_line_with_many_spurs_is_one_path(dim):
    spurs = [np.array([[x, 0, 0], [x, (-1) ** i * 1.2 * RADIUS, 0]]) for i, x in enumerate(np.arange(-0.1, 0.11, 0.02))]
    (path,) = run(spoke(0, 0.15), spoke(180, 0.15), *spurs, dim=dim)
    check_ordered(path, np.array([[-0.15, 0, 0], [0.15, 0, 0]]), skip=4 * RADIUS)


@both
def test_a_figure_eight_is_two_loops(dim):
    t = np.linspace(-np.pi / 2, np.pi * 3 / 2, 800)
    eight = np.column_stack((0.12 * np.sin(t - np.pi / 2), 0.06 * np.sin(2 * t), 0 * t))
    paths = run(eight, dim=dim)
    assert len(paths) == 2
    for side in (-1, 1):
        nearest = max(paths, key=lambda path: side * path.points[:, 0].mean())
        lobe = eight[side * eight[:, 0] >= 0]
        lobe = np.roll(lobe, -int(np.argmin(np.linalg.norm(lobe, axis=1))), axis=0)
        check_ordered(nearest, lobe, skip=12 * RADIUS)
        assert not nearest.closed


def test_a_small_hole_in_the_surface_is_no_loop():
    hole = ring(radius=1.2 * RADIUS)
    left, right = np.array([[1.2 * RADIUS, 0, 0], [0.15, 0, 0]]), np.array([[-1.2 * RADIUS, 0, 0], [-0.15, 0, 0]])
    paths = run(left, right, hole)
    assert len(paths) == 1
    assert not paths[0].closed
    assert np.ptp(paths[0].points[:, 0]) > 0.3 - 4 * RADIUS


@pytest.mark.parametrize("seed", range(4))
def test_a_winding_curve_in_space_is_one_path(seed):
    random = np.random.default_rng(seed)
    t = np.linspace(0, 1, 500)[:, None]
    curve = np.array([0.4, 0, 0]) * t + sum(random.uniform(-0.05, 0.05, 3) * np.sin(k * np.pi * t) for k in range(1, 4))
    (path,) = run(curve)
    check_ordered(path, curve, skip=4 * RADIUS)


@both
def test_empty_in_empty_out(dim):
    empty = np.zeros((0, dim))
    assert traverse(Skeleton(empty.astype(np.int64), empty), SCENE, TraverseConfig()).paths == []


@both
def test_one_voxel_is_no_path(dim):
    assert traverse(Skeleton(np.ones((1, dim), np.int64), np.ones((1, dim))), SCENE, TraverseConfig()).paths == []


def test_the_record_says_what_is_in_no_path():
    """The lengths of the paths and of what was dropped are those of the curves drawn: a line, a spur, a hole, a small ring."""
    spur = np.array([[0.08, 0, 0], [0.08, 1.5 * RADIUS, 0]])
    hole, dot = ring(x=-0.08, radius=1.2 * RADIUS), ring(x=0, radius=1.5 * RADIUS) + np.array([0, 0.1, 0])
    left, right = np.array([[-0.15, 0, 0], [-0.08 - 1.2 * RADIUS, 0, 0]]), np.array([[-0.08 + 1.2 * RADIUS, 0, 0], [0.15, 0, 0]])
    traversal = traverse(skeleton_of(left, right, spur, hole, dot), SCENE, TraverseConfig())
    assert len(traversal.paths) == 1
    assert traversal.spur_length == pytest.approx(1.5 * RADIUS, abs=1.5 * SIZE)
    half_hole, whole_dot = np.pi * 1.2 * RADIUS, 2 * np.pi * 1.5 * RADIUS
    assert traversal.loop_length == pytest.approx(half_hole + whole_dot, abs=6 * SIZE)
    assert traversal.trimmed_length == pytest.approx(2 * RADIUS)
    crossing = traverse(skeleton_of(spoke(0), spoke(180), spoke(70), spoke(250)), SCENE, TraverseConfig())
    assert crossing.spur_length == crossing.loop_length == 0
    kept = sum(steps(path.points).sum() for path in crossing.paths)
    assert kept + crossing.trimmed_length == pytest.approx(0.4, rel=0.1)

"""Refining: axis instead of surface, radius, equal segments from end to end, occluded flags, direction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders.blue_cable import scene_of
from builders.drawn_masks import CAMERA, axis_error, frame_of, line, ring, runs_along, surface, wave
from builders.scenes import cloud_scene, config_of, image_scene
from scipy.spatial import cKDTree

from doo3d.chains.refine import decide_viewpoint, estimate_centerline, extend_ends, lay_chains
from doo3d.config import Config, RefineConfig, SegmentConfig
from doo3d.geometry.curves import Curves
from doo3d.geometry.noise import SURFACE_SAMPLES
from doo3d.geometry.polyline import arc_length, densify, steps
from doo3d.scene.frame_facts import FrameFacts
from doo3d.skeleton.voxelize import voxelize
from doo3d.types import Path

STEP = 0.01
RING = ring([0.01, 0.0, 0.5], 0.07, 0.5)
WAVE = wave()
STRAIGHT = line([-0.12, 0.0, 0.5], [0.12, 0.0, 0.5])


def refine(paths, scene, config):
    """The chains of paths: the steps of the stage, as the pipeline goes through them."""
    surface, step = voxelize(scene).centroids, scene.config.fit.length
    extended = extend_ends(paths, scene, step)
    scene = decide_viewpoint(extended, scene, step)
    return lay_chains(estimate_centerline(extended, scene, step, config), extended, surface, scene, config)


def cloud_of(frame, mask):
    """What a depth camera's cloud holds of the object."""
    v, u = np.nonzero(mask & (frame.depth > 0))
    return frame.camera.unproject(np.column_stack((u, v)), frame.depth[v, u])


def seen(axis, radius, view):
    """A cable seen as an image, as the cloud of it with or without the viewpoint, or from all sides."""
    if view == "whole":
        return cloud_scene(surface(axis, radius))
    frame, mask = frame_of(axis, radius=radius)
    if view == "image":
        return scene_of(frame, SegmentConfig(), mask)
    return cloud_scene(cloud_of(frame, mask), np.zeros(3) if view == "seen" else None)


def rough(axis, radius, scene, jitter=0.25):
    """What the stages before leave: the axis moved to the surface towards the camera, and shaken."""
    dense = densify(axis[:-1] if np.allclose(axis[0], axis[-1]) else axis, 0.003)
    towards = 0 if scene.viewpoint is None else 0.8 * radius
    moved = dense - towards * dense / np.linalg.norm(dense, axis=1, keepdims=True)
    return moved + jitter * radius * np.random.default_rng(0).uniform(-1, 1, moved.shape)


def run(axis, radius, view, closed=False, filled=None, config=None, step=STEP, scene=None):
    scene = (scene or seen(axis, radius, view)).with_settings(config_of(radius=radius, segment_length=step))
    return refine([Path(rough(axis, radius, scene), closed, filled)], scene, config or RefineConfig())


def inner(chain, count=3):
    """The chain's joints away from its ends."""
    return chain.joints[count:-count]


views = pytest.mark.parametrize("view", ["image", "seen", "unknown", "whole"])


@views
@pytest.mark.parametrize("radius", [0.002, 0.004, 0.006])
@pytest.mark.parametrize("axis", [WAVE, line([-0.15, 0.02, 0.5], [0.14, -0.03, 0.55])], ids=["wave", "line"])
def test_axis_and_radius(axis, radius, view):
    (chain,) = run(axis, radius, view)
    assert chain.radius == pytest.approx(radius, rel=0.05)
    np.testing.assert_allclose(chain.radii, radius, rtol=0.15)
    distance = cKDTree(densify(axis, 1e-4)).query(inner(chain))[0]
    assert np.sqrt(np.mean(distance**2)) < 0.0003
    assert distance.max() < 0.0006
    error = axis_error(chain, axis)
    assert error.largest < 0.5 * radius
    assert runs_along(chain, axis)


@pytest.mark.parametrize("viewpoint", [np.zeros(3), None])
def test_a_half_shell_that_was_sampled_evenly(viewpoint):
    """As a voxel filter leaves it: as many points on the steep sides as in the middle."""
    (chain,) = run(WAVE, 0.004, "seen", scene=cloud_scene(surface(WAVE, 0.004, np.zeros(3)), viewpoint))
    assert chain.radius == pytest.approx(0.004, rel=0.05)
    assert axis_error(chain, WAVE).rms < 0.0005


@views
@pytest.mark.parametrize("radius", [0.002, 0.006])
def test_from_end_to_end(view, radius):
    """Within a radius of the true ends, and what is over of a whole number of segments shared by both."""
    axis = line([-0.1234, 0.02, 0.5], [0.1, -0.03, 0.53])
    (chain,) = run(axis, radius, view)
    total = arc_length(axis)[-1] + (2 * radius if view != "whole" else 0)
    assert abs(chain.length - total) < STEP / 2 + 2 * radius
    way = (axis[-1] - axis[0]) / np.linalg.norm(axis[-1] - axis[0])
    first, last = (chain.joints[0] - axis[0]) @ way, (chain.joints[-1] - axis[-1]) @ way
    over = STEP / 4
    assert -radius - over < first < over + radius
    assert -over - radius < last < radius + over
    assert first + last == pytest.approx(0, abs=radius)


@pytest.mark.parametrize("step", [0.003, 0.01, 0.025])
@views
def test_segments_are_equal(view, step):
    (chain,) = run(WAVE, 0.004, view, step=step)
    np.testing.assert_allclose(steps(chain.joints), step, rtol=1e-9)
    assert chain.segment_length == step
    assert not chain.closed


@views
def test_a_ring_closes(view):
    (chain,) = run(RING, 0.004, view, closed=True)
    assert chain.closed
    np.testing.assert_array_equal(chain.joints[-1], chain.joints[0])
    np.testing.assert_allclose(steps(chain.joints), STEP, rtol=1e-6)
    assert chain.length == pytest.approx(2 * np.pi * 0.07, abs=STEP)
    assert chain.radius == pytest.approx(0.004, rel=0.05)
    assert axis_error(chain, RING).largest < 0.001


def flags(occluded, view="image", known=True):
    """A straight cable whose middle third has not been seen, as merging would hand it on, or with an unfilled gap."""
    scene = seen(STRAIGHT, 0.004, view)
    kept = np.abs(scene.points[:, 0]) > 0.04
    changes = {"points": scene.points[kept], "filtered": scene.points[kept]}
    if view == "image":
        mask = scene.mask.copy()
        mask[:, int(320 - 0.04 * 1800) : int(320 + 0.04 * 1800)] = False
        changes |= {"pixels": scene.pixels[kept], "facts": FrameFacts(mask, scene.depth)}
    scene = replace(scene, **changes)
    path = rough(STRAIGHT, 0.004, scene, 0.0)
    middle = (path[1:, 0] + path[:-1, 0]) / 2
    filled = np.abs(middle) < 0.04 if known else np.zeros(len(middle), bool)
    config = RefineConfig(occluded=occluded)
    (chain,) = run(STRAIGHT, 0.004, view, filled=filled, config=config, scene=scene)
    middle = np.abs((chain.joints[1:, 0] + chain.joints[:-1, 0]) / 2)
    return chain.occluded, middle


@pytest.mark.parametrize("view", ["image", "seen", "whole"])
@pytest.mark.parametrize("occluded", ["from_gaps", "from_depth", "both"])
def test_the_gap_is_occluded(view, occluded):
    found, middle = flags(occluded, view)
    assert found[middle < 0.033].all()
    assert not found[middle > 0.047].any()


@pytest.mark.parametrize(("occluded", "some"), [("from_gaps", False), ("from_depth", True), ("both", False)])
def test_a_gap_that_merging_did_not_fill(occluded, some):
    found, middle = flags(occluded, known=False)
    assert found[middle < 0.033].all() == some
    assert found.any() == some


@pytest.mark.parametrize(("occluded", "some"), [("from_gaps", True), ("from_depth", False), ("both", False)])
def test_a_filled_gap_where_there_are_points(occluded, some):
    scene = seen(STRAIGHT, 0.004, "image")
    filled = np.abs(rough(STRAIGHT, 0.004, scene)[1:, 0]) < 0.04
    (chain,) = run(STRAIGHT, 0.004, "image", filled=filled, config=RefineConfig(occluded=occluded), scene=scene)
    assert chain.occluded.any() == some


def test_what_only_color_saw_is_not_occluded():
    """The mask goes on where depth stops: seen, though there are no points."""
    frame, mask = frame_of(STRAIGHT, radius=0.004)
    depth = frame.depth.copy()
    depth[:, 280:360] = 0
    scene = scene_of(replace(frame, depth=depth), SegmentConfig(), mask)
    filled = np.abs(rough(STRAIGHT, 0.004, scene)[1:, 0]) < 0.02
    for occluded in ("both", "from_depth"):
        config = RefineConfig(occluded=occluded)
        (chain,) = run(STRAIGHT, 0.004, "image", filled=filled, config=config, scene=scene)
        assert not chain.occluded.any()
        middle = (chain.joints[1:, 0] + chain.joints[:-1, 0]) / 2
        missing = np.abs(CAMERA.project(chain.joints[1:] * 0.5 + chain.joints[:-1] * 0.5)[:, 0] - 319.5) < 40
        inner = np.abs(np.abs(middle) - 0.033) > 0.012
        assert chain.depth_filled[missing & inner].all()
        assert not chain.depth_filled[~missing & inner].any()


def filled_depth(depth_of):
    """Return which segments of a straight cable have filled depth, and their middles along x, m; depth_of changes the depth."""
    frame, mask = frame_of(STRAIGHT, radius=0.004)
    scene = scene_of(frame, SegmentConfig(), mask)
    joints = np.column_stack((np.arange(-0.1, 0.101, STEP), np.zeros(21), np.full(21, 0.5)))
    scene = replace(scene, facts=FrameFacts(scene.mask, depth_of(frame.depth.copy())))
    support = scene.depth_support(Curves.of([joints]), [0.004])
    return support.is_filled, (joints[1:, 0] + joints[:-1, 0]) / 2


def test_depth_is_seen_where_readings_agree():
    noise = np.random.default_rng(0).normal(0, 0.004, (480, 640)).astype(np.float32)
    for change in (lambda depth: depth, lambda depth: np.where(depth > 0, depth + noise, 0)):
        assert not filled_depth(change)[0].any()


@pytest.mark.parametrize("offset", [0.03, -0.02])
def test_depth_is_filled_where_readings_are_of_something_else(offset):
    """Torn to what lies behind, or hidden by something that the mask holds too."""

    def torn(depth):
        depth[:, 280:360] += offset
        return depth

    filled, x = filled_depth(torn)
    at = np.abs(CAMERA.project(np.column_stack((x, x * 0, x * 0 + 0.5)))[:, 0] - 319.5)
    assert filled[at < 32].all()
    assert not filled[at > 48].any()
    assert 3 < filled.sum() < 10


def seen_low(height, table_until=1.0):
    """Return the chain of a cable of 6 mm radius on a table, seen at a share of its height over it; the table ends at some x."""
    axis, radius = line([-0.12, 0.0, 0.494], [0.12, 0.0, 0.494]), 0.006
    frame, mask = frame_of(axis, radius=radius, table=0.5)
    depth = np.where(mask, 0.5 - height * (0.5 - frame.depth), frame.depth)
    x = (np.arange(depth.shape[1]) - frame.camera.cx) / frame.camera.fx * 0.5
    depth[:, x > table_until] += np.where(mask[:, x > table_until], 0.0, 0.4)
    frame = replace(frame, depth=depth.astype(np.float32))
    return run(axis, radius, "image", scene=scene_of(frame, SegmentConfig(), mask))[0]


@pytest.mark.parametrize("height", [1.0, 0.7, 0.3])
def test_a_cable_on_a_table_lies_on_it_however_low_its_depth(height):
    chain = seen_low(height)
    np.testing.assert_allclose(chain.joints[:, 2], 0.494, atol=0.001)
    assert not chain.depth_filled.any()


def test_a_cable_is_not_raised_beyond_the_edge_of_the_table():
    chain = seen_low(0.3, table_until=0.02)
    assert np.abs(chain.joints[chain.joints[:, 0] < -0.01, 2] - 0.494).max() < 0.001
    assert chain.joints[chain.joints[:, 0] > 0.05, 2].min() > 0.4965


def test_points_of_a_cloud_have_no_depth_readings():
    joints = np.column_stack((np.arange(5) * STEP, np.zeros(5), np.ones(5)))
    for scene in (cloud_scene(joints), image_scene(np.ones((4, 4), bool))):
        assert not len(scene.depth_support(Curves.of([joints[:, : scene.dim]]), [0.004]).share)


@views
@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize(("a", "b"), [([-0.1, 0.05, 0.5], [0.1, -0.05, 0.55]), ([-0.04, 0.08, 0.6], [-0.02, -0.08, 0.45])])
def test_a_chain_starts_at_the_left(view, flip, a, b):
    axis = line(b, a) if flip else line(a, b)
    (chain,) = run(axis, 0.004, view)
    assert np.linalg.norm(chain.joints[0] - a) < 0.02
    assert np.linalg.norm(chain.joints[-1] - b) < 0.02


def test_left_is_left_in_the_view_and_not_in_space():
    """An end with the larger x but farther away is the left one in the image."""
    near, far = [-0.06, 0.0, 0.4], [-0.065, 0.02, 0.6]
    (chain,) = run(line(near, far), 0.004, "image")
    assert np.linalg.norm(chain.joints[0] - near) < 0.02


@pytest.mark.parametrize("view", ["image", "seen", "whole"])
def test_the_order_of_points_does_not_matter(view):
    scene = seen(WAVE, 0.004, view)
    if view != "image":  # as many points as the axis is measured on
        points = np.ascontiguousarray(scene.points[:: -(-len(scene.points) // SURFACE_SAMPLES)])
        scene = replace(scene, points=points, filtered=points)
    order = np.random.default_rng(0).permutation(len(scene.points))
    pixels = {"pixels": scene.pixels[order]} if view == "image" else {}
    shuffled = replace(scene, points=scene.points[order], filtered=scene.filtered[order], **pixels)
    (one,), (other,) = (run(WAVE, 0.004, view, scene=each) for each in (scene, shuffled))
    np.testing.assert_allclose(other.joints, one.joints, atol=1e-4)
    assert other.radius == pytest.approx(one.radius, rel=1e-3)


@pytest.mark.parametrize("seed", range(3))
def test_turning_space_turns_the_chain(seed):
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn = turn * np.sign(np.linalg.det(turn))
    (one,) = run(WAVE, 0.004, "whole")
    (other,) = run(WAVE @ turn.T, 0.004, "whole")
    back = other.joints @ turn
    back = back if np.linalg.norm(back[0] - one.joints[0]) < np.linalg.norm(back[-1] - one.joints[0]) else back[::-1]
    assert len(back) == len(one.joints)
    np.testing.assert_allclose(back, one.joints, atol=0.001)
    assert other.radius == pytest.approx(one.radius, rel=0.01)


def test_no_rounds_stay_on_the_surface():
    (chain,) = run(line([-0.1, 0, 0.5], [0.1, 0, 0.5]), 0.006, "image", config=RefineConfig(iterations=0))
    assert np.median(chain.joints[:, 2]) == pytest.approx(0.5 - 0.8 * 0.006, abs=0.001)


def test_longest_first():
    axes = [line([-0.1, y, 0.5], [-0.1 + length, y, 0.5]) for y, length in ((-0.05, 0.08), (0.0, 0.2), (0.05, 0.12))]
    frame, mask = frame_of(*axes, radius=0.004)
    scene = scene_of(frame, SegmentConfig(), mask).with_settings(config_of(radius=0.004, segment_length=STEP))
    chains = refine([Path(rough(axis, 0.004, scene)) for axis in axes], scene, RefineConfig())
    assert [round(chain.length, 2) for chain in chains] == pytest.approx([0.2, 0.12, 0.08], abs=0.0101)


def test_what_is_shorter_than_half_a_segment_gives_nothing():
    axis = line([0, 0, 0.5], [0.02, 0, 0.5])
    assert run(axis, 0.004, "image", step=0.1) == []


def test_empty_in_empty_out():
    assert refine([], cloud_scene(np.zeros((0, 3))), Config().refine) == []

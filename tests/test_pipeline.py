"""One frame through all stages: what comes out, the same every time, and what is said when nothing does."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from builders.drawn_masks import CAMERA, axis_error, frame_of, helix, line, ring, runs_along, surface, wave
from builders.errors import refuses
from builders.scenes import cloud_scene

import doo3d
from doo3d.chains.fill import fill
from doo3d.chains.fit import fit
from doo3d.chains.prune import prune
from doo3d.chains.refine import estimate_centerline, extend_ends, lay_chains
from doo3d.config import Config
from doo3d.geometry.polyline import arc_length, steps
from doo3d.links import merge
from doo3d.pipeline import run_stages
from doo3d.skeleton.thin import thin
from doo3d.skeleton.traverse import traverse
from doo3d.skeleton.voxelize import voxelize
from doo3d.types import Frame

RADIUS = 0.005
STAGES = ["segment", "voxelize", "thin", "traverse", "fit", "prune", "merge", "fill"]
STAGES += ["extend_ends", "estimate_centerline", "lay_chains", "crossings", "extend_mask"]


def config(**settings):
    return doo3d.load_config("default", {key.replace("__", "."): value for key, value in settings.items()})


def bytes_of(detection):
    document = detection.to_dict()
    del document["seconds"]
    return json.dumps(document)


def cloud_of(frame, mask):
    v, u = np.nonzero(mask)
    return frame.camera.unproject(np.column_stack((u, v)), frame.depth[v, u])


def check(chain, axis, tolerance=0.001):
    error = axis_error(chain, axis)
    assert error.rms < tolerance
    assert error.largest < RADIUS
    assert error.uncovered < 2 * RADIUS
    assert abs(chain.length - arc_length(axis)[-1]) < 0.006 + 2 * RADIUS
    assert chain.radius == pytest.approx(RADIUS, rel=0.06)
    np.testing.assert_allclose(steps(chain.joints), chain.segment_length, rtol=1e-9)


@pytest.mark.parametrize("table", [0.0, 0.53])
@pytest.mark.parametrize("given", [True, False])
def test_a_frame(table, given):
    frame, mask = frame_of(wave(), radius=RADIUS, table=table)
    detection = doo3d.detect(frame, mask=mask if given else None)
    (chain,) = detection.chains
    check(chain, wave())
    assert runs_along(chain, wave())
    assert not chain.occluded.any()
    assert detection.notes == (), "a good frame needs no advice"
    assert detection.mode == "3d"
    assert detection.coordinates == "camera"
    assert list(detection.seconds) == STAGES


def test_advice_where_nothing_is_found():
    """It names the method that was chosen; of a cloud, for which there are no colors to propose, never doo3d tune."""
    frame, _ = frame_of(wave(), radius=RADIUS)
    colored = Frame(np.full((*frame.depth.shape, 3), 120, np.uint8), frame.depth, frame.camera)
    for settings in ({"merge.min_length": 10000.0}, {"fit.segment_length": 9.0}):
        for data, tune in ((colored, True), (doo3d.Cloud(surface(wave(), RADIUS)), False)):
            notes = doo3d.detect(data, settings).notes
            assert notes[0].startswith("segment: method ")
            assert any("doo3d tune" in note for note in notes) == tune


@pytest.mark.parametrize("stands", [0.0, 0.03])
def test_chains_that_meet_like_branches_name_the_preset_for_them(stands):
    """A branch from the side of a cable; the same cable beside it that ends some cm away is an object of its own."""
    trunk, branch = line([-0.15, 0, 0.6], [0.15, 0, 0.6]), line([0.0, 0.004 + stands, 0.6], [0.05, 0.13, 0.6])
    frame, mask = frame_of(trunk, branch, radius=RADIUS)
    found = doo3d.detect(frame, mask=mask)
    assert len(found.chains) == 2
    assert [("-c harness" in note) for note in found.notes] == [True] * (not stands)
    assert not any("-c harness" in note for note in doo3d.detect(frame, "harness", mask=mask).notes)


@pytest.mark.parametrize("view", ["seen", "unknown", "whole"])
def test_a_cloud(view):
    frame, mask = frame_of(wave(), radius=RADIUS)
    points = surface(wave(), RADIUS) if view == "whole" else cloud_of(frame, mask)
    detection = doo3d.detect(doo3d.Cloud(points, viewpoint=np.zeros(3) if view == "seen" else None))
    (chain,) = detection.chains
    check(chain, wave())
    assert detection.coordinates == "cloud"


def test_a_cloud_with_rows_that_are_none_and_a_mask():
    points = surface(wave(), RADIUS)
    points = np.insert(points, [5, 500, 500, 2000], np.nan, axis=0)
    mask = ~(points[:, 0] > 0.05)
    (chain,) = doo3d.detect(doo3d.Cloud(points), mask=mask).chains
    assert chain.joints[:, 0].max() == pytest.approx(0.05, abs=0.01)
    with refuses("mask-shape"):
        doo3d.detect(doo3d.Cloud(points), mask=mask[:-1])


def test_a_helix_turns_on():
    """It hides parts of itself behind others at no place: pitch and radius are wide."""
    axis = helix(turns=1.25, radius=0.04, pitch=0.09)
    (chain,) = doo3d.detect(doo3d.Cloud(surface(axis, RADIUS))).chains
    check(chain, axis)
    assert runs_along(chain, axis)


@pytest.mark.parametrize("tilt", [0.0, 0.7])
def test_a_ring(tilt):
    axis = ring([0, 0, 0.5], 0.08, tilt)
    frame, mask = frame_of(axis, radius=RADIUS)
    (chain,) = doo3d.detect(frame, mask=mask).chains
    assert chain.closed
    check(chain, axis)
    np.testing.assert_allclose(chain.joints[0], chain.joints[-1], atol=1e-12)


@pytest.mark.parametrize("radius", [0.0015, 0.003, 0.004, 0.006])
@pytest.mark.parametrize("along", [0, 1])
def test_straight_along_the_image(radius, along):
    """Strips of voxels of any width, along the axes of the image and of the grid."""
    axis = line([-0.12, 0, 0.5], [0.12, 0, 0.5])
    axis = axis[:, [1, 0, 2]] if along else axis
    frame, mask = frame_of(axis, radius=radius)
    (chain,) = doo3d.detect(frame, mask=mask).chains
    assert abs(chain.length - 0.24 - radius) < 0.005 + radius
    assert axis_error(chain, axis).largest < 0.0005


def test_several_cables():
    axes = [line([-0.12, y, 0.5], [0.12, y + 0.01, 0.53]) for y in (-0.06, 0.0, 0.05)]
    frame, mask = frame_of(*axes, radius=RADIUS)
    detection = doo3d.detect(frame, config(merge__chains=3), mask=mask)
    assert len(detection.chains) == 3
    for axis in axes:
        check(min(detection.chains, key=lambda chain: axis_error(chain, axis).rms), axis)


def test_cables_whose_ends_lie_side_by_side_are_not_one():
    axes = [line([-0.12, y, 0.5], [0.12, y + 0.01, 0.53]) for y in (-0.07, 0.0, 0.08)]
    frame, mask = frame_of(*axes, radius=RADIUS)
    assert len(doo3d.detect(frame, config(merge__chains=None), mask=mask).chains) == 3


@pytest.mark.parametrize("wanted", [2, None])
@pytest.mark.parametrize("distance", [4, 3])
def test_cables_side_by_side_in_a_cloud(distance, wanted):
    """With two radii of air between them, and with one: less than closing of voxels would join."""
    axes = [line([-0.12, y, 0.5], [0.12, y, 0.5]) for y in (0.0, distance * RADIUS)]
    cloud = doo3d.Cloud(np.concatenate([surface(axis, RADIUS) for axis in axes]))
    chains = doo3d.detect(cloud, config(merge__chains=wanted)).chains
    assert len(chains) == 2
    assert all(chain.radius == pytest.approx(RADIUS, rel=0.1) for chain in chains)


def crossing():
    """A loop that crosses itself, the later strand 20 mm above the earlier."""
    t = np.linspace(-0.5, 1.5, 900) * np.pi
    return np.column_stack((0.08 * np.sin(2 * t) + 0.02 * t, -0.09 * np.cos(t), 0.52 - 0.02 * t / np.pi))


def test_a_loop_goes_on_through_its_crossing():
    frame, mask = frame_of(crossing(), radius=RADIUS)
    (chain,) = doo3d.detect(frame, mask=mask).chains
    assert runs_along(chain, crossing())
    assert axis_error(chain, crossing()).rms < 0.0015


def test_hidden_behind_a_bar():
    """60 mm of a cable behind something nearer: one chain, and that part occluded."""
    axis = line([-0.15, 0.01, 0.5], [0.15, -0.01, 0.5])
    frame, mask = frame_of(axis, radius=RADIUS)
    bar = np.abs(np.arange(640) - 320) < 54
    depth = np.where(bar[None], 0.4, frame.depth).astype(np.float32)
    (chain,) = doo3d.detect(doo3d.Frame(None, depth, CAMERA), mask=mask & ~bar).chains
    check(chain, axis)
    middle = (chain.joints[1:, 0] + chain.joints[:-1, 0]) / 2
    assert chain.occluded[np.abs(middle) < 0.024].all()
    assert not chain.occluded[np.abs(middle) > 0.036].any()


def test_seen_through_is_not_hidden():
    """The same gap with nothing in front of it and a wall behind: two cables."""
    axis = line([-0.15, 0.01, 0.5], [0.15, -0.01, 0.5])
    frame, mask = frame_of(axis, radius=RADIUS)
    gap = np.abs(np.arange(640) - 320) < 54
    depth = np.where(gap[None] | (frame.depth == 0), 0.9, frame.depth).astype(np.float32)
    detection = doo3d.detect(doo3d.Frame(None, depth, CAMERA), mask=mask & ~gap)
    assert len(detection.chains) == 2
    assert not any(chain.occluded.any() for chain in detection.chains)


def test_the_same_bytes_every_time():
    noise = 0.0007 * np.random.default_rng(0).normal(size=(480, 640))
    frame, mask = frame_of(crossing(), line([-0.1, 0.09, 0.5], [0.1, 0.12, 0.52]), radius=RADIUS, table=0.55)
    frame = doo3d.Frame(None, frame.depth + noise.astype(np.float32), CAMERA)
    settings = doo3d.load_config("paper_3d")
    assert bytes_of(doo3d.detect(frame, settings)) == bytes_of(doo3d.detect(frame, settings))
    assert bytes_of(doo3d.detect(frame, settings, mask)) == bytes_of(doo3d.detect(frame, settings, mask))
    cloud = doo3d.Cloud(cloud_of(frame, frame.depth > 0))
    first = bytes_of(doo3d.detect(cloud, settings))
    assert first == bytes_of(doo3d.detect(doo3d.Cloud(cloud.points.copy()), settings))
    assert json.loads(first)["chains"]


def test_the_input_stays():
    frame, mask = frame_of(wave(), radius=RADIUS, table=0.53)
    depth, before = frame.depth.copy(), mask.copy()
    points = surface(wave(), RADIUS)
    copy = points.copy()
    doo3d.detect(doo3d.Frame(None, depth, CAMERA), mask=mask)
    doo3d.detect(doo3d.Cloud(points))
    np.testing.assert_array_equal(depth, frame.depth)
    np.testing.assert_array_equal(mask, before)
    np.testing.assert_array_equal(points, copy)


@pytest.mark.parametrize("length", [0.001, 0.003, 0.02, 0.05])
def test_any_segment_length(length):
    frame, mask = frame_of(wave(), radius=RADIUS)
    (chain,) = doo3d.detect(frame, config(fit__segment_length=length), mask=mask).chains
    assert chain.segment_length == length
    assert chain.length == pytest.approx(arc_length(wave())[-1], abs=length / 2 + 0.012)
    assert axis_error(chain, wave()).largest < RADIUS


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"fit__segment_length": 2.0}, "fit: .*segment_length"),
        ({"merge__min_length": 1000, "merge__chains": None}, "merge: .*min_length"),
    ],
)
def test_where_everything_was_lost(settings, words):
    frame, mask = frame_of(wave(), radius=RADIUS)
    detection = doo3d.detect(frame, config(**settings), mask=mask)
    assert detection.chains == ()
    (note,) = detection.notes
    assert re.match(words, note)


def test_only_a_table():
    """Nothing stands off it: no chains, a note, no error."""
    frame = doo3d.Frame(None, np.full((480, 640), 0.6, np.float32), CAMERA)
    detection = doo3d.detect(frame)
    assert detection.chains == ()
    assert len(detection.notes) == 2  # the method, and that there is nothing


def test_every_stage_kept():
    frame, mask = frame_of(wave(), radius=RADIUS)
    stages = run_stages(frame, Config(), mask)
    assert (
        len(stages.scene.points) > len(stages.graph.grid.coords) > len(stages.graph.skeleton.coords) > len(stages.graph.paths) > 0
    )
    assert len(stages.fitted) >= len(stages.merged.assemblies) == len(stages.filled) == len(stages.chains) == 1
    assert list(stages.seconds) == STAGES
    assert all(seconds >= 0 for seconds in stages.seconds.values())


def test_empty_in_empty_out():
    settings = Config()
    scene = cloud_scene(np.zeros((0, 3)))
    grid = voxelize(scene)
    paths = traverse(thin(grid), scene, settings.traverse).paths
    chains = prune(fit(paths, 0.01, settings.fit), 0.001, settings.prune).chains
    filled = fill(merge(chains, scene, 0.01, settings.merge).assemblies, 0.01)
    assert paths == list(chains) == filled == extend_ends(filled, scene, 0.01) == []
    samples = estimate_centerline([], scene, 0.01, settings.refine)
    assert lay_chains(samples, [], grid.centroids, scene, settings.refine) == []

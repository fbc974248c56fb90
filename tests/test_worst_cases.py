"""Masks of noise, nets and folded strands: an answer or a sentence, with a bound on the work."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest
from builders.scenes import cloud_scene
from builders.worst_cases import MASKS, cloud_of, frame_of_mask, image_of, lines, noise_image, salt_and_pepper, sticks
from builders.worst_clouds import CLOUDS, collinear, lattice, ropes

import doo3d
from doo3d.links import TOO_MANY
from doo3d.links.terms.gap_path import GapPaths
from doo3d.pipeline import run_stages
from doo3d.segment.observe import MAX_EXTENDED_CHAINS
from doo3d.skeleton.voxelize import voxelize

UNEXTENDED = {"extend_mask.max_length": 0}
SMALL = (240, 135)
FULL = (1280, 720)
PRESETS = ("image", "paper_2d", "harness")


def detect(mask, preset):
    config = doo3d.load_config(preset)
    data = image_of(mask) if config.mode == "2d" else frame_of_mask(mask, random_depth=False)
    return doo3d.detect(data, config, mask=mask)


def answer(mask, preset):
    """The detection, or the sentence with which the frame is refused."""
    try:
        return detect(mask, preset)
    except doo3d.InputError as error:
        return str(error)


def check(result):
    if isinstance(result, str):
        assert result
        return
    assert result.chains or result.notes
    for chain in result.chains:
        assert np.isfinite(chain.joints).all()
        np.testing.assert_allclose(np.linalg.norm(np.diff(chain.joints, axis=0), axis=1), chain.segment_length, rtol=1e-6)


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("kind", MASKS)
def test_every_kind_gives_an_answer_or_a_sentence(kind, preset):
    check(answer(MASKS[kind](SMALL), preset))


@pytest.mark.parametrize("random_depth", [False, True])
def test_a_cloud_of_noise_gives_an_answer_or_a_sentence(random_depth):
    mask = salt_and_pepper(SMALL, 0.2)
    check(doo3d.detect(cloud_of(frame_of_mask(mask, random_depth), mask)))


def test_a_photograph_of_noise_gives_an_answer_or_a_sentence():
    check(doo3d.detect(noise_image((320, 180)), doo3d.load_config("image")))


def stages_of(mask, **overrides):
    return run_stages(image_of(mask), doo3d.load_config("image", overrides), mask)


def test_of_too_many_chains_the_longest_are_merged(monkeypatch):
    mask = sticks((480, 270), 60, 3)
    everything = stages_of(mask, **UNEXTENDED).pruned.chains
    limit = len(everything) // 2
    monkeypatch.setattr(import_module("doo3d.links.links"), "MAX_CHAINS", limit)
    stages = stages_of(mask, **UNEXTENDED)
    left_out = [dropped.joints for dropped in stages.merged.dropped if dropped.setting == TOO_MANY]
    assert len(left_out) == len(everything) - limit
    used = sorted(len(chain) for chain in everything)[-limit:]
    assert max(len(chain) for chain in left_out) <= used[0]
    (note,) = stages.merged.notes
    assert f"{limit} longest" in note
    assert f"{len(left_out)} pieces" in note
    assert any(each.startswith("merge: ") for each in detect(mask, "image").notes)


def test_of_too_many_branches_the_longest_become_paths(monkeypatch):
    mask = sticks((480, 270), 60, 3)
    everything = stages_of(mask, **UNEXTENDED).graph.paths
    limit = len(everything) // 4
    monkeypatch.setattr(import_module("doo3d.skeleton.traverse"), "MAX_BRANCHES", limit)
    traversal = stages_of(mask, **UNEXTENDED).graph.traversal
    assert len(traversal.paths) <= limit
    (note,) = traversal.notes
    assert f"the {limit} longest are used" in note


def test_with_many_chains_the_mask_is_not_extended(monkeypatch):
    mask = sticks((480, 270), 60, 3)
    assert not stages_of(mask).limit_notes
    monkeypatch.setattr(import_module("doo3d.segment.observe"), "MAX_EXTENDED_CHAINS", 2)
    stages = stages_of(mask)
    assert stages.observed.segmentation.base is None
    assert "2" in stages.limit_notes[0]
    assert not stages_of(mask, **UNEXTENDED).limit_notes


def test_an_ordinary_frame_is_far_from_the_limits():
    stages = stages_of(sticks(FULL, 8, 7))
    assert len(stages.pruned.chains) < 100
    assert len(stages.chains) <= MAX_EXTENDED_CHAINS
    assert stages.merged.notes == stages.graph.traversal.notes == stages.limit_notes == ()


@pytest.mark.parametrize("wanted", [10.0, 2.0])
def test_short_segments_that_the_program_chose_are_longer_where_they_were_too_many(monkeypatch, wanted):
    """Thin strands get short segments while junctions are looked for. Segments that the user wants too short are refused."""
    mask, settings = sticks((480, 270), 60, 3), {"merge.branches": True, "fit.segment_length": wanted}
    usual = stages_of(mask, **settings, **UNEXTENDED)
    total = usual.fitted.lengths.sum()
    for module in ("skeleton.graph", "chains.fit"):
        monkeypatch.setattr(import_module(f"doo3d.{module}"), "MAX_SAMPLES", int(total / 5))
    if wanted < 5:
        with pytest.raises(doo3d.ConfigError, match=r"fit\.segment_length: 2 would make"):
            stages_of(mask, **settings, **UNEXTENDED)
        return
    stages = stages_of(mask, **settings, **UNEXTENDED)
    assert total / 10 < stages.fitted.counts.sum() < total / 4
    assert {chain.segment_length for chain in stages.chains} == {wanted}


def test_gap_paths_are_limited(monkeypatch):
    """With straight gaps for all pairs from the start no gap path is made for the matching, and the ends are still joined."""
    made = []
    original = GapPaths.costs

    def counted(self, pairs):
        made.extend(pairs)
        return original(self, pairs)

    monkeypatch.setattr(GapPaths, "costs", counted)
    mask = sticks((480, 270), 60, 3)
    exact = stages_of(mask, **UNEXTENDED)
    exact_made = len(set(made))
    made.clear()
    monkeypatch.setattr(import_module("doo3d.links.solve"), "MAX_GAP_PATHS", 10)
    limited = stages_of(mask, **UNEXTENDED)
    assert len(set(made)) < exact_made
    assert limited.merged.decisions
    assert len(limited.merged.assemblies) <= 2 * len(exact.merged.assemblies)


@pytest.mark.slow
@pytest.mark.parametrize("preset", [*PRESETS, "default"])
@pytest.mark.parametrize(
    "kind",
    ["salt and pepper, 35 %", "Hilbert curve, 1,024 places", "net of diagonals, 40 px", "300 sticks", "30 nested rectangles"],
)
def test_at_full_size(kind, preset):
    check(answer(MASKS[kind](FULL), preset))


@pytest.mark.slow
def test_a_photograph_of_noise_at_full_size():
    check(doo3d.detect(noise_image(FULL), doo3d.load_config("image")))


CLOUDS_IN_TIME = (
    "2 points",
    "100 points on a line",
    "300 points at random on a line",
    "200 points at random",
    "3,000 points at random over 20 m",
    "2,000 points at random in a plane",
    "lattice of 20 x 20 x 20",
)


@pytest.mark.parametrize("branches", [False, True])
@pytest.mark.parametrize("kind", CLOUDS_IN_TIME)
def test_every_kind_of_cloud_gives_an_answer(kind, branches):
    overrides = {"segment.method": "everything", "merge.branches": branches}
    check(doo3d.detect(doo3d.Cloud(CLOUDS[kind]()), doo3d.load_config("default", overrides)))


def test_points_exactly_on_a_line_have_a_radius_that_bounds_the_samples(monkeypatch):
    """Their scatter is rounding alone: 1e-17 m, of which a chain of 1 m would hold as many samples."""
    (chain,) = doo3d.detect(doo3d.Cloud(collinear(100)), doo3d.load_config("default", {"segment.method": "everything"})).chains
    assert chain.radius >= 1e-3 / 99 * 0.99
    assert chain.length == pytest.approx(1.0, abs=0.02)


def test_of_too_many_points_some_are_drawn_and_a_note_says_so(monkeypatch):
    points, config = ropes(30_000, 1, 0.01), doo3d.load_config("default", {"segment.method": "everything"})
    (whole,) = doo3d.detect(doo3d.Cloud(points), config).chains
    monkeypatch.setattr(import_module("doo3d.segment.point_filter"), "MAX_POINTS", 15_000)
    drawn = doo3d.detect(doo3d.Cloud(points), config)
    (note,) = (note for note in drawn.notes if "drawn at random" in note)
    assert "30000" in note
    (chain,) = drawn.chains
    assert chain.length == pytest.approx(whole.length, abs=0.02)
    assert chain.radius == pytest.approx(whole.radius, rel=0.1)


def test_closing_that_adds_too_many_voxels_is_refused(monkeypatch):
    """Points two voxels apart: each stands for itself, and closing fills all between them."""
    points = lattice(126, 2)  # 4 mm apart
    scene = cloud_scene(points, voxel=0.002, radius=0.004)
    assert len(voxelize(scene).coords) > 3 * len(points)
    monkeypatch.setattr(import_module("doo3d.skeleton.voxelize"), "MAX_CELLS", 2 * len(points))
    with pytest.raises(doo3d.InputError, match="the grid would hold"):
        voxelize(scene)


@pytest.mark.parametrize("preset", ["image", "default"])
def test_the_size_of_a_mask_is_checked_before_the_work(preset, monkeypatch):
    def not_yet(*_):
        raise AssertionError("the strands were split before the size was checked")

    monkeypatch.setattr(import_module("doo3d.segment.segment"), "split_strands", not_yet)
    monkeypatch.setattr(import_module("doo3d.segment.checks"), "MAX_CELLS", 1000)
    with pytest.raises(doo3d.InputError, match=r"pixels, the limit is 1000"):
        detect(lines(SMALL, 20, 7), preset)


def test_a_strip_of_a_photograph_is_answered_at_once():
    detection = doo3d.detect(noise_image((20_000, 16)), doo3d.load_config("image"))
    assert not detection.chains
    assert any("times as long as wide" in note for note in detection.notes)


def test_junctions_are_looked_for_on_the_longest_chains(monkeypatch):
    mask = sticks((480, 270), 20, 5)
    config, frame = doo3d.load_config("harness"), frame_of_mask(mask, False)
    assert not any("junctions are looked for" in note for note in doo3d.detect(frame, config, mask=mask).notes)
    monkeypatch.setattr(import_module("doo3d.links.branches.branches"), "MAX_CHAINS", 3)
    detection = doo3d.detect(frame, config, mask=mask)
    assert any("junctions are looked for on the 3 longest" in note for note in detection.notes)
    in_objects = {number for each in detection.objects for number in each.chains}
    assert in_objects == set(range(len(detection.chains)))


def test_of_too_many_samples_along_the_paths_they_are_farther_apart(monkeypatch):
    stages = stages_of(sticks((480, 270), 20, 5), **UNEXTENDED)
    module = import_module("doo3d.scene.samples")
    usual = module.sample_paths(stages.filled, stages.scene.radius, 10.0)
    monkeypatch.setattr(module, "MAX_CELLS", len(usual.filled))
    fewer = module.sample_paths(stages.filled, stages.scene.radius, 10.0)
    assert len(fewer.filled) == pytest.approx(len(usual.filled) / 2, rel=0.05)
    assert fewer.spacing > usual.spacing


def test_in_a_mask_of_too_many_branches_no_gaps_are_looked_for(monkeypatch):
    mask = sticks((480, 270), 20, 5)
    frame = frame_of_mask(mask, False)
    usual = doo3d.detect(frame, mask=mask)
    assert not any("gaps between chains are not looked for" in note for note in usual.notes)
    monkeypatch.setattr(import_module("doo3d.scene.frame"), "MAX_BRANCHES", 10)
    assert any("gaps between chains are not looked for" in note for note in doo3d.detect(frame, mask=mask).notes)

"""Masks of noise, nets and folded strands: an answer or a sentence, with a bound on the work."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest
from builders.worst_cases import MASKS, cloud_of, frame_of_mask, image_of, noise_image, salt_and_pepper, sticks

import doo3d
from doo3d.pipeline import MAX_EXTENDED_CHAINS, run_stages
from doo3d.stages.merge import TOO_MANY
from doo3d.stages.merge.gap_path_costs import GapPaths

UNEXTENDED = {"extend_mask.max_length": 0}
SMALL = (240, 135)
FULL = (1280, 720)
AT_FULL_SIZE = (
    "salt and pepper, 35 %",
    "Hilbert curve, 1,024 places",
    "net of diagonals, 40 px",
    "300 sticks",
    "30 nested rectangles",
)
PRESETS = ("image", "paper_2d", "default")


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


def stages_of(mask, preset="image", **overrides):
    return run_stages(image_of(mask), doo3d.load_config(preset, overrides), mask)


def test_of_too_many_chains_the_longest_are_merged(monkeypatch):
    mask = sticks((480, 270), 60, 3)
    everything = stages_of(mask, **UNEXTENDED).pruned.chains
    limit = len(everything) // 2
    monkeypatch.setattr(import_module("doo3d.stages.merge.merge"), "MAX_CHAINS", limit)
    stages = stages_of(mask, **UNEXTENDED)
    left_out = [dropped.chain for dropped in stages.merged.dropped if dropped.setting == TOO_MANY]
    assert len(left_out) == len(everything) - limit
    used = sorted(len(chain.joints) for chain in everything)[-limit:]
    assert max(len(chain.joints) for chain in left_out) <= used[0]
    (note,) = stages.merged.notes
    assert f"{limit} longest" in note
    assert f"{len(left_out)} pieces" in note


def test_the_note_is_in_the_detection(monkeypatch):
    monkeypatch.setattr(import_module("doo3d.stages.merge.merge"), "MAX_CHAINS", 5)
    assert any(note.startswith("merge: ") for note in detect(sticks((480, 270), 60, 3), "image").notes)


def test_of_too_many_branches_the_longest_become_paths(monkeypatch):
    mask = sticks((480, 270), 60, 3)
    everything = stages_of(mask, **UNEXTENDED).paths
    limit = len(everything) // 4
    monkeypatch.setattr(import_module("doo3d.stages.traverse.traverse"), "MAX_BRANCHES", limit)
    traversal = stages_of(mask, **UNEXTENDED).traversal
    assert len(traversal.paths) <= limit
    (note,) = traversal.notes
    assert f"the {limit} longest are used" in note


def test_with_many_chains_the_mask_is_not_extended(monkeypatch):
    mask = sticks((480, 270), 60, 3)
    assert not stages_of(mask).extension_notes
    monkeypatch.setattr(import_module("doo3d.pipeline"), "MAX_EXTENDED_CHAINS", 2)
    stages = stages_of(mask)
    assert stages.segmentation.base is None
    assert "2" in stages.extension_notes[0]
    assert not stages_of(mask, **UNEXTENDED).extension_notes


def test_an_ordinary_frame_is_far_from_the_limits():
    stages = stages_of(sticks(FULL, 8, 7))
    assert len(stages.pruned.chains) < 100
    assert len(stages.chains) <= MAX_EXTENDED_CHAINS
    assert stages.merged.notes == stages.traversal.notes == stages.extension_notes == ()


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
    monkeypatch.setattr(import_module("doo3d.stages.merge.assignment"), "MAX_GAP_PATHS", 10)
    limited = stages_of(mask, **UNEXTENDED)
    assert len(set(made)) < exact_made
    assert limited.merged.decisions
    assert len(limited.merged.assemblies) <= 2 * len(exact.merged.assemblies)


@pytest.mark.slow
@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize(
    "kind",
    ["salt and pepper, 35 %", "Hilbert curve, 1,024 places", "net of diagonals, 40 px", "300 sticks", "30 nested rectangles"],
)
def test_at_full_size(kind, preset):
    check(answer(MASKS[kind](FULL), preset))


@pytest.mark.slow
def test_a_photograph_of_noise_at_full_size():
    check(doo3d.detect(noise_image(FULL), doo3d.load_config("image")))

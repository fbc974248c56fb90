"""An uncertain frame is interpreted in other ways too, and the most probable interpretation is kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders.drawn_masks import frame_of, line, wave
from builders.scenes import cloud_scene
from scipy.special import expit, logit

import doo3d
from doo3d.errors import InputError
from doo3d.judge import Evidence, interpretations
from doo3d.judge.interpretations import most_probable, other_interpretations
from doo3d.pipeline import run_stages
from doo3d.scene.frame import FrameScene
from doo3d.skeleton import graph
from doo3d.types import Chain

CONFIG = doo3d.load_config("default")
DOUBT = Evidence(residual=3.0, bend=2.0)


def chains_of(*evidence: Evidence) -> tuple[list[Chain], list[Evidence]]:
    """Return a chain for each evidence, and the evidence."""
    return [Chain(np.array([[0.0, 0, 1], [0, 0, 2]]), 1.0, confidence=each.confidence) for each in evidence], list(evidence)


@pytest.fixture(scope="module")
def scene() -> FrameScene:
    frame, mask = frame_of(line([-0.12, 0.0, 0.5], [0.12, 0.02, 0.5]), radius=0.004)
    return run_stages(frame, CONFIG, mask).scene


@pytest.fixture
def uncertain(monkeypatch) -> None:
    """Every frame counts as uncertain."""
    monkeypatch.setattr(interpretations, "CERTAIN", 0.9999)


def test_an_uncertain_frame_is_interpreted_in_other_ways(scene):
    assert other_interpretations(*chains_of(Evidence(), DOUBT), scene) == interpretations.OTHERS


def test_a_clear_frame_and_an_empty_one_need_no_other_interpretation(scene):
    assert other_interpretations(*chains_of(Evidence(), Evidence()), scene) == ()
    assert other_interpretations([], [], scene) == ()


@pytest.mark.parametrize("settings", [{"merge.strategy": "greedy"}, {"merge.branches": True}])
def test_rules_of_the_paper_and_branched_objects_need_no_other_interpretation(scene, settings):
    assert other_interpretations(*chains_of(DOUBT), scene.with_settings(doo3d.load_config("default", settings))) == ()


def test_strands_found_by_shape_and_clouds_need_no_other_interpretation(scene):
    for other in (replace(scene, object_given=False), cloud_scene(scene.points)):
        assert other_interpretations(*chains_of(DOUBT), other) == ()


def test_clutter_that_is_left_out_makes_no_frame_uncertain(scene):
    small_fragment = Evidence(small_fragment=1.0, stubby=4.0, residual=3.0)
    assert small_fragment.confidence < CONFIG.output.min_confidence
    assert other_interpretations(*chains_of(Evidence(), small_fragment), scene) == ()


def test_the_interpretation_with_the_least_doubt_is_kept_and_the_mean_is_its_confidence():
    likely, unlikely = Evidence(bend=1.0), Evidence(bend=2.0)
    best, (evidence, other) = most_probable([[unlikely], [], [likely, Evidence()]], CONFIG)
    assert best == 2
    assert evidence.confidence == pytest.approx(expit(np.mean([logit(likely.confidence), logit(unlikely.confidence)])))
    assert other.rivals == evidence.rivals > 0


def test_an_interpretation_that_leaves_more_of_the_mask_unclaimed_is_passed_over():
    usual = Evidence(bend=2.0, unclaimed=0.1)
    assert most_probable([[usual], [Evidence(unclaimed=0.2)]], CONFIG) == (0, [usual])
    assert most_probable([[usual], [Evidence(unclaimed=0.1)]], CONFIG)[0] == 1


def test_of_equal_interpretations_the_first_is_kept_without_loss():
    assert most_probable([[DOUBT], [DOUBT]], CONFIG) == (0, [DOUBT])


def test_interpretations_are_told_apart_where_their_confidence_is_zero():
    best, (evidence,) = most_probable([[Evidence(bend=2000.0)], [Evidence(bend=1000.0)]], CONFIG)
    assert best == 1
    assert evidence.confidence == 0.0


def test_the_chains_of_the_best_interpretation_are_returned_with_its_confidence(uncertain):
    frame, mask = frame_of(wave(0.02), radius=0.004)
    stages = run_stages(frame, CONFIG, mask)
    assert stages.chains
    assert [chain.confidence for chain in stages.chains] == [each.confidence for each in stages.evidence]
    again = run_stages(frame, CONFIG, mask)
    assert all((a.joints == b.joints).all() for a, b in zip(stages.chains, again.chains, strict=True))


def test_an_interpretation_in_finer_voxels_halves_their_edge(uncertain, monkeypatch):
    frame, mask = frame_of(line([-0.12, 0.0, 0.5], [0.12, 0.02, 0.5]), radius=0.008)
    monkeypatch.setattr(interpretations, "most_probable", lambda found, config: (0, found[0]))
    usual = run_stages(frame, CONFIG, mask).scene.voxel
    monkeypatch.setattr(interpretations, "most_probable", lambda found, config: (1, found[1]))
    assert run_stages(frame, CONFIG, mask).scene.voxel == pytest.approx(usual / 2)


def test_an_interpretation_with_too_many_voxels_is_passed_over(uncertain, monkeypatch):
    usual = graph.voxelize

    def limited(scene):
        if scene.voxel_factor < 1:
            raise InputError("too many", code="voxels-too-many")
        return usual(scene)

    monkeypatch.setattr(graph, "voxelize", limited)
    frame, mask = frame_of(line([-0.12, 0.0, 0.5], [0.12, 0.02, 0.5]), radius=0.004)
    assert len(run_stages(frame, CONFIG, mask).chains) == 1


def test_a_frame_of_many_pieces_is_interpreted_in_one_way_and_says_so(uncertain, monkeypatch):
    frame, mask = frame_of(wave(), radius=0.004)
    assert not run_stages(frame, CONFIG, mask).limit_notes
    monkeypatch.setattr(interpretations, "MAX_UNCERTAIN_PIECES", 0)
    monkeypatch.setattr(interpretations, "OTHERS", (None,))
    (note,) = run_stages(frame, CONFIG, mask).limit_notes
    assert "in one way only" in note

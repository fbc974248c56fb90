"""Explanations: costs that add up, runner-ups that are alternatives, and a count of everything that was dropped."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from builders.errors import code_in
from builders.paths import SAMPLES

import doo3d
from doo3d.config import load_config
from doo3d.inputs import open_capture
from doo3d.links.terms.gap_path import GapCost, GapPaths
from doo3d.pipeline import run_stages
from doo3d.tools.explain import explain_stages


@pytest.fixture(scope="module", params=[("crossing", "default"), ("photos/tangle.jpg", "image"), ("clouds/helix.ply", "default")])
def explained(request):
    name, preset = request.param
    config = load_config(preset)
    shot = open_capture(SAMPLES / name).frames[0].load()
    stages = run_stages(shot.data, config, shot.mask)
    return explain_stages(stages, config), stages


def test_the_merges_are_those_of_the_result(explained):
    found, stages = explained
    assert [merge.chosen.cost for merge in found.merges] == sorted(each.chosen.cost for each in stages.merged.decisions)
    assert sum(merge.kept for merge in found.merges) == sum(len(assembly.confidence) for assembly in stages.merged.assemblies)
    confidence = {round(value, 9) for assembly in stages.merged.assemblies for value in assembly.confidence}
    assert {round(merge.confidence, 9) for merge in found.merges if merge.kept} == confidence


def test_terms_add_up_and_merges_are_in_order(explained):
    found, _ = explained
    for merge in found.merges:
        for choice in (merge.chosen, merge.runner_up):
            if choice:
                assert choice.cost == pytest.approx(sum(choice.terms.values()))
                assert {"distance", "direction", "curvature", "free space", "unknown"} <= set(choice.terms)
    costs = [merge.chosen.cost for merge in found.merges]
    assert costs == sorted(costs)


def test_the_distance_term_is_the_distance(explained):
    found, stages = explained
    unit = 1000 if stages.graph.grid.coords.shape[1] == 3 else 1
    for merge in found.merges:
        gap = np.linalg.norm(np.subtract(*merge.chosen.points))
        assert merge.chosen.terms["distance"] == pytest.approx(unit * gap)


def test_the_runner_up_shares_an_end_and_is_another_pair(explained):
    found, _ = explained
    for merge in found.merges:
        if merge.runner_up:
            own, other = set(merge.chosen.ends), set(merge.runner_up.ends)
            assert len(own & other) == 1


def test_every_stage_has_an_account(explained):
    found, _ = explained
    names = [account.stage for account in found.accounts]
    assert names == ["segment", "voxelize", "thin", "traverse", "fit", "prune", "merge", "fill", "refine", "confidence"]
    assert all(account.made for account in found.accounts)


def test_the_account_of_segmentation_is_that_of_its_record(explained):
    found, stages = explained
    segmentation = stages.observed.segmentation
    removed = segmentation.removed_small, segmentation.removed_wide, segmentation.split
    counts = *removed, segmentation.repaired, segmentation.without_depth, segmentation.outliers
    account = found.accounts[0]
    assert len(account.dropped) == len(segmentation.scene.notes) + sum(count > 0 for count in counts)
    assert all(str(count) in " ".join(account.dropped) for count in (*removed, segmentation.outliers) if count)


def test_removed_segments_are_those_of_pruning(explained):
    found, stages = explained
    assert len(found.pruned) == len(stages.fitted.segments) - len(stages.pruned.chains.segments)


def test_explaining_measures_no_gap_path_that_merging_measured(monkeypatch):
    """Only those of runner-ups that joining ends never considered are left to explain."""
    config = load_config("default")
    loaded = open_capture(SAMPLES / "crossing").frames[0].load()
    stages = run_stages(loaded.data, config, loaded.mask)
    known = {decision.chosen.ends for decision in stages.merged.decisions}
    measured = []
    monkeypatch.setattr(GapPaths, "_measure", lambda self, pairs: measured.extend(pairs) or [GapCost(0.0, 0.0)] * len(pairs))
    explain_stages(stages, config)
    assert known
    assert not known & set(measured)


def test_chains_that_merging_drops_are_named():
    config = load_config("default", {"merge.chains": 1})
    shot = open_capture(SAMPLES / "two_cables").frames[0].load()
    stages = run_stages(shot.data, config, shot.mask)
    found = explain_stages(stages, config)
    (merging,) = [account for account in found.accounts if account.stage == "merge"]
    assert any("merge.chains" in sentence for sentence in merging.dropped)
    assert any(not merge.kept for merge in found.merges)


def test_from_the_shell(doo3d, tmp_path):
    code, out, err = doo3d("explain", SAMPLES / "crossing", "--frame", "000001", "--json", "why.json")
    assert code == 0, err
    lines = out.splitlines()
    assert lines[0] == "frame 000001"
    assert "merges, in order:" in lines
    assert sum("next best: " in line for line in lines) == 2
    assert any(line.split(None, 1) == ["merge", "2 connections, 1 chain"] for line in lines)
    why = json.loads((tmp_path / "why.json").read_text())
    assert (why["schema"], why["frame"], len(why["merges"])) == ("doo3d/explanation/1", "000001", 2)
    code, _, err = doo3d("explain", SAMPLES / "crossing", "--json", "why.json")
    assert (code, code_in(err), "why.json" in err) == (2, "out-exists", True)
    code, _, err = doo3d("explain", SAMPLES / "crossing", "--frame", "nine")
    assert (code, code_in(err), "--frame nine: " in err) == (2, "frame-unknown", True)


def test_nothing_found(doo3d, capture):
    """A note names the stage that lost everything, in the output of detect, in its files, and in that of explain."""
    folder, nothing_blue = capture(), "segment.ranges=[{low: [90, 200, 200], high: [100, 255, 255]}]"
    code, out, err = doo3d("detect", folder, "--set", nothing_blue)
    assert code == 0, err
    assert "note: segment (hsv): no object in this frame" in out
    assert "doo3d tune" in out
    assert "doo3d tune" in json.loads(Path("out/000000.json").read_text())["notes"][0]
    code, out, err = doo3d("explain", folder, "--set", nothing_blue)
    assert code == 0, err
    assert "dropped: segment (hsv): no object in this frame" in out


@pytest.mark.parametrize(("override", "stage"), [("fit.segment_length=9", "fit"), ("merge.min_length=10000", "merge")])
def test_everything_is_lost_after_segmentation(doo3d, capture, override, stage):
    code, out, err = doo3d("detect", capture(), "--set", override)
    assert code == 0, err
    assert f"note: {stage}: nothing is left after this stage" in out
    assert "doo3d" in out
    assert doo3d("explain", "capture", "--set", override)[0] == 0


def test_explain_takes_what_detect_takes():
    loaded = open_capture(SAMPLES / "crossing").frames[0].load()
    explanation = doo3d.explain(loaded.data, doo3d.load_config("default", {"merge.chains": 1}))
    assert next(account.stage for account in explanation.accounts) == "segment"
    assert len(explanation.merges) == len(doo3d.detect(loaded.data).chains[0].connections)

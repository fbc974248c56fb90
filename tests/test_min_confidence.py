"""Chains of low confidence are left out of a detection, with what refers to them, and a note counts them."""

from __future__ import annotations

import numpy as np
import pytest
from builders.drawn_masks import frame_of, line
from builders.paths import SAMPLES
from typer.testing import CliRunner

import doo3d
from doo3d.cli import app
from doo3d.types import Chain, ChainEnd, Crossing, Detection, Junction, LinearObject, SegmentRef


def chain(confidence: float, y: float = 0.0, count: int = 5) -> Chain:
    joints = np.column_stack((0.01 * np.arange(count + 1), np.full(count + 1, y), np.full(count + 1, 0.5)))
    return Chain(joints, 0.01, 0.002, confidence=confidence)


def crossing(upper: int, lower: int) -> Crossing:
    return Crossing(SegmentRef(upper, 1), SegmentRef(lower, 2), np.zeros(3))


def test_doubtful_chains_go_with_their_crossings_and_the_others_are_renumbered():
    found = Detection((chain(0.9), chain(0.02), chain(0.5)), crossings=(crossing(0, 1), crossing(2, 0)), notes=("before",))
    kept = found.confident(0.05)
    assert [each.confidence for each in kept.chains] == [0.9, 0.5]
    ((upper, lower),) = [(each.upper, each.lower) for each in kept.crossings]
    assert (upper, lower) == (SegmentRef(1, 1), SegmentRef(0, 2))
    assert kept.notes[0] == "before"
    assert kept.notes[1].startswith(
        "output: left out 1 doubtful chain (0.050 m long, confidence 0.02), below output.min_confidence 0.05"
    )
    assert kept.confidence == 0.5


def test_nothing_changes_where_nothing_is_doubtful_or_all_is_wanted():
    found = Detection((chain(0.9), chain(0.02)))
    assert found.confident(0.0) is found
    assert found.confident(0.02) is found


def test_a_branched_object_is_kept_or_left_out_as_a_whole():
    trunk, branch, alone, weak = chain(0.9), chain(0.01), chain(0.03), chain(0.04)
    sure = Junction(np.zeros(3), (ChainEnd(1, 0), ChainEnd(2, 0), ChainEnd(3, 1)), np.full(3, 0.002))
    found = Detection(
        (alone, trunk, branch, weak, alone),
        junctions=(sure,),
        objects=(LinearObject((0,)), LinearObject((1, 2, 3), (0,), 2), LinearObject((4,))),
    )
    kept = found.confident(0.05)
    assert [each.confidence for each in kept.chains] == [0.9, 0.01, 0.04]
    assert kept.objects == (LinearObject((0, 1, 2), (0,), 2),)
    assert kept.junctions[0].ends == (ChainEnd(0, 0), ChainEnd(1, 0), ChainEnd(2, 1))


@pytest.mark.parametrize(("least", "given", "left"), [(0.0, False, 1), (0.1, False, 1), (1.0, False, 0), (1.0, True, 1)])
def test_the_setting_decides_where_nobody_said_what_the_object_is(least, given, left):
    frame, mask = frame_of(line([-0.12, 0.0, 0.5], [0.12, 0.02, 0.5]), radius=0.004)
    detection = doo3d.detect(frame, {"output.min_confidence": least}, mask if given else None)
    assert len(detection.chains) == left
    assert any(note.startswith("output: left out") for note in detection.notes) == (left == 0)


def test_reports_and_exports_leave_out_what_is_below_their_own_threshold(tmp_path):
    found = Detection((chain(0.9), chain(0.3)), frame="000000")
    file = tmp_path / "a.npz"
    with pytest.warns(UserWarning, match=r"below the confidence 0\.5 are left out: 1"):
        doo3d.export(found, "npz", file, min_confidence=0.5)
    with np.load(file) as stored:
        assert stored["confidence"].tolist() == [0.9]


def test_the_shell_takes_the_threshold(tmp_path):
    out = tmp_path / "out"
    for command in (["detect", str(SAMPLES / "straight"), "-o", str(out), "--frames", "0"],):
        assert CliRunner().invoke(app, command).exit_code == 0
    rows = []
    for least in ("0", "1"):
        table, page = tmp_path / f"{least}.csv", tmp_path / f"{least}.html"
        common = [str(out), "--min-confidence", least, "-o"]
        assert CliRunner().invoke(app, ["export", *common, str(table), "--to", "csv"]).exit_code == 0
        assert CliRunner().invoke(app, ["report", *common, str(page), "--no-clouds"]).exit_code == 0
        rows.append(len(table.read_text(encoding="utf-8").splitlines()))
        assert ("left out 1 doubtful chain" in page.read_text(encoding="utf-8")) == (least == "1")
    assert rows[0] > 2
    assert rows[1] == 1  # the header

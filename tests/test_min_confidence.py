"""Which chains are given, doubtful or left out: by confidence where nothing was given, and all where something was."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from builders.drawn_masks import frame_of, line
from builders.paths import SAMPLES
from typer.testing import CliRunner

import doo3d
from doo3d.cli import app
from doo3d.types import Chain, ChainEnd, Crossing, Detection, Junction, LinearObject, SegmentRef
from doo3d.types.display import doubtful_text

LONG = 12
"""Segments of 10 mm of a chain that is 60 times as long as its radius of 2 mm."""


def chain(confidence: float, y: float = 0.0, count: int = 5) -> Chain:
    joints = np.column_stack((0.01 * np.arange(count + 1), np.full(count + 1, y), np.full(count + 1, 0.5)))
    return Chain(joints, 0.01, 0.002, confidence=confidence)


def crossing(upper: int, lower: int) -> Crossing:
    return Crossing(SegmentRef(upper, 1), SegmentRef(lower, 2), np.zeros(3))


def test_short_chains_go_with_their_crossings_and_the_others_are_renumbered():
    found = Detection((chain(0.9), chain(0.02), chain(0.5)), crossings=(crossing(0, 1), crossing(2, 0)), notes=("before",))
    kept = found.confident(0.05)
    assert [each.confidence for each in kept.chains] == [0.9, 0.5]
    ((upper, lower),) = [(each.upper, each.lower) for each in kept.crossings]
    assert (upper, lower) == (SegmentRef(1, 1), SegmentRef(0, 2))
    assert kept.notes[0] == "before"
    assert kept.notes[1].startswith("output: left out 1 chain (0.050 m long, confidence 0.02), below output.min_confidence 0.05")
    assert kept.doubtful == ()
    assert kept.confidence == 0.5


def test_long_chains_are_doubtful_and_short_ones_are_left_out():
    found = Detection((chain(0.9), chain(0.02, count=LONG), chain(0.03, count=LONG - 1)), crossings=(crossing(0, 1),))
    kept = found.confident(0.05)
    assert (kept.chains, kept.doubtful, kept.crossings) == (found.chains[:1], found.chains[1:2], ())
    assert kept.confidence == 0.02
    assert [note.split(",")[0] for note in kept.notes] == ["output: left out 1 chain (0.110 m long"]
    assert repr(kept) == "Detection('frame', 1 chain, 0.050 m, 1 doubtful (0.12 m, 0.02), confidence 0.02)"
    assert kept.confident(0.05) is kept
    assert kept.confident(1.0).doubtful == (kept.doubtful[0], kept.chains[0])


def test_the_most_confident_chain_of_a_frame_without_others_is_doubtful_however_short():
    found = Detection((chain(0.025, count=LONG), chain(0.03), chain(0.04), chain(0.02), chain(0.005, count=LONG)))
    kept = found.confident(0.05)
    assert (kept.chains, kept.doubtful) == ((), (found.chains[0], found.chains[2]))
    assert "left out 3 chains" in kept.notes[0]


def test_what_is_no_cable_for_sure_is_not_doubtful():
    kept = Detection((chain(0.0, count=LONG),)).confident(0.05)
    assert (kept.chains, kept.doubtful, kept.confidence) == ((), (), None)
    assert repr(kept) == "Detection('frame', 0 chains)"


def test_a_doubtful_object_that_branches_is_doubtful_as_a_whole():
    objects = (LinearObject((0,)), LinearObject((1, 2, 3)))
    parts = (chain(0.01, count=5), chain(0.02, count=4), chain(0.01, count=3))
    kept = Detection((chain(0.9), *parts), objects=objects).confident(0.05)
    assert (len(kept.chains), kept.doubtful, kept.objects) == (1, parts, (LinearObject((0,)),))
    assert kept.table("doubtful")["object"] == [None] * 3


def test_doubtful_chains_are_moved_with_the_others_and_have_a_table():
    found = Detection((chain(0.9),), doubtful=(chain(0.02, count=LONG),))
    pose = np.eye(4)
    pose[:3, 3] = 1.0, 2.0, 3.0
    moved = found.transformed(pose)
    assert np.allclose(moved.doubtful[0].joints, found.doubtful[0].joints + pose[:3, 3])
    assert np.allclose(moved.in_camera().doubtful[0].joints, found.doubtful[0].joints)
    table = found.table("doubtful")
    assert list(table) == list(found.table())
    assert (table["length"], table["confidence"]) == ([pytest.approx(0.12)], [0.02])


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
    assert (len(detection.chains), len(detection.doubtful)) == (left, 1 - left)


@pytest.mark.parametrize(
    "settings", [{}, {"segment.ranges": [{"low": [18, 80, 40], "high": [35, 255, 255]}]}, {"segment.method": "everything"}]
)
def test_no_chain_is_left_out_where_the_object_is_given_by_mask_or_color(settings):
    """Not even a short cable beside one more than five times as long, nor where the threshold would leave out any chain."""
    axes = line([-0.15, -0.03, 0.5], [0.15, -0.03, 0.5]), line([0.0, 0.03, 0.5], [0.045, 0.03, 0.5])
    frame, mask = frame_of(*axes, radius=0.004)
    color = np.where(mask[..., None], (230, 200, 30), (90, 90, 90)).astype(np.uint8)
    frame = doo3d.Frame(color, frame.depth, frame.camera)
    detection = doo3d.detect(frame, settings | {"output.min_confidence": 1.0}, None if settings else mask)
    assert [chain.length for chain in detection.chains] == pytest.approx([0.3, 0.045], abs=0.02)
    assert not any("left out" in note for note in detection.notes)


@pytest.mark.parametrize("wanted", [1, 2])
def test_so_many_chains_are_given_as_are_wanted(wanted):
    frame = doo3d.open_capture(SAMPLES / "two_cables").frames[0].load().data
    every = doo3d.detect(frame)
    found = doo3d.detect(frame, {"merge.chains": wanted})
    assert [chain.length for chain in found.chains] == [chain.length for chain in every.chains[:wanted]]
    assert found.confidence == pytest.approx(min(chain.confidence for chain in every.chains[:wanted]))
    if wanted == 1:
        assert any("the most probable is kept" in note for note in found.notes)


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
        frame = json.loads(re.search(r'id="data">(.*?)</script>', page.read_text(encoding="utf-8"), re.DOTALL)[1])["frames"][0]
        assert (len(frame["chains"]), len(frame["doubtful"])) == ((1, 0) if least == "0" else (0, 1))
    assert rows[0] > 2
    assert rows[1] == 1  # the header


def test_the_line_of_a_frame_lists_what_is_doubtful(tmp_path):
    out, capture = tmp_path / "out", str(SAMPLES / "two_cables")
    command = ["detect", capture, "-o", str(out), "--set", "output.min_confidence=1"]
    shown = CliRunner().invoke(app, command)
    assert shown.exit_code == 0
    first, *_, last = shown.stdout.splitlines()
    assert re.match(r"000000   0 chains, 2 doubtful \(0\.6\d m, 0\.\d\d; 0\.5\d m, 0\.\d\d\)   \d+ ms$", first)
    assert last == f"1 frame, 0 chains, 2 doubtful -> {out}"
    (frame,) = json.loads((out / "manifest.json").read_text(encoding="utf-8"))["frames"]
    assert (frame["chains"], frame["doubtful"]) == (0, 2)
    again = CliRunner().invoke(app, command)
    assert "1 frame is finished already" in again.stderr
    assert again.stdout.splitlines()[-1] == last


@pytest.mark.parametrize(
    ("chains", "text"),
    [
        ([], ""),
        ([(0.82, 0.13)], "1 doubtful (0.82 m, 0.13)"),
        ([(0.82, 0.13)] * 4, "4 doubtful (0.82 m, 0.13; 0.82 m, 0.13; 0.82 m, 0.13; ...)"),
    ],
)
def test_doubtful_chains_in_words(chains, text):
    assert doubtful_text(chains, False) == text
    assert doubtful_text([(312.4, 0.13)], True) == "1 doubtful (312 px, 0.13)"

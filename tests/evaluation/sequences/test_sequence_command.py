"""`doo3d evaluate sequences`: what it prints and writes, and what it refuses."""

import csv
import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders.errors import code_in
from builders.paths import DATA

from doo3d.evaluation.sequences.evaluate import VARIANTS

SMALL = ("--size", "160x120", "--sensor", "perfect")
MOTION = DATA / "motion" / "DLO1_101.npy"


def test_own_motions_are_scored_drawn_and_written(doo3d):
    options = ("--own", "dragged", "--frames", 12, "--csv", "rows.csv", "--json", "all.json", "--pictures", "hard", "--worst", 3)
    options = (*options, "--size", "320x240")
    code, out, err = doo3d("evaluate", "sequences", *SMALL, *options)
    assert (code, err) == (0, "")
    lines = [line.split() for line in out.splitlines()]
    assert [line[:2] for line in lines[2:7]] == [["dragged-0", name] for name in VARIANTS]
    with Path("rows.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["variant"], int(row["frame"])) for row in rows[::12]] == [(name, 0) for name in VARIANTS]
    assert len(rows) == 5 * 12
    written = json.loads(Path("all.json").read_text())
    assert written["schema"] == "doo3d/evaluation/3"
    assert written["settings"]["motions"] == ["dragged"]
    frame = written["frames"][0]
    assert frame["found_length"] == pytest.approx(frame["true_length"], rel=0.03)
    summary = {name.removeprefix("all "): values for name, values in written["summary"].items() if name.startswith("all ")}
    for variant, figures in summary.items():
        correct = sum(row["correct"] for row in written["frames"] if row["variant"] == variant)
        assert (figures["frames"], figures["frames_correct"]) == (12, correct)
    single, whole = summary["single"], summary["sequence"]
    assert whole["frames_correct"] >= single["frames_correct"]
    assert whole["node_error"] < single["node_error"]
    assert single["time_ratio"] == 1
    assert summary["oracle-both"]["frames_correct"] == 12
    assert summary["oracle-both"]["node_error"] < summary["oracle-past"]["node_error"] < whole["node_error"]
    drawn = [Path(line) for line in out.splitlines() if line.endswith(".png")]
    assert sorted(drawn) == sorted(Path("hard").iterdir())
    assert sum(path.stem.endswith("_single") for path in drawn) == 3
    assert all(cv2.imread(str(path)) is not None for path in drawn)


def markers(path, jump=0.0):
    points = np.zeros((30, 8, 3))
    points[..., 0] = np.linspace(0.0, 0.5, 8) + jump * (np.arange(8) > 4)
    points[..., 2] = 0.05 * np.sin(points[..., 0] * 6 + np.arange(30)[:, None] / 20)
    np.save(path, points)


def test_motion_capture_is_read_and_a_branched_file_of_the_folder_left_out(doo3d, tmp_path):
    folder = tmp_path / "motion"
    folder.mkdir()
    markers(folder / "a.npy")
    markers(folder / "b.npy", jump=0.4)
    options = ("--own", "none", "--frames", 4, "--level", "easy", "--count", "auto")
    code, out, err = doo3d("evaluate", "sequences", *SMALL, *options, "--motions", folder)
    assert code == 0, err
    assert [line.split()[0] for line in out.splitlines()[2:]] == ["a-0"] * len(VARIANTS)
    assert err.startswith("note: left out: ")
    assert "b.npy" in err
    code, out, err = doo3d("evaluate", "sequences", *SMALL, *options, "--motions", folder / "b.npy")
    assert (code, out, code_in(err)) == (2, "", "truth-invalid")


@pytest.mark.slow
@pytest.mark.skipif(not MOTION.is_file(), reason="needs shared/data/motion")
def test_a_real_motion_is_followed(doo3d):
    options = ("--motions", MOTION, "--own", "none", "--frames", 6, "--level", "easy", "--size", "320x240", "--json", "a.json")
    code, _, err = doo3d("evaluate", "sequences", *options)
    assert code == 0, err
    written = json.loads(Path("a.json").read_text())
    assert written["frames"][0]["family"] == "DLO1_101-0"
    summary = written["summary"]
    assert summary["all sequence"]["frames_correct"] >= summary["all single"]["frames_correct"]

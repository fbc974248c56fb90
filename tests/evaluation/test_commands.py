"""`doo3d evaluate`: what its commands print and write."""

import csv
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from builders.errors import code_in
from builders.paths import SAMPLES

from doo3d.commands.evaluate import _families

SMALL = ("--size", "640x480", "--sensor", "perfect", "--families", "straight")


@pytest.mark.slow
def test_scenes_are_scored_and_written(doo3d):
    options = ("--seeds", 2, "--start", 3, "--csv", "rows.csv", "--json", "all.json", "--pictures", "worst", "--worst", 2)
    code, out, err = doo3d("evaluate", "scenes", *SMALL, *options)
    assert code == 0, err
    assert err.splitlines() == []
    assert "2/2 100.0 %" in out
    with Path("rows.csv").open() as file:
        assert [row["frame"] for row in csv.DictReader(file)] == ["straight_003", "straight_004"]
    written = json.loads(Path("all.json").read_text())
    assert written["settings"]["sensor"] == "perfect"
    assert written["summary"]["straight"]["frames_correct"] == 2
    drawn = sorted(path.name for path in Path("worst").iterdir())
    assert drawn == ["straight_003.png", "straight_004.png"]
    assert sorted(Path(line).name for line in out.splitlines() if line.endswith(".png")) == drawn


def test_the_number_may_be_left_to_the_data(doo3d):
    assert (
        doo3d("evaluate", "scenes", *SMALL, "--seeds", 1, "--count", "auto", "--json", "a.json", "--set", "merge.chains=3")[0]
        == 0
    )
    assert json.loads(Path("a.json").read_text())["summary"]["all"]["count_correct"] == 1


def test_the_stereo_sensor_and_a_ragged_mask_are_chosen_by_name(doo3d):
    options = ("--size", "320x240", "--families", "straight", "--seeds", 1, "--sensor", "stereo", "--mask", "ragged")
    code, out, err = doo3d("evaluate", "scenes", *options, "--json", "a.json")
    assert code == 0, err
    assert "right in" in out
    written = json.loads(Path("a.json").read_text())
    assert (written["settings"]["sensor"], written["settings"]["mask"]) == ("stereo", "ragged")
    assert written["summary"]["straight"]["image"] == 1
    assert written["frames"][0]["image_correct"] in (True, False)
    assert doo3d("evaluate", "scenes", *options, "--json", "b.json")[0] == 0
    again = json.loads(Path("b.json").read_text())
    assert {**again["frames"][0], "ms": 0} == {**written["frames"][0], "ms": 0}


def test_groups_of_families_are_chosen_by_name():
    basic, more, both = (_families(name) for name in ("basic", "more", "all"))
    assert (len(basic), len(more)) == (14, 13)
    assert both == basic + more == _families("more,basic,ring")[13:] + more


BAD_OPTIONS = {
    "scenes": [
        (("--families", "straight,nope"), "choice-unknown", "--families nope"),
        (("--sensor", "eye"), "choice-unknown", "--sensor eye"),
        (("--mask", "x"), "choice-unknown", "--mask x"),
        (("--count", "2"), "choice-unknown", "--count 2"),
        (("--size", "640"), "value-invalid", "--size 640"),
        (("-c", "image"), "config-mode", ""),
    ],
    "sequences": [
        (("--own", "dragged,nope"), "choice-unknown", "--own nope"),
        (("--own", "none"), "options-conflict", "--own none"),
        (("--level", "harder"), "choice-unknown", "--level harder"),
        (("--sensor", "eye"), "choice-unknown", "--sensor eye"),
        (("--count", "2"), "choice-unknown", "--count 2"),
        (("--motions", "nowhere.npy"), "file-missing", "nowhere.npy"),
        (("--size", "160x120", "-c", "image"), "config-mode", ""),
    ],
    "trees": [
        (("--mask", "none"), "choice-unknown", "--mask none"),
        (("--families", "crossing"), "choice-unknown", "--families crossing"),
        (("-c", "default"), "options-conflict", "merge.branches"),
        (("--motion", "absent.npy"), "file-missing", "absent.npy"),
    ],
    "dataset": [
        (("s4", "x"), "choice-unknown", "mbest, cset, tubes"),
        (("mbest", "x", "--seeds", 2), "options-conflict", "--seeds: does not apply to the data set mbest"),
        (("cset", "x", "--single"), "options-conflict", "--single: does not apply to the data set cset"),
        (("tubes", "x", "--subset", "S1"), "options-conflict", "--subset"),
        (("tubes", "x", "--chains-from-data"), "options-conflict", "--known-count"),
        (("tubes", "x", "--sensor", "eye"), "choice-unknown", "--sensor eye"),
        (("tubes", "x"), "tubes-missing", "x"),
    ],
}


@pytest.mark.parametrize(("command", "case"), [(command, case) for command, cases in BAD_OPTIONS.items() for case in cases])
def test_bad_options_are_named(doo3d, command, case):
    options, code, part = case
    status, out, err = doo3d("evaluate", command, *options)
    assert (status, out, code_in(err)) == (2, "", code)
    assert part in err


@pytest.mark.slow
def test_a_capture_and_results_are_scored_against_a_truth_file(doo3d, tmp_path):
    truth = tmp_path / "mine.json"
    truth.write_bytes((SAMPLES / "straight" / "truth.json").read_bytes())
    code, out, _ = doo3d("evaluate", "capture", SAMPLES / "straight", "--truth", truth)
    assert code == 0
    assert "1/1 100.0 %" in out
    assert doo3d("detect", SAMPLES / "straight", "-o", "out", "--quiet")[0] == 0
    code, out, _ = doo3d("evaluate", "results", "out", "--truth", truth, "--csv", "r.csv")
    assert code == 0
    assert out.splitlines()[-1].startswith("out ")
    assert "1/1 100.0 %" in out
    assert len(Path("r.csv").read_text().splitlines()) == 2
    assert doo3d("evaluate", "results", "nowhere", "--truth", truth)[0] == 2
    code, _, err = doo3d("evaluate", "results", "out", "--truth", truth, "--csv", "no/such/r.csv")
    assert (code, code_in(err)) == (2, "out-unwritable")
    assert str(Path("no/such/r.csv")) in err


def test_frames_that_cannot_be_read_are_wrong(doo3d, tmp_path):
    folder = tmp_path / "rope"
    shutil.copytree(SAMPLES / "straight", folder)
    values = json.loads((folder / "truth.json").read_text())
    values["frames"] |= {"000001": values["frames"]["000000"], "000002": []}  # a rope, and nothing
    (folder / "truth.json").write_text(json.dumps(values))
    for part in ("color", "depth"):
        (file,) = (folder / part).iterdir()
        for name in ("000001", "000002"):
            (folder / part / f"{name}{file.suffix}").write_bytes(file.read_bytes()[:500])
    code, out, err = doo3d("evaluate", "capture", folder, "--json", "e.json", "--pictures", "worst", "--worst", 3)
    assert code == 0
    assert re.search(r" 1/3 +33\.3 %", out)
    lines = [line for line in err.splitlines() if "cannot be read" in line]
    assert [line.split()[0] for line in lines] == ["000001", "000002"]
    assert "is cut off" in lines[0]
    assert code_in(lines[0]) == "file-damaged"
    rows = json.loads(Path("e.json").read_text())["frames"]
    assert [row["correct"] for row in rows] == [True, False, False]
    assert [row["chains"] for row in rows] == [1, 0, 0]
    assert [row["code"] for row in rows] == [None, *map(code_in, lines)]
    assert [path.name for path in Path("worst").iterdir()] == ["rope_000000.png"]


def test_how_a_capture_is_to_be_read_is_lines_to_evaluate(doo3d):
    code, _, err = doo3d("evaluate", "capture", SAMPLES / "straight", "--input-option", "nothing=1")
    assert code == 2
    assert code_in(err) == "key-unknown"
    assert "--input-option nothing" in err
    code, out, _ = doo3d(
        "evaluate", "capture", SAMPLES / "straight", "--input-option", "depth_scale=500"
    )  # twice as far as it is
    assert code == 0
    assert re.search(r" 0/1 +0\.0 %", out)


@pytest.mark.slow
def test_ablations_are_two_lines_each_and_rows_of_csv_and_json(doo3d):
    options = ("--data", "frames,images", "--families", "straight", "--seeds", 1, "--size", "320x240")
    steps = ("--steps", "smoothing of the axis,bare surface", "--csv", "bill.csv", "--json", "bill.json")
    code, out, _ = doo3d("evaluate", "ablations", *options, *steps)
    assert code == 0
    lines = out.splitlines()
    assert len(lines) == 1 + 2 * 2
    rows = json.loads(Path("bill.json").read_text())["rows"]
    assert [(row["step"], row["data"], row["frames"]) for row in rows] == [
        ("smoothing of the axis", "own", 1),
        ("smoothing of the axis", "all", 2),
        ("bare surface", "own", 1),
        ("bare surface", "all", 2),
    ]
    assert len(Path("bill.csv").read_text().splitlines()) == 5


@pytest.mark.slow
def test_a_bar_on_a_terminal_only(tmp_path):
    pty = pytest.importorskip("pty")
    main_end, terminal = pty.openpty()
    command = [sys.executable, "-m", "doo3d", "evaluate", "scenes", *SMALL, "--seeds", "2"]
    run = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=terminal)
    os.close(terminal)
    shown = b""
    while True:
        try:
            part = os.read(main_end, 4096)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        shown += part
    out = run.communicate()[0]
    os.close(main_end)
    assert run.returncode == 0
    assert b"2/2" in shown
    assert b"2 correct   straight_001" in shown
    assert b"\x1b" not in out
    assert b"2/2 100.0 %" in out


def test_trees_are_scored_drawn_and_written(doo3d):
    options = ("--families", "tree,tree_two", "--seeds", 1, "--size", "640x360", "--sensor", "perfect", "--mask", "ragged")
    code, out, err = doo3d("evaluate", "trees", *options, "--json", "a.json", "--pictures", "worst")
    assert code == 0, err
    assert err == ""
    assert [line.split()[0] for line in out.splitlines()[:4]] == ["objects", "right", "tree", "tree_two"]
    assert {path.name for path in Path("worst").iterdir()} - {"failures.png"} == {"tree_000.png", "tree_two_000.png"}
    written = json.loads(Path("a.json").read_text())
    assert (written["settings"]["mask"], written["settings"]["seeds"]) == ("ragged", 1)
    assert written["summary"]["tree_two"]["objects"] == 2
    assert written["summary"]["all"]["objects"] == 3
    assert [frame["frame"] for frame in written["frames"]] == ["tree_000", "tree_two_000"]

"""A run: what is written, what one bad frame does, and that a run of which nothing comes leaves nothing."""

from __future__ import annotations

import json
import os

import numpy as np
import pytest

from doo3d import batch
from doo3d.config import Config, load_config
from doo3d.errors import InputError
from doo3d.inputs import open_capture
from doo3d.outputs import results
from doo3d.types import Chain, Detection, Frame


@pytest.fixture(autouse=True)
def found(monkeypatch):
    """A detection without the pipeline, so that these tests say what the run does; what it does is `found["do"]`."""
    chain = Chain(np.array([[-0.02, 0, 0.5], [-0.01, 0, 0.5], [0, 0, 0.5]]), 0.01, 0.005, occluded=np.array([True, False]))
    what = {"do": lambda data, config, mask: Detection((chain,), frame="other", notes=("a note",))}
    monkeypatch.setattr(batch, "detect", lambda data, config, mask=None: what["do"](data, config, mask))
    return what


def manifest(out):
    return json.loads((out / "manifest.json").read_text(encoding="utf-8"))


def bad(folder, name):
    (folder / "depth" / f"{name}.png").write_bytes(b"\x89PNG\r\n\x1a\n")


def test_what_a_run_writes(capture, tmp_path):
    config = load_config("default", {"merge.chains": 2})
    out = tmp_path / "a" / "b"
    seen = []
    summary = batch.run(open_capture(capture(frames=2)), out, config, report=seen.append)
    assert sorted(os.listdir(out)) == [
        "000000.json",
        "000000.png",
        "000001.json",
        "000001.png",
        "config.yaml",
        "manifest.json",
    ]
    assert json.loads((out / "000001.json").read_text())["frame"] == "000001"
    assert load_config(out / "config.yaml") == config
    assert summary.counts() == {"frames": 2, "ok": 2, "failed": 0, "chains": 2}
    assert [record.name for record in seen] == ["000000", "000001"]
    assert seen[0].occluded == 0.5
    assert seen[0].notes == ("a note",)
    made = manifest(out)
    assert made["schema"] == "doo3d/manifest/1"
    assert made["finished"] is True
    assert made["config_digest"] == results.digest(config)
    assert made["versions"]["doo3d"]
    assert made["input"]["format"] == "folder"
    assert made["counts"] == summary.counts()
    frame = made["frames"][0]
    assert (frame["name"], frame["status"], frame["chains"], frame["error"]) == ("000000", "ok", 1, None)
    assert frame["lengths"] == [0.02]
    assert frame["seconds"] > 0
    assert frame["source"].endswith("000000.png")
    assert frame["timestamp"] is None


def test_masks_reach_the_detection(capture, tmp_path, found):
    given = []
    inner = found["do"]
    found["do"] = lambda data, config, mask: (given.append((data, mask)), inner(data, config, mask))[1]
    batch.run(open_capture(capture(mask=True)), tmp_path / "out", Config())
    ((data, mask),) = given
    assert isinstance(data, Frame)
    assert mask.any()


@pytest.mark.parametrize(("method", "used"), [("auto", True), ("mask", True), ("plane", False), ("everything", False)])
def test_a_named_way_of_segmenting_goes_before_the_folders_masks(capture, tmp_path, found, method, used):
    given = []
    inner = found["do"]
    found["do"] = lambda data, config, mask: (given.append(mask), inner(data, config, mask))[1]
    batch.run(open_capture(capture(mask=True)), tmp_path / "out", load_config("default", {"segment.method": method}))
    assert (given[0] is not None) == used


def test_one_bad_frame_does_not_stop_the_others(capture, tmp_path):
    folder, out = capture(frames=3), tmp_path / "out"
    bad(folder, "000000")
    summary = batch.run(open_capture(folder), out, Config())
    assert (summary.succeeded, summary.failed) == (2, 1)
    frame = manifest(out)["frames"][0]
    assert frame["status"] == "failed"
    assert "000000.png" in frame["error"]
    assert "cut off" in frame["error"]
    assert not (out / "000000.json").exists()


def test_what_nobody_foresaw_is_recorded_with_its_type_and_place(capture, tmp_path, found):
    inner = found["do"]

    def fails_once(data, config, mask):
        if data.name == "000001":
            raise ZeroDivisionError("by zero")
        return inner(data, config, mask)

    found["do"] = fails_once
    out = tmp_path / "out"
    summary = batch.run(open_capture(capture(frames=3)), out, Config())
    assert summary.failed == 1
    assert "ZeroDivisionError at " in manifest(out)["frames"][1]["error"]
    assert "by zero" in manifest(out)["frames"][1]["error"]


def test_a_picture_that_cannot_be_drawn_fails_its_frame_only(capture, tmp_path, monkeypatch):
    calls = []

    def draws(path, detection, data):
        calls.append(path)
        if len(calls) == 2:
            raise ValueError("no ink")

    real = results.writer
    monkeypatch.setattr(results, "writer", lambda kind: draws if kind == "overlay" else real(kind))
    out = tmp_path / "out"
    summary = batch.run(open_capture(capture(frames=3)), out, Config())
    assert [record.status for record in summary.records] == ["ok", "failed", "ok"]
    assert not (out / "000001.json").exists()
    assert "no ink" in manifest(out)["frames"][1]["error"]


@pytest.mark.parametrize("deep", ["out", "a/b/out"])
def test_nothing_is_left_when_all_frames_fail(capture, tmp_path, deep):
    folder = capture(frames=2)
    for name in ("000000", "000001"):
        bad(folder, name)
    before = sorted(os.listdir(tmp_path))
    summary = batch.run(open_capture(folder), tmp_path / deep, Config())
    assert (summary.succeeded, summary.failed) == (0, 2)
    assert sorted(os.listdir(tmp_path)) == before


def test_results_of_the_same_run_are_written_over(capture, tmp_path):
    folder, out = capture(frames=3), tmp_path / "out"
    batch.run(open_capture(folder), out, Config())
    (folder / "depth" / "000002.png").unlink()
    (folder / "color" / "000002.jpg").unlink()
    bad(folder, "000001")
    batch.run(open_capture(folder), out, Config())
    assert sorted(os.listdir(out)) == ["000000.json", "000000.png", "config.yaml", "manifest.json"]


def test_earlier_results_stay_when_the_same_run_fails_now(capture, tmp_path):
    folder, out = capture(), tmp_path / "out"
    batch.run(open_capture(folder), out, Config())
    before = {file: (out / file).read_bytes() for file in os.listdir(out)}
    bad(folder, "000000")
    assert batch.run(open_capture(folder), out, Config()).failed == 1
    assert {file: (out / file).read_bytes() for file in os.listdir(out)} == before


def test_a_folder_with_something_else_is_refused(capture, tmp_path):
    folder, out = capture(), tmp_path / "out"
    out.mkdir()
    batch.run(open_capture(folder), out, Config())  # an empty folder is fine
    with pytest.raises(InputError, match=r"another configuration.*--force"):
        batch.run(open_capture(folder), out, load_config("default", {"merge.chains": 2}))
    with pytest.raises(InputError, match=r"another input.*--force"):
        batch.run(open_capture(capture("second")), out, Config())
    (out / "manifest.json").write_text("{")
    with pytest.raises(InputError, match=r"not a result of doo3d.*--force"):
        batch.run(open_capture(folder), out, Config())


def test_force_removes_the_other_results_and_nothing_else(capture, tmp_path):
    out = tmp_path / "out"
    batch.run(open_capture(capture(frames=3)), out, Config())
    (out / "mine.txt").write_text("keep")
    batch.run(open_capture(capture("second", frames=1)), out, Config(), force=True)
    assert sorted(os.listdir(out)) == ["000000.json", "000000.png", "config.yaml", "manifest.json", "mine.txt"]


def test_names_in_a_foreign_manifest_do_not_reach_outside(capture, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (tmp_path / "victim.json").write_text("keep")
    text = json.dumps({"schema": "doo3d/manifest/1", "input": {}, "frames": [{"name": "../victim"}, {"name": 3}, 7]})
    (out / "manifest.json").write_text(text)
    batch.run(open_capture(capture()), out, Config(), force=True)
    assert (tmp_path / "victim.json").read_text() == "keep"


def test_out_is_a_file(capture, tmp_path):
    (tmp_path / "out").write_text("x")
    for out in (tmp_path / "out", tmp_path / "out" / "deeper"):
        with pytest.raises(InputError, match="is a file"):
            batch.run(open_capture(capture(f"c{len(os.listdir(tmp_path))}")), out, Config())


@pytest.mark.parametrize("inside", [".", "depth", "color"])
def test_the_input_is_never_written_over(capture, inside):
    folder = capture()
    before = (folder / "depth" / "000000.png").read_bytes()
    with pytest.raises(InputError, match="belongs to the input"):
        batch.run(open_capture(folder), folder / inside, Config(), force=True)
    assert (folder / "depth" / "000000.png").read_bytes() == before
    for _ in range(2):  # a new folder inside is fine, again and again
        batch.run(open_capture(folder), folder / "results", Config())


def test_no_permission_is_said_before_the_work(capture, tmp_path, monkeypatch, found):
    monkeypatch.setattr(results.os, "access", lambda *args: False)
    found["do"] = None
    with pytest.raises(InputError, match="permission"):
        batch.run(open_capture(capture()), tmp_path / "out", Config())


@pytest.mark.parametrize("frames_before", [0, 1])
def test_a_full_disk_ends_the_run_and_leaves_no_half_frame(capture, tmp_path, monkeypatch, frames_before):
    real, calls = results.writer, []

    def fills(kind):
        def write(path, detection, data):
            calls.append(path)
            if len(calls) > 2 * frames_before + 1:
                raise OSError(28, "No space left on device")
            real(kind)(path, detection, data)

        return write

    monkeypatch.setattr(results, "writer", fills)
    out = tmp_path / "out"
    with pytest.raises(InputError, match=r"out.*No space left"):
        batch.run(open_capture(capture(frames=3)), out, Config())
    assert out.exists() == bool(frames_before)
    if frames_before:
        assert sorted(os.listdir(out)) == ["000000.json", "000000.png", "config.yaml", "manifest.json"]
        assert manifest(out)["finished"] is False


def test_frames_whose_files_would_be_the_runs_own(capture, tmp_path):
    folder = capture()
    for part, suffix in (("depth", "png"), ("color", "jpg")):
        (folder / part / f"000000.{suffix}").rename(folder / part / f"manifest.{suffix}")
    with pytest.raises(InputError, match="manifest"):
        batch.run(open_capture(folder), tmp_path / "out", Config())


def test_what_a_killed_run_left_is_swept(capture, tmp_path):
    folder, out = capture(), tmp_path / "out"
    batch.run(open_capture(folder), out, Config())
    (out / ".doo3d-1-ab.tmp").write_text("half")
    batch.run(open_capture(folder), out, Config())
    assert not (out / ".doo3d-1-ab.tmp").exists()


def test_the_same_bytes_times_aside(capture, tmp_path):
    folder = capture(frames=2)
    for name in ("a", "b"):
        batch.run(open_capture(folder), tmp_path / name, Config())
    for file in ("000000.json", "000000.png", "config.yaml"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()
    one, two = manifest(tmp_path / "a"), manifest(tmp_path / "b")
    for made in (one, two):
        for frame in made["frames"]:
            del frame["seconds"]
    assert one == two

"""A run: the files it writes, one frame that fails, and a run of which every frame fails."""

import json
import os
import tracemalloc
import weakref

import pytest
from builders.errors import refuses
from builders.runs import break_frame, files_of, read_manifest

from doo3d.config import Config, load_config
from doo3d.inputs import FrameRef, open_capture
from doo3d.outputs import run_folder as results
from doo3d.outputs.run_identity import digest
from doo3d.runs import frame_files, frame_jobs
from doo3d.runs import run as batch
from doo3d.runs.serial_executor import MAX_JOBS
from doo3d.types import Frame

pytestmark = pytest.mark.usefixtures("fake_detection")


def test_what_a_run_writes(capture, tmp_path):
    config = load_config("default", {"merge.chains": 2})
    out = tmp_path / "a" / "b"
    seen = []
    summary = batch.run(open_capture(capture(frames=2)), out, config, batch.RunOptions(report=seen.append))
    assert sorted(os.listdir(out)) == [
        "000000.jpg",
        "000000.json",
        "000001.jpg",
        "000001.json",
        "config.yaml",
        "manifest.json",
        "progress.jsonl",
    ]
    assert json.loads((out / "000001.json").read_text())["frame"] == "000001"
    assert load_config(out / "config.yaml") == config
    assert summary.counts() == {"frames": 2, "ok": 2, "failed": 0, "chains": 2}
    assert [record.name for record in seen] == ["000000", "000001"]
    assert seen[0].occluded == 0.5
    assert seen[0].notes == ("a note",)
    made = read_manifest(out)
    assert made["schema"] == "doo3d/manifest/1"
    assert made["finished"] is True
    assert made["config_digest"] == digest(config)
    assert made["versions"]["doo3d"]
    assert made["input"]["format"] == "folder"
    assert made["counts"] == summary.counts()
    assert made["figures"] == {"frames_by_chains": {"1": 2}, "length": 0.02, "radius": 0.005, "occluded": 0.5, "units": "m"}
    first = made["frames"][0]
    assert (first["name"], first["status"], first["chains"], first["error"], first["code"]) == ("000000", "ok", 1, None, None)
    assert first["lengths"] == [0.02]
    assert first["source"].endswith("000000.png")
    assert first["timestamp"] is None
    lines = [json.loads(line) for line in (out / "progress.jsonl").read_text(encoding="utf-8").splitlines()]
    assert [line["name"] for line in lines] == ["000000", "000001"]
    assert lines[0]["seconds"] > lines[0]["stages"]["draw"] > 0


def test_masks_reach_the_detection(capture, tmp_path, fake_detection):
    given = []
    inner = fake_detection["do"]
    fake_detection["do"] = lambda data, config, mask: (given.append((data, mask)), inner(data, config, mask))[1]
    batch.run(open_capture(capture(mask=True)), tmp_path / "out", Config())
    ((data, mask),) = given
    assert isinstance(data, Frame)
    assert mask.any()


@pytest.mark.parametrize(("method", "used"), [("auto", True), ("mask", True), ("plane", False), ("everything", False)])
def test_a_named_way_of_segmenting_goes_before_the_folders_masks(capture, tmp_path, fake_detection, method, used):
    given = []
    inner = fake_detection["do"]
    fake_detection["do"] = lambda data, config, mask: (given.append(mask), inner(data, config, mask))[1]
    batch.run(open_capture(capture(mask=True)), tmp_path / "out", load_config("default", {"segment.method": method}))
    assert (given[0] is not None) == used


def test_one_bad_frame_does_not_stop_the_others(capture, tmp_path):
    folder, out = capture(frames=3), tmp_path / "out"
    break_frame(folder, "000000")
    summary = batch.run(open_capture(folder), out, Config())
    assert (summary.succeeded, summary.failed) == (2, 1)
    first = read_manifest(out)["frames"][0]
    assert first["status"] == "failed"
    assert "000000.png" in first["error"]
    assert first["code"] == summary.records[0].code == "file-damaged"
    assert not (out / "000000.json").exists()


def test_what_nobody_foresaw_is_recorded_with_its_type_and_place(capture, tmp_path, fake_detection):
    out = tmp_path / "out"
    with fake_detection.failing(ZeroDivisionError("by zero"), "000001"):
        summary = batch.run(open_capture(capture(frames=3)), out, Config())
    assert summary.failed == 1
    assert "ZeroDivisionError at " in read_manifest(out)["frames"][1]["error"]
    assert "by zero" in read_manifest(out)["frames"][1]["error"]
    assert read_manifest(out)["frames"][1]["code"] == summary.records[1].code == "unexpected"


def test_a_picture_that_cannot_be_drawn_fails_its_frame_only(capture, tmp_path, monkeypatch):
    calls = []

    def draws(detection, data):
        calls.append(detection)
        if len(calls) == 2:
            raise ValueError("no ink")
        return b"ink"

    monkeypatch.setitem(frame_files.ENCODERS, "jpg", draws)
    out = tmp_path / "out"
    summary = batch.run(open_capture(capture(frames=3)), out, Config())
    assert [record.status for record in summary.records] == ["ok", "failed", "ok"]
    assert not (out / "000001.json").exists()
    assert "no ink" in read_manifest(out)["frames"][1]["error"]
    assert read_manifest(out)["frames"][1]["code"] == "unexpected"


@pytest.mark.parametrize("deep", ["out", "a/b/out"])
def test_nothing_is_left_when_all_frames_fail(capture, tmp_path, deep):
    folder = capture(frames=2)
    for name in ("000000", "000001"):
        break_frame(folder, name)
    before = sorted(os.listdir(tmp_path))
    summary = batch.run(open_capture(folder), tmp_path / deep, Config())
    assert (summary.succeeded, summary.failed) == (0, 2)
    assert sorted(os.listdir(tmp_path)) == before


def test_a_fresh_run_replaces_what_the_last_one_left(capture, tmp_path):
    folder, out = capture(frames=3), tmp_path / "out"
    batch.run(open_capture(folder), out, Config())
    (folder / "depth" / "000002.png").unlink()
    (folder / "color" / "000002.jpg").unlink()
    break_frame(folder, "000001")
    with refuses("input-changed", "restart=True"):
        batch.run(open_capture(folder), out, Config())
    batch.run(open_capture(folder), out, Config(), batch.RunOptions(restart=True))
    assert sorted(os.listdir(out)) == ["000000.jpg", "000000.json", "config.yaml", "manifest.json", "progress.jsonl"]


def test_earlier_results_stay_when_a_fresh_run_fails(capture, tmp_path):
    folder, out = capture(), tmp_path / "out"
    batch.run(open_capture(folder), out, Config())
    before = {file: (out / file).read_bytes() for file in os.listdir(out)}
    break_frame(folder, "000000")
    assert batch.run(open_capture(folder), out, Config(), batch.RunOptions(restart=True)).failed == 1
    assert {file: (out / file).read_bytes() for file in os.listdir(out)} == before


def test_a_folder_with_something_else_is_refused(capture, tmp_path):
    folder, out = capture(), tmp_path / "out"
    out.mkdir()
    batch.run(open_capture(folder), out, Config())  # an empty folder is fine
    with refuses("out-other-input", "force=True"):
        batch.run(open_capture(capture("second")), out, Config())
    (out / "manifest.json").write_text("{}")
    with refuses("out-foreign", "force=True"):
        batch.run(open_capture(folder), out, Config())


def test_force_removes_the_other_results_and_nothing_else(capture, tmp_path):
    out = tmp_path / "out"
    batch.run(open_capture(capture(frames=3)), out, Config())
    (out / "mine.txt").write_text("keep")
    batch.run(open_capture(capture("second", frames=1)), out, Config(), batch.RunOptions(force=True))
    assert sorted(os.listdir(out)) == ["000000.jpg", "000000.json", "config.yaml", "manifest.json", "mine.txt", "progress.jsonl"]


def test_names_in_a_foreign_manifest_do_not_reach_outside(capture, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (tmp_path / "victim.json").write_text("keep")
    text = json.dumps({"schema": "doo3d/manifest/1", "input": {}, "frames": [{"name": "../victim"}, {"name": 3}, 7]})
    (out / "manifest.json").write_text(text)
    batch.run(open_capture(capture()), out, Config(), batch.RunOptions(force=True))
    assert (tmp_path / "victim.json").read_text() == "keep"


def test_out_is_a_file(capture, tmp_path):
    (tmp_path / "out").write_text("x")
    for out in (tmp_path / "out", tmp_path / "out" / "deeper"):
        with refuses("out-is-file", str(tmp_path / "out")):
            batch.run(open_capture(capture(f"c{len(os.listdir(tmp_path))}")), out, Config())


@pytest.mark.parametrize("inside", [".", "depth", "color"])
def test_the_input_is_never_written_over(capture, inside):
    folder = capture()
    before = (folder / "depth" / "000000.png").read_bytes()
    with refuses("out-in-input"):
        batch.run(open_capture(folder), folder / inside, Config(), batch.RunOptions(force=True))
    assert (folder / "depth" / "000000.png").read_bytes() == before
    for _ in range(2):  # a new folder inside is fine, again and again
        batch.run(open_capture(folder), folder / "results", Config())


def test_no_permission_is_said_before_the_work(capture, tmp_path, monkeypatch, fake_detection):
    monkeypatch.setattr(os, "access", lambda *args: False)
    fake_detection["do"] = None
    with refuses("out-unwritable"):
        batch.run(open_capture(capture()), tmp_path / "out", Config())


@pytest.mark.parametrize("frames_before", [0, 1])
def test_a_full_disk_ends_the_run_and_the_next_one_goes_on(capture, tmp_path, monkeypatch, frames_before):
    real, calls = results.write_bytes, []

    def fills(path, content, flushed=True):
        calls.append(path)
        if len(calls) > 2 * frames_before + 1:
            raise OSError(28, "No space left on device")
        real(path, content)

    folder, out = capture(frames=3), tmp_path / "out"
    with monkeypatch.context() as full:
        full.setattr(results, "write_bytes", fills)
        with refuses("out-unwritable", "out", "No space left"):
            batch.run(open_capture(folder), out, Config())
    assert out.exists() == bool(frames_before)
    if frames_before:
        assert sorted(os.listdir(out)) == ["000000.jpg", "000000.json", "config.yaml", "manifest.json", "progress.jsonl"]
        assert read_manifest(out)["finished"] is False
    seen = []
    assert batch.run(open_capture(folder), out, Config(), batch.RunOptions(report=seen.append)).succeeded == 3
    assert len(seen) == 3 - frames_before


def test_frames_whose_files_would_be_the_runs_own(capture, tmp_path):
    folder = capture()
    for part, suffix in (("depth", "png"), ("color", "jpg")):
        (folder / part / f"000000.{suffix}").rename(folder / part / f"manifest.{suffix}")
    with refuses("frame-name-invalid", "manifest"):
        batch.run(open_capture(folder), tmp_path / "out", Config())


def test_what_a_killed_run_left_is_swept(capture, tmp_path):
    folder, out = capture(frames=2), tmp_path / "out"
    batch.run(open_capture(folder), out, Config())
    (out / ".doo3d-1-ab.tmp").write_text("half")
    (out / "000001.json").unlink()
    batch.run(open_capture(folder), out, Config())
    assert not (out / ".doo3d-1-ab.tmp").exists()


def test_the_same_bytes_but_for_the_journal(capture, tmp_path):
    folder = capture(frames=2)
    for name in ("a", "b"):
        batch.run(open_capture(folder), tmp_path / name, Config())
    assert files_of(tmp_path / "a") == files_of(tmp_path / "b")


@pytest.mark.slow
def test_what_is_held_does_not_grow_with_the_capture(capture, tmp_path, monkeypatch):
    """Frames, detections and files are let go of; what stays of a frame is its record."""
    monkeypatch.setattr(frame_jobs, "encode_frame", lambda *args: {".json": b"{}" * 50_000, ".jpg": b"x" * 100_000})
    folder = open_capture(capture())
    loaded, first = [], folder.frames[0]

    def load():
        shot = first.load()
        loaded.append(weakref.ref(shot.data))
        return shot

    most = []
    folder.frames = [FrameRef(f"{i:04d}", folder.path, load) for i in range(60)]
    tracemalloc.start()
    after = []

    def report(record):
        most.append(sum(each() is not None for each in loaded))
        assert record.error is None
        after.append(tracemalloc.get_traced_memory()[0])

    batch.run(folder, tmp_path / "out", Config(), batch.RunOptions(report=report))
    tracemalloc.stop()
    assert 1 <= max(most) <= MAX_JOBS + 1
    assert (min(after[40:]) - min(after[10:30])) / 30 < 4000  # least, since files in flight come and go

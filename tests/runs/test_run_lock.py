"""Two runs never write into one folder at once; the lock of a killed one is taken over."""

import json
import os
import socket
import sys
import time

import pytest
from builders.errors import refuses
from builders.runs import files_of, finished_frames, started, wait_for

from doo3d.config import Config
from doo3d.inputs import open_capture
from doo3d.outputs.run_lock import LOCK, MAX_SILENCE_SECONDS, LockHolder, RunLock
from doo3d.runs import run as batch

posix_only = pytest.mark.skipif(sys.platform == "win32", reason="signals")


def left_behind(out, **changed):
    """Write the lock file of a process that was killed."""
    out.mkdir(exist_ok=True)
    (out / LOCK).write_text(json.dumps(vars(LockHolder.this()) | {"process": 4194305} | changed))


def test_a_folder_that_another_run_writes_to_is_refused(capture, tmp_path, fake_detection):
    folder, out = open_capture(capture()), tmp_path / "out"
    lock = RunLock(out)
    for options in ({}, {"restart": True}, {"force": True}):
        with refuses("out-in-use", f"process {os.getpid()} on {socket.gethostname()}"):
            batch.run(folder, out, Config(), batch.RunOptions(**options))
    assert os.listdir(out) == [LOCK]
    lock.release()
    assert batch.run(folder, out, Config()).succeeded == 1
    assert LOCK not in os.listdir(out)


def test_a_lock_left_behind_is_taken_over_with_a_note(capture, tmp_path, fake_detection):
    folder, out, notes = open_capture(capture()), tmp_path / "out", []
    left_behind(out)
    assert batch.run(folder, out, Config(), batch.RunOptions(note=notes.append)).succeeded == 1
    assert len(notes) == 1
    assert f"process 4194305 on {socket.gethostname()}" in notes[0]
    assert LOCK not in os.listdir(out)


@pytest.mark.parametrize("content", [b"", b"{", b"[1]", b'{"process": "a"}', b"\xff" * 9000, b"[" * 4000])
def test_an_unreadable_lock_is_taken_over(capture, tmp_path, fake_detection, content):
    folder, out = open_capture(capture()), tmp_path / "out"
    out.mkdir()
    (out / LOCK).write_bytes(content)
    assert batch.run(folder, out, Config()).succeeded == 1


def test_a_run_of_another_computer_is_taken_for_dead_when_it_is_silent(capture, tmp_path, fake_detection):
    """Where the file system keeps the locks of one computer only."""
    folder, out = open_capture(capture()), tmp_path / "out"
    left_behind(out, host="elsewhere")
    with refuses("out-in-use", "elsewhere", LOCK):
        batch.run(folder, out, Config())
    then = time.time() - MAX_SILENCE_SECONDS - 1
    os.utime(out / LOCK, (then, then))
    assert batch.run(folder, out, Config()).succeeded == 1


def test_the_lock_of_a_long_run_shows_that_it_is_alive(tmp_path, monkeypatch):
    lock = RunLock(tmp_path)
    os.utime(tmp_path / LOCK, (0, 0))
    lock.touch()
    assert (tmp_path / LOCK).stat().st_mtime == 0  # not after each frame
    now = time.monotonic()
    monkeypatch.setattr(time, "monotonic", lambda: now + 60)
    lock.touch()
    assert (tmp_path / LOCK).stat().st_mtime > 0
    lock.release()
    lock.release()


@posix_only
def test_a_link_in_place_of_the_lock_is_not_written_through(capture, tmp_path, fake_detection):
    folder, out = open_capture(capture()), tmp_path / "out"
    out.mkdir()
    (tmp_path / "victim").write_text("keep")
    (out / LOCK).symlink_to(tmp_path / "victim")
    with refuses("out-unwritable"):
        batch.run(folder, out, Config())
    assert (tmp_path / "victim").read_text() == "keep"


def test_a_folder_made_for_a_refused_run_is_removed(capture, tmp_path, fake_detection):
    fake_detection["do"] = None  # every frame fails
    assert batch.run(open_capture(capture()), tmp_path / "a" / "b", Config()).failed == 1
    assert not (tmp_path / "a").exists()


@pytest.mark.slow
@posix_only
def test_of_runs_started_at_once_one_goes_through(frames, expected, tmp_path):
    out = tmp_path / "out"
    for _ in range(2):
        processes = [started("doo3d", "detect", frames, "-o", out) for _ in range(3)]
        outputs = [process.communicate()[0] for process in processes]
        codes = [process.returncode for process in processes]
        assert all(code == 1 or (code == 2 and "[out-in-use]" in text) for code, text in zip(codes, outputs, strict=True)), (
            outputs
        )
        assert 1 in codes
        assert files_of(out) == expected
        assert finished_frames(out) == 8


@pytest.mark.slow
@posix_only
def test_after_a_kill_the_next_run_says_that_it_takes_over(frames, expected, tmp_path):
    command = ("doo3d", "detect", frames, "-o", tmp_path / "out")
    process = started(*command)
    wait_for(lambda: finished_frames(tmp_path / "out") >= 1)
    process.kill()
    process.communicate()
    again = started(*command)
    output, _ = again.communicate()
    assert f"note: a run of process {process.pid} on {socket.gethostname()}" in output
    assert files_of(tmp_path / "out") == expected

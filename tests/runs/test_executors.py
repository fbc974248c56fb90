"""Runs by many processes: the same bytes as by one, whoever is killed meanwhile."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from builders.errors import refuses
from builders.paths import SAMPLES

from doo3d.config import Config
from doo3d.errors import MissingDependency
from doo3d.inputs import ReadOptions, open_capture
from doo3d.runs import local_executor as executor
from doo3d.runs import run as batch
from doo3d.runs.dask_executor import local
from doo3d.runs.frame import detect_frame, render_frame
from doo3d.runs.frame_files import encode_frame

pytest.importorskip("distributed")
FRAMES = 8
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    """A capture of several frames: the sample's three, again and again."""
    folder, sample = tmp_path_factory.mktemp("runs") / "capture", SAMPLES / "crossing"
    for part, suffix in (("color", "jpg"), ("depth", "png")):
        (folder / part).mkdir(parents=True)
        for i in range(FRAMES):
            shutil.copy(sample / part / f"{i % 3:06d}.{suffix}", folder / part / f"{i:06d}.{suffix}")
    shutil.copy(sample / "camera_intrinsic.json", folder)
    (folder / "depth" / "000004.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    return folder


@pytest.fixture(scope="module")
def wanted(frames, tmp_path_factory):
    """What one process makes of it."""
    out = tmp_path_factory.mktemp("wanted") / "out"
    batch.run(open_capture(frames), out, Config(), reading=ReadOptions())
    return contents(out)


def contents(out: Path) -> dict[str, bytes]:
    """Every file but the journal, which holds the times."""
    return {file: (out / file).read_bytes() for file in os.listdir(out) if file != "progress.jsonl"}


def started(*command: object, **options) -> subprocess.Popen:
    script = Path(sys.executable).parent
    env = os.environ | {"PATH": os.pathsep.join([str(script), os.environ["PATH"]])}
    return subprocess.Popen(
        list(map(str, command)), env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options
    )


def finished_frames(out: Path) -> int:
    journal = out / "progress.jsonl"
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


def wait_for(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_workers_make_the_same_bytes(frames, wanted, tmp_path):
    seen = []
    summary = batch.run(open_capture(frames), tmp_path / "out", Config(), workers=2, report=seen.append)
    assert contents(tmp_path / "out") == wanted
    assert (summary.succeeded, summary.failed) == (FRAMES - 1, 1)
    assert [record.name for record in seen] == [f"{i:06d}" for i in range(FRAMES)]


@pytest.mark.parametrize(("workers", "frames_done"), [(0, 1), (0, 5), (2, 0), (2, 3)])
def test_killed_and_started_again(frames, wanted, tmp_path, workers, frames_done):
    command = ("doo3d", "detect", frames, "-o", tmp_path / "out", "--workers", workers)
    process = started(*command)
    wait_for(lambda: finished_frames(tmp_path / "out") >= frames_done)
    process.kill()
    process.communicate()
    assert frames_done <= finished_frames(tmp_path / "out") < FRAMES
    again = started(*command)
    said, _ = again.communicate()
    assert again.returncode == 1, said
    assert contents(tmp_path / "out") == wanted
    assert finished_frames(tmp_path / "out") == FRAMES


def test_a_frame_that_kills_its_worker_fails_and_the_run_goes_on(frames, wanted, tmp_path):
    capture = open_capture(frames)
    deadly = capture.frames[2]
    # as a loader would be that crashes in a library: what is pickled is the name of a function and its argument
    object.__setattr__(deadly, "loader", Deadly("import os; os._exit(1)"))
    summary = batch.run(capture, tmp_path / "out", Config(), reading=ReadOptions(), workers=2)
    assert [record.name for record in summary.records if record.error] == ["000002", "000004"]
    assert [record.code for record in summary.records if record.error] == ["worker-lost", "file-damaged"]
    made = contents(tmp_path / "out")
    assert wanted.keys() - made.keys() == {"000002.json", "000002.png"}
    # the ids of chains go on from frame to frame, and the cable is found in all: one frame less changes none of the others
    assert all(made[file] == wanted[file] for file in made if file != "manifest.json")
    failed = json.loads(made["manifest.json"])["frames"][2]
    assert (failed["status"], failed["code"]) == ("failed", "worker-lost")
    assert "tcp://" not in failed["error"]


class Deadly:
    """Ends the process that calls it."""

    def __init__(self, code: str) -> None:
        self.code = code

    def __reduce__(self):
        return eval, (f"lambda: exec({self.code!r})",)


@pytest.fixture
def scheduler(tmp_path):
    """A scheduler and two workers, each a process of its own: its address, and the processes."""
    python = (sys.executable, "-m", "distributed.cli.dask_scheduler")
    file = tmp_path / "scheduler.json"
    options = ("--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0")
    processes = [started(*python, *options, "--scheduler-file", file, start_new_session=True, cwd=tmp_path)]
    wait_for(file.exists)
    address = json.loads(file.read_text())["address"]
    worker = (sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
    processes += [started(*worker, start_new_session=True, cwd=tmp_path) for _ in range(2)]
    yield address, processes
    for process in reversed(processes):
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def test_a_scheduler_whose_worker_is_killed_midway(frames, wanted, tmp_path, scheduler):
    address, processes = scheduler
    killed = []

    def kill_one(record):
        if not killed:
            killed.append(record.name)
            os.killpg(processes[1].pid, signal.SIGKILL)

    batch.run(open_capture(frames), tmp_path / "out", Config(), scheduler=address, report=kill_one)
    assert killed
    assert contents(tmp_path / "out") == wanted


def test_nobody_answers(frames, refused):
    refused(frames, "--scheduler", "tcp://127.0.0.1:1", code="scheduler-unreachable")
    refused(frames, "--scheduler", "tcp://127.0.0.1:1", "--workers", "2", code="options-conflict")


def test_the_package_that_is_missing_is_named(monkeypatch, frames, tmp_path):
    monkeypatch.setitem(sys.modules, "dask.distributed", None)
    with refuses("missing-package", "doo3d[cluster]", kind=MissingDependency):
        batch.run(open_capture(frames), tmp_path / "out", Config(), workers=2)
    assert not (tmp_path / "out").exists()


def test_a_full_disk_under_workers(frames, tmp_path, monkeypatch):
    from doo3d.outputs import run_folder as results

    def full(path, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(results, "write_bytes", full)
    with refuses("out-unwritable", "No space left"):
        batch.run(open_capture(frames), tmp_path / "out", Config(), workers=1)
    assert not (tmp_path / "out").exists()


def test_workers_have_one_thread_each():
    with local(1) as team:
        job = team.submit(threads)
        assert job.result() == (1, 1, 1)


def threads():
    import cv2
    import numba

    return cv2.getNumThreads(), numba.get_num_threads(), int(os.environ["OPENBLAS_NUM_THREADS"])


def test_what_no_longer_waits_for_its_picture_is_read_again(frames):
    entry = open_capture(frames).frames[0]
    found = detect_frame(entry, Config())
    first, files = render_frame(entry, found)
    again, the_same = render_frame(entry, found)
    assert files == the_same == encode_frame(found.detection, entry.load().data)
    assert first.lengths == again.lengths


def test_one_process_needs_no_dask(frames):
    code = f"""
import sys
from doo3d import batch
from doo3d.config import Config
from doo3d.inputs import open_capture
capture = open_capture({str(frames)!r})
capture.frames = capture.frames[:1]
batch.run(capture, 'out', Config())
assert not {{'dask', 'distributed'}} & set(sys.modules)
"""
    done = started(sys.executable, "-c", code, cwd=frames.parent)
    said, _ = done.communicate()
    assert done.returncode == 0, said
    with executor.executor() as team:
        assert (team.workers, team.window) == (1, 1)

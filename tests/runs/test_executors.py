"""Runs by worker processes give the same bytes as runs by one process, even if workers are killed."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import pytest
from builders.errors import refuses
from builders.paths import SAMPLES
from builders.runs import files_of

from doo3d.config import Config
from doo3d.errors import MissingDependency
from doo3d.inputs import ReadOptions, open_capture
from doo3d.runs import run as batch
from doo3d.runs.dask_executor import local_workers
from doo3d.runs.frame_cache import FrameCache
from doo3d.runs.frame_files import encode_frame
from doo3d.runs.frame_jobs import detect_frame, render_frame
from doo3d.runs.select_executor import select_executor

pytest.importorskip("distributed")
FRAMES = 8
pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="signals")]


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
def expected(frames, tmp_path_factory):
    """The files of a run by one process."""
    out = tmp_path_factory.mktemp("expected") / "out"
    batch.run(open_capture(frames), out, Config(), options=ReadOptions())
    return files_of(out)


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


@pytest.mark.cluster
def test_workers_make_the_same_bytes(frames, expected, tmp_path):
    reported = []
    summary = batch.run(open_capture(frames), tmp_path / "out", Config(), workers=2, report=reported.append)
    assert files_of(tmp_path / "out") == expected
    assert (summary.succeeded, summary.failed) == (FRAMES - 1, 1)
    assert [record.name for record in reported] == [f"{i:06d}" for i in range(FRAMES)]


@pytest.mark.cluster
@pytest.mark.parametrize(("workers", "frames_done"), [(0, 1), (0, 5), (2, 0), (2, 3)])
def test_killed_and_started_again(frames, expected, tmp_path, workers, frames_done):
    command = ("doo3d", "detect", frames, "-o", tmp_path / "out", "--workers", workers)
    process = started(*command)
    wait_for(lambda: finished_frames(tmp_path / "out") >= frames_done)
    process.kill()
    process.communicate()
    assert frames_done <= finished_frames(tmp_path / "out") < FRAMES
    again = started(*command)
    output, _ = again.communicate()
    assert again.returncode == 1, output
    assert files_of(tmp_path / "out") == expected
    assert finished_frames(tmp_path / "out") == FRAMES


@pytest.mark.cluster
def test_a_frame_that_kills_its_worker_fails_and_the_run_goes_on(frames, expected, tmp_path):
    capture = open_capture(frames)
    deadly = capture.frames[2]
    # as a loader would be that crashes in a library: what is pickled is the name of a function and its argument
    object.__setattr__(deadly, "loader", Deadly("import os; os._exit(1)"))
    summary = batch.run(capture, tmp_path / "out", Config(), options=ReadOptions(), workers=2)
    assert [record.name for record in summary.records if record.error] == ["000002", "000004"]
    assert [record.code for record in summary.records if record.error] == ["worker-lost", "file-damaged"]
    made = files_of(tmp_path / "out")
    assert expected.keys() - made.keys() == {"000002.json", "000002.png"}
    # the ids of chains go on from frame to frame, and the cable is found in all: one frame less changes none of the others
    assert all(made[file] == expected[file] for file in made if file != "manifest.json")
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


@pytest.mark.cluster
def test_a_scheduler_whose_worker_is_killed_midway(frames, expected, tmp_path, scheduler):
    address, processes = scheduler
    killed = []

    def kill_one(record):
        if not killed:
            killed.append(record.name)
            os.killpg(processes[1].pid, signal.SIGKILL)

    batch.run(open_capture(frames), tmp_path / "out", Config(), scheduler=address, report=kill_one)
    assert killed
    assert files_of(tmp_path / "out") == expected


@pytest.mark.cluster
def test_nobody_answers(frames, refused):
    refused(frames, "--scheduler", "tcp://127.0.0.1:1", code="scheduler-unreachable")
    refused(frames, "--scheduler", "tcp://127.0.0.1:1", "--workers", "2", code="options-conflict")


def test_the_package_that_is_missing_is_named(monkeypatch, frames, tmp_path):
    monkeypatch.setitem(sys.modules, "dask.distributed", None)
    with refuses("missing-package", "doo3d[cluster]", kind=MissingDependency):
        batch.run(open_capture(frames), tmp_path / "out", Config(), workers=2)
    assert not (tmp_path / "out").exists()


@pytest.mark.cluster
def test_a_full_disk_under_workers(frames, tmp_path, monkeypatch):
    from doo3d.outputs import run_folder as results

    def full(path, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(results, "write_bytes", full)
    with refuses("out-unwritable", "No space left"):
        batch.run(open_capture(frames), tmp_path / "out", Config(), workers=1)
    assert not (tmp_path / "out").exists()


@pytest.mark.cluster
def test_workers_have_one_thread_each():
    with local_workers(1) as executor:
        assert executor.submit(threads).result() == (1, 1)


def threads(cache):
    import cv2

    return cv2.getNumThreads(), int(os.environ["OPENBLAS_NUM_THREADS"])


@pytest.mark.cluster
def test_port_8787_may_be_taken(frames, expected, tmp_path):
    """It is the default of dask's dashboard, which a run does not serve; a warning would be an error here."""
    with socket.create_server(("127.0.0.1", 8787)) if not is_taken(8787) else nullcontext():
        batch.run(open_capture(frames), tmp_path / "out", Config(), workers=2)
    assert files_of(tmp_path / "out") == expected


def is_taken(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def test_the_cache_holds_the_latest_frames_and_no_more():
    cache = FrameCache(max_frames=3)
    data = [object() for _ in range(5)]
    keys = [cache.add(item) for item in data]
    assert len(set(keys)) == 5
    assert len(cache) == 3
    assert [cache.take(key) for key in keys] == [None, None, *data[2:]]
    assert len(cache) == 0
    assert cache.take(keys[-1]) is None


def test_a_frame_that_the_cache_no_longer_holds_is_read_again(frames):
    frame, cache = open_capture(frames).frames[0], FrameCache()
    detected = detect_frame(cache, frame, Config())
    assert len(cache) == 1
    first, files = render_frame(cache, frame, detected)
    assert len(cache) == 0
    again, same = render_frame(cache, frame, detected)
    assert files == same == encode_frame(detected.detection, frame.load().data)
    assert first.lengths == again.lengths


def test_every_frame_of_a_run_is_read_once(frames, tmp_path):
    """By the job that detects; the job that renders takes it from the cache."""
    capture, loads = open_capture(frames), []
    capture.frames = [
        replace(frame, loader=lambda frame=frame: (loads.append(frame.name), frame.load())[1]) for frame in capture.frames[:3]
    ]
    batch.run(capture, tmp_path / "out", Config())
    assert loads == ["000000", "000001", "000002"]


@pytest.mark.cluster
def test_the_cache_of_a_worker_stays_with_it_from_job_to_job(frames):
    frame = open_capture(frames).frames[0]
    with local_workers(2) as executor:
        detect = executor.submit(detect_frame, frame, Config())
        detected = detect.result()
        assert executor.submit(count_cached, affinity=detect).result() == 1
        render = executor.submit(render_frame, frame, detected, affinity=detect)
        assert render.result()[1] == encode_frame(detected.detection, frame.load().data)
        assert render.worker == detect.worker
        assert executor.submit(count_cached, affinity=detect).result() == 0


def count_cached(cache):
    return len(cache)


def test_one_process_needs_no_dask(frames):
    code = f"""
import sys
from doo3d.runs.run import run
from doo3d.config import Config
from doo3d.inputs import open_capture
capture = open_capture({str(frames)!r})
capture.frames = capture.frames[:1]
run(capture, 'out', Config())
assert not {{'dask', 'distributed'}} & set(sys.modules)
"""
    done = started(sys.executable, "-c", code, cwd=frames.parent)
    output, _ = done.communicate()
    assert done.returncode == 0, output
    with select_executor() as executor:
        assert (executor.workers, executor.max_pending) == (1, 1)

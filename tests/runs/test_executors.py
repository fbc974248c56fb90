"""Runs by worker processes of this machine give the same bytes as runs by one process, even if workers are killed."""

import errno
import json
import os
import pickle
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.errors import refuses
from builders.runs import files_of, finished_frames, started, wait_for

from doo3d.config import Config
from doo3d.inputs import ReadOptions, open_capture
from doo3d.runs import run as batch
from doo3d.runs.executor import WorkerLost
from doo3d.runs.frame_cache import FrameCache
from doo3d.runs.frame_files import encode_frame
from doo3d.runs.frame_jobs import detect_frame, render_frame
from doo3d.runs.local_executor import LocalExecutor, local_workers
from doo3d.runs.process_frames import JobSize
from doo3d.runs.select_executor import select_executor
from doo3d.types import Cloud

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="signals")]


@pytest.mark.parametrize("frames_per_job", [None, 1, 3, 8])
def test_workers_make_the_same_bytes(frames, expected, tmp_path, monkeypatch, frames_per_job):
    if frames_per_job is not None:
        monkeypatch.setattr(JobSize, "frames", lambda self, remaining: frames_per_job)
    reported = []
    summary = batch.run(open_capture(frames), tmp_path / "out", Config(), batch.RunOptions(workers=2, report=reported.append))
    assert files_of(tmp_path / "out") == expected
    assert (summary.succeeded, summary.failed) == (7, 1)
    assert [record.name for record in reported] == [f"{i:06d}" for i in range(8)]


@pytest.mark.parametrize(("workers", "frames_done"), [(0, 1), (0, 5), (2, 0), (2, 3)])
def test_killed_and_started_again(frames, expected, tmp_path, workers, frames_done):
    command = ("doo3d", "detect", frames, "-o", tmp_path / "out", "--workers", workers)
    process = started(*command)
    wait_for(lambda: finished_frames(tmp_path / "out") >= frames_done)
    process.kill()
    process.communicate()
    assert frames_done <= finished_frames(tmp_path / "out") < 8
    again = started(*command)
    output, _ = again.communicate()
    assert again.returncode == 1, output
    assert files_of(tmp_path / "out") == expected
    assert finished_frames(tmp_path / "out") == 8


def test_a_frame_that_kills_its_worker_fails_and_the_others_of_its_job_do_not(frames, expected, tmp_path, in_groups):
    capture = open_capture(frames)
    deadly = capture.frames[2]
    # as a loader would be that crashes in a library: what is pickled is the name of a function and its argument
    object.__setattr__(deadly, "loader", Deadly("import os; os._exit(1)"))
    summary = batch.run(capture, tmp_path / "out", Config(), batch.RunOptions(reading=ReadOptions(), workers=2))
    assert [record.name for record in summary.records if record.error] == ["000002", "000004"]
    assert [record.code for record in summary.records if record.error] == ["worker-lost", "file-damaged"]
    made = files_of(tmp_path / "out")
    assert expected.keys() - made.keys() == {"000002.json", "000002.jpg"}
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


def test_a_full_disk_under_workers(frames, tmp_path, monkeypatch):
    from doo3d.outputs import run_folder as results

    def full(path, content, flushed=True):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(results, "write_bytes", full)
    with refuses("out-unwritable", "No space left"):
        batch.run(open_capture(frames), tmp_path / "out", Config(), batch.RunOptions(workers=1))
    assert not (tmp_path / "out").exists()


def test_workers_have_one_thread_each(monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "7")
    with local_workers(1) as executor:
        assert executor.submit(threads, [()]).result() == [(1, 1)]
    assert os.environ["OPENBLAS_NUM_THREADS"] == "7"


def threads(cache):
    import cv2

    return cv2.getNumThreads(), int(os.environ["OPENBLAS_NUM_THREADS"])


def no_process(self):
    raise OSError(errno.EMFILE, "Too many open files")


def test_a_worker_that_cannot_be_replaced_ends_all_jobs_with_an_error(monkeypatch):
    with local_workers(1) as executor:
        assert executor.submit(doubled, [(1, None)]).result() == [2]
        monkeypatch.setattr(LocalExecutor, "_spawn", no_process)
        jobs = [executor.submit(doubled, [(2, "always")]), executor.submit(doubled, [(3, None)])]
        for job in jobs:
            with refuses("workers-missing", "no worker process can be started", "Too many open files", "to resume"):
                job.result()
        with refuses("workers-missing", "no worker process can be started"):
            executor.submit(doubled, [(4, None)]).result()


def test_workers_that_cannot_be_started_are_an_error(monkeypatch):
    monkeypatch.setattr(LocalExecutor, "_spawn", no_process)
    with refuses("workers-missing", "Too many open files"), local_workers(2):
        pass


def test_the_calls_of_a_job_whose_worker_died_are_repeated_one_by_one(tmp_path):
    """One dies always, one the first time only: of the others of their job none is lost, nor any job beside it."""
    once = tmp_path / "once"
    with local_workers(2) as executor:
        jobs = [
            executor.submit(doubled, [(1, None), (2, None)]),
            executor.submit(doubled, [(3, None), (4, "always"), (5, once), (6, None)]),
            executor.submit(doubled, [(7, None)]),
            executor.submit(doubled, [(8, "always")]),
        ]
        first, second, third, fourth = (job.result() for job in jobs)
        assert (first, third) == ([2, 4], [14])
        assert (second[0], second[2:]) == (6, [10, 12])
        for lost in (second[1], *fourth):
            assert isinstance(lost, WorkerLost)
            assert lost.code == "worker-lost"
        assert once.exists()
        assert executor.submit(doubled, [(9, None)]).result() == [18]


def doubled(cache, value, deadly):
    if deadly == "always" or (deadly is not None and not deadly.exists()):
        if deadly != "always":
            deadly.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return 2 * value


def test_an_exception_of_a_job_is_raised_for_that_job_alone():
    with local_workers(1) as executor:
        bad, good, unsendable = (executor.submit(function, [()]) for function in (fails, pid, threads_lock))
        assert good.result() != [os.getpid()]
        assert good.done()
        with pytest.raises(ZeroDivisionError):
            bad.result()
        with pytest.raises(TypeError, match="pickle"):
            unsendable.result()
        with pytest.raises((AttributeError, pickle.PicklingError)):
            executor.submit(lambda cache: 1, [()])
        assert executor.submit(pid, [()]).result() != [os.getpid()]


def fails(cache):
    raise ZeroDivisionError


def pid(cache):
    return os.getpid()


def threads_lock(cache):
    import threading

    return threading.Lock()


def test_a_job_goes_to_the_worker_it_prefers_unless_another_would_be_idle():
    with local_workers(2) as executor:
        jobs = [executor.submit(slept, [(0.5,)]) for _ in range(2)]
        here, there = (job.result()[0] for job in jobs)
        assert here != there
        again = [executor.submit(slept, [(0.0,)], jobs[0]) for _ in range(2)]
        assert {job.result()[0] for job in again} <= {here, there}
        busy, stolen = (executor.submit(slept, [(seconds,)], jobs[0]) for seconds in (1.0, 0.0))
        assert stolen.result() != busy.result()


def slept(cache, seconds):
    time.sleep(seconds)
    return os.getpid()


def children(pid: int) -> list[int]:
    return [int(child) for task in Path(f"/proc/{pid}/task").iterdir() for child in (task / "children").read_text().split()]


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="/proc")
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_workers_end_with_the_process_that_started_them(frames, expected, tmp_path, how):
    """Ctrl-C goes to all of them, as from a terminal; the others to the process of the run alone. No worker complains."""
    command = ("doo3d", "detect", frames, "-o", tmp_path / "out", "--workers", 2)
    process = started(*command, start_new_session=True)
    wait_for(lambda: finished_frames(tmp_path / "out") >= 1)
    workers = children(process.pid)
    assert len(workers) >= 2
    (os.killpg if how == signal.SIGINT else os.kill)(process.pid, how)
    output, _ = process.communicate(timeout=60)
    assert "Traceback" not in output
    assert "leaked" not in output
    wait_for(lambda: not any(map(is_running, workers)), seconds=5)
    again = started(*command)
    assert again.communicate()
    assert files_of(tmp_path / "out") == expected


def test_the_cache_holds_the_latest_frames_and_no_more():
    cache = FrameCache(max_bytes=25_000)
    data = [Cloud(np.full((250, 3), i + 1.0)) for i in range(5)]
    assert all(item.points.nbytes == 6000 for item in data)
    keys = [cache.add(item) for item in data]
    assert len(set(keys)) == 5
    assert len(cache) == 4
    assert [cache.take(key) for key in keys] == [None, *data[1:]]
    assert len(cache) == 0
    assert cache.take(keys[-1]) is None
    keys = [cache.add(item) for item in data[:4]]
    assert len(cache) == 4
    huge = cache.add(Cloud(np.ones((5000, 3))))
    assert len(cache) == 1
    assert cache.take(huge) is not None


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


def test_the_cache_of_a_worker_stays_with_it_from_job_to_job(frames):
    chosen = open_capture(frames).frames[:2]
    with local_workers(1) as executor:
        detect = executor.submit(detect_frame, [(frame, Config()) for frame in chosen])
        detected = detect.result()
        assert executor.submit(count_cached, [()], detect).result() == [2]
        render = executor.submit(render_frame, list(zip(chosen, detected, strict=True)), detect)
        for (_, files), frame, found in zip(render.result(), chosen, detected, strict=True):
            assert files == encode_frame(found.detection, frame.load().data)
        assert render.worker is detect.worker
        assert executor.submit(count_cached, [()], detect).result() == [0]


def count_cached(cache):
    return len(cache)


def test_scripts_may_start_workers_at_their_top_level(frames, tmp_path):
    """Whether they are files or come from standard input."""
    code = f"""
from doo3d.runs.run import RunOptions, run
from doo3d.config import Config
from doo3d.inputs import open_capture
capture = open_capture({str(frames)!r})
capture.frames = capture.frames[:2]
assert run(capture, 'out', Config(), RunOptions(workers=2, restart=True)).succeeded == 2
"""
    (tmp_path / "script.py").write_text(code)
    for arguments in (["script.py"], ["-"]):
        done = subprocess.run([sys.executable, *arguments], input=code, cwd=tmp_path, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")


def test_a_function_that_workers_cannot_import_is_named(monkeypatch):
    monkeypatch.setattr(pid, "__module__", "__main__")
    monkeypatch.setattr(sys.modules["__main__"], "pid", pid, raising=False)
    with local_workers(1) as executor:
        with pytest.raises(AttributeError, match="pid"):
            executor.submit(pid, [()]).result()
        assert executor.submit(slept, [(0,)]).result() != [os.getpid()]


@pytest.mark.parametrize("workers", [0, 2])
def test_only_a_scheduler_needs_dask(frames, workers):
    code = f"""
import sys
from doo3d.runs.run import RunOptions, run
from doo3d.config import Config
from doo3d.inputs import open_capture
capture = open_capture({str(frames)!r})
capture.frames = capture.frames[:1]
run(capture, 'out{workers}', Config(), RunOptions(workers={workers}))
assert not {{'dask', 'distributed'}} & set(sys.modules)
"""
    done = started(sys.executable, "-c", code, cwd=frames.parent)
    output, _ = done.communicate()
    assert done.returncode == 0, output
    with select_executor() as executor:
        assert (executor.workers, executor.max_frames_per_job) == (1, 1)

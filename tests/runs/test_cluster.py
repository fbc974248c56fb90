"""Runs by the workers of a dask scheduler give the same bytes as runs by one process, even if workers are killed."""

import json
import os
import signal
import sys

import pytest
from builders.errors import refuses
from builders.runs import files_of, finished_frames, started, wait_for

from doo3d.config import Config
from doo3d.errors import MissingDependency
from doo3d.inputs import open_capture
from doo3d.runs import run as batch

pytest.importorskip("distributed")
pytestmark = [pytest.mark.slow, pytest.mark.cluster, pytest.mark.skipif(sys.platform == "win32", reason="signals")]


@pytest.fixture
def schedulers():
    """The scheduler of `cluster`, as the only item of a list."""
    return []


@pytest.fixture
def cluster(tmp_path, schedulers):
    """A scheduler and two workers, started from the shell: its address, the workers' processes, and the folder of each.

    The workers share nothing but the network and the capture: each has a working directory, a home, a cache and a folder for
    temporary files of its own.
    """
    options = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard")
    file = tmp_path / "scheduler.json"
    scheduler = (sys.executable, "-m", "distributed.cli.dask_scheduler", *options, "--scheduler-file", file)
    processes = [started(*scheduler, start_new_session=True, cwd=tmp_path)]
    schedulers.append(processes[0])
    wait_for(lambda: file.exists() and file.read_text().endswith("}"))  # made first, then written into
    address = json.loads(file.read_text())["address"]
    folders = [tmp_path / f"machine{i}" for i in range(2)]
    for folder in folders:
        own = {
            "TMPDIR": folder / "tmp",
            "HOME": folder / "home",
            "XDG_CACHE_HOME": folder / "cache",
            "MPLCONFIGDIR": folder / "mpl",
        }
        for each in (*own.values(), folder / "work", folder / "dask"):
            each.mkdir(parents=True)
        worker = (sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
        env = dict(os.environ) | {key: str(path) for key, path in own.items()}
        place = {"cwd": folder / "work", "env": env, "start_new_session": True}
        processes.append(started(*worker, "--local-directory", folder / "dask", **place))
    yield address, processes[1:], folders
    for process in reversed(processes):
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def states(address: str) -> dict[str, tuple[int, str, str, bool]]:
    """Process, working directory, folder of temporary files of each worker, and whether it has done jobs of a run."""
    from distributed import Client

    def state(dask_worker):
        import tempfile

        return os.getpid(), os.getcwd(), tempfile.gettempdir(), hasattr(dask_worker, "doo3d_frame_cache")

    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=60)
        return client.run(state)


def test_two_workers_that_share_no_memory(frames, tmp_path, cluster, monkeypatch, in_groups):
    """Their processes, working directories, caches and temporary files are apart; the capture is named relative to the client."""
    address, processes, folders = cluster
    before = states(address)
    assert sorted(state[0] for state in before.values()) == sorted(process.pid for process in processes)
    assert {state[1:3] for state in before.values()} == {(str(each / "work"), str(each / "tmp")) for each in folders}
    assert not any(state[3] for state in before.values())
    monkeypatch.chdir(frames.parent)
    batch.run(open_capture(frames.name), tmp_path / "out", Config(), batch.RunOptions(scheduler=address))
    batch.run(open_capture(frames.name), tmp_path / "serial", Config())
    assert files_of(tmp_path / "out") == files_of(tmp_path / "serial")
    after = states(address)
    assert all(state[3] for state in after.values()), "both have done jobs"
    assert {state[1] for state in after.values()} == {str(each / "work") for each in folders}
    assert not any(any((each / part).iterdir()) for each in folders for part in ("work", "home"))


def test_a_worker_is_killed_midway(frames, expected, tmp_path, cluster, in_groups):
    address, processes, _ = cluster
    states(address)  # both have come
    killed = []

    def kill_one(record):
        if not killed:
            killed.append(record.name)
            os.killpg(processes[0].pid, signal.SIGKILL)

    batch.run(open_capture(frames), tmp_path / "out", Config(), batch.RunOptions(scheduler=address, report=kill_one))
    assert killed
    assert files_of(tmp_path / "out") == expected


def test_the_death_of_the_scheduler_is_one_line(frames, expected, tmp_path, cluster, schedulers):
    """And the run goes on by other means."""
    address, _, _ = cluster
    states(address)
    out = tmp_path / "out"
    env = dict(os.environ) | {"DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "2s"}
    command = ("doo3d", "detect", frames, "-o", out, "--quiet")
    process = started(*command, "--scheduler", address, env=env)
    wait_for(lambda: finished_frames(out) >= 1)
    os.killpg(schedulers[0].pid, signal.SIGKILL)
    output, _ = process.communicate(timeout=120)
    assert process.returncode == 2, output
    failed, *lines = [line for line in output.splitlines() if "000004" not in line]
    assert lines == []
    assert "the scheduler has gone" in failed
    assert failed.endswith("[scheduler-unreachable]")
    started(*command).communicate()
    assert files_of(out) == expected


def test_nobody_answers(frames, refused):
    refused(frames, "--scheduler", "tcp://127.0.0.1:1", code="scheduler-unreachable")
    refused(frames, "--scheduler", "tcp://127.0.0.1:1", "--workers", "2", code="options-conflict")


def test_the_package_that_is_missing_is_named(monkeypatch, frames, tmp_path):
    monkeypatch.setitem(sys.modules, "dask.distributed", None)
    with refuses("missing-package", "doo3d[cluster]", kind=MissingDependency):
        batch.run(open_capture(frames), tmp_path / "out", Config(), batch.RunOptions(scheduler="tcp://127.0.0.1:1"))
    assert not (tmp_path / "out").exists()

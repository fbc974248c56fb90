"""Jobs done by workers of dask.distributed: processes of this machine, or of others."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

from ..errors import InputError, require
from .executor import Future, WorkerLost
from .frame_cache import FrameCache
from .threads import ONE_THREAD, single_thread

PENDING_PER_WORKER = 4
"""Frames between reading and writing per worker: a slow frame does not keep other workers idle, and memory stays small."""

MAX_SECONDS_WITHOUT_WORKERS = 60.0
"""s without any worker until the run ends; a worker that died is replaced within some seconds."""

POLL_SECONDS = 1.0
"""s between checks that workers are alive, while a job is waited for."""

LOST_MESSAGE = "its worker died of it, twice (out of memory, or a crash in a library)"
RESUME_MESSAGE = "finished frames are kept, repeat the same command to resume"

LOCAL_SETTINGS = {
    # dask blames a worker's death on all jobs it had; the jobs are then repeated one at a time to find the cause
    "distributed.scheduler.allowed-failures": 0,
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.nanny.pre-spawn-environ": ONE_THREAD,
    "distributed.admin.low-level-log-length": 0,
    # dask monitors itself fifty times a second, profiles its workers, and rebalances jobs: none of it is of use here
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.tick.limit": "30s",
    "distributed.admin.tick.cycle": "10s",
    "distributed.admin.system-monitor.interval": "10s",
    "distributed.worker.profile.enabled": False,
    "distributed.scheduler.work-stealing": False,
}
"""dask's settings for a local cluster."""


@contextmanager
def local_workers(workers: int) -> Iterator[DaskExecutor]:
    """Start worker processes of one thread each on this machine, for the duration of a `with` block.

    Yields the DaskExecutor that sends jobs to these workers; `workers` is their number. The operating system chooses every port,
    so that several runs at once do not collide with each other or with other programs on dask's default ports.

    Raises
    ------
    MissingDependency : dask.distributed is not installed.
    """
    distributed = require("dask.distributed", "cluster")
    dask = require("dask", "cluster")
    options = {"n_workers": workers, "threads_per_worker": 1, "processes": True, "host": "127.0.0.1"}
    # without an address the scheduler's HTTP server takes port 8787, and warns if that is in use, even with the dashboard off
    http = {"dashboard_address": None, "scheduler_kwargs": {"dashboard": False, "dashboard_address": "127.0.0.1:0"}}
    with (
        dask.config.set(LOCAL_SETTINGS),
        distributed.LocalCluster(**options, **http, silence_logs=logging.CRITICAL) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield DaskExecutor(client, workers)


@contextmanager
def scheduler_workers(scheduler: str) -> Iterator[DaskExecutor]:
    """Connect to the workers of a running dask scheduler, for the duration of a `with` block.

    Yields the DaskExecutor that sends jobs to these workers. `scheduler` is an address such as tcp://host:8786.

    Raises
    ------
    InputError : no scheduler answers at the address within 10 s, or it has no workers within 60 s.
    MissingDependency : dask.distributed is not installed.
    """
    distributed = require("dask.distributed", "cluster")
    try:
        client = distributed.Client(scheduler, set_as_default=False, timeout="10s")
    except (OSError, ValueError, distributed.TimeoutError) as error:
        raise InputError(
            f"{scheduler}: no scheduler answers there ({error}): start one with: dask scheduler", code="scheduler-unreachable"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=MAX_SECONDS_WITHOUT_WORKERS)
        except distributed.TimeoutError:
            raise InputError(
                f"{scheduler}: has no workers: start some with: dask worker {scheduler} --nthreads 1", code="workers-missing"
            ) from None
        yield DaskExecutor(client, sum(client.nthreads().values()))


@dataclass(eq=False)
class DaskJob:
    """A job submitted to dask; implements the `Future` interface.

    Attributes
    ----------
    executor
        the executor that the job was submitted to.
    function, args
        the job: `function(cache, *args)`, where `cache` is the FrameCache of the worker.
    future
        dask's own future of the job.
    worker
        before the job is done, the address of the preferred worker, or None if any worker may do it; afterwards the address of
        the worker that did it.
    """

    executor: DaskExecutor
    function: Callable[..., Any]
    args: tuple[Any, ...]
    future: Any
    worker: str | None = None

    def result(self) -> Any:
        """Wait for the job and return the value of its function.

        An exception raised by the function is raised here.

        Raises
        ------
        WorkerLost : the worker died while it did the job, twice.
        InputError : no workers are left, or the scheduler cannot be reached any more.
        """
        try:
            self.worker, value = self.executor.wait(self)
        finally:
            self.future.release()
        return value


@dataclass(eq=False)
class DaskExecutor:
    """Executor that sends the jobs of a run to workers of dask.distributed.

    Attributes
    ----------
    client
        the dask.distributed Client that is connected to the scheduler.
    workers
        number of worker threads, which is the number of frames worked on at a time.
    max_pending
        largest number of frames that may be submitted but not yet written: 4 per worker.
    """

    client: Any
    workers: int
    _pending: list[DaskJob] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.max_pending = PENDING_PER_WORKER * self.workers

    def submit(self, function: Callable[..., Any], *args: Any, affinity: Future | None = None) -> Future:
        """Submit the job `function(cache, *args)`, where `cache` is the FrameCache of the worker that does it.

        Parameters
        ----------
        function
            the function to call; the workers must be able to import it.
        *args
            the function's arguments after the cache; they must be picklable.
        affinity
            an earlier job that is finished. The new job prefers the worker that did it, which still holds the frame's data, and
            is done before jobs without affinity, so that the data are released soon. None if any worker may do the new job.

        Returns
        -------
        The job; its `result()` waits for the value of the function.
        """
        worker = affinity.worker if isinstance(affinity, DaskJob) else None
        job = DaskJob(self, function, args, self._submit(function, args, worker), worker)
        self._pending.append(job)
        return job

    def _submit(self, function: Callable[..., Any], args: tuple[Any, ...], worker: str | None = None) -> Any:
        options = {"workers": [worker], "allow_other_workers": True, "priority": 1} if worker else {}
        return self.client.submit(_run_job, os.getcwd(), function, args, pure=False, **options)

    def wait(self, job: DaskJob) -> tuple[str, Any]:
        """Wait for a job; return the address of the worker that did it, and the value of its function.

        A job whose worker died is repeated once, with no other job running, to tell whether this job is the cause.

        Raises
        ------
        WorkerLost : the worker that repeated the job died too.
        InputError : no workers are left, or the scheduler cannot be reached any more.
        """
        killed = require("dask.distributed", "cluster").KilledWorker
        self._pending.remove(job)
        try:
            return self._poll(job)
        except killed:
            for other in self._pending:
                with suppress(killed):
                    self._poll(other)
        self._resubmit(job)
        try:
            return self._poll(job)
        except killed:
            raise WorkerLost(LOST_MESSAGE) from None

    def _resubmit(self, job: DaskJob) -> None:
        job.future, job.worker = self._submit(job.function, job.args), None

    def _poll(self, job: DaskJob) -> tuple[str, Any]:
        """Wait for a job as long as there are workers that can do it.

        Raises
        ------
        KilledWorker : its worker died. InputError : no workers are left, or the scheduler has gone.
        """
        distributed = require("dask.distributed", "cluster")
        last_alive = time.monotonic()
        while True:
            try:
                worker, value = job.future.result(timeout=POLL_SECONDS)
                return worker, value
            except distributed.TimeoutError:
                alive = self.client.nthreads()
                if alive:
                    last_alive = time.monotonic()
                elif time.monotonic() - last_alive > MAX_SECONDS_WITHOUT_WORKERS:
                    raise InputError(f"no worker is left: {RESUME_MESSAGE}", code="workers-missing") from None
                if job.worker and job.worker not in alive:
                    self._resubmit(job)  # dask keeps a job waiting for its preferred worker even after that has gone
            except (OSError, distributed.CancelledError):
                raise InputError(f"the scheduler has gone: {RESUME_MESSAGE}", code="scheduler-unreachable") from None


def _run_job(folder: str, function: Callable[..., Any], args: tuple[Any, ...]) -> tuple[str, Any]:
    """Do a job on a worker.

    Parameters
    ----------
    folder
        working directory of the client, to which paths in the arguments are relative.
    function, args
        the job; it is called with the worker's FrameCache before its arguments.

    Returns
    -------
    The worker's address, and the result of the job.
    """
    from distributed import get_worker

    worker = get_worker()
    cache = _worker_cache(worker)
    previous = os.getcwd()
    try:
        if os.path.isdir(folder):
            os.chdir(folder)
        return worker.address, function(cache, *args)
    finally:
        os.chdir(previous)


def _worker_cache(worker: Any) -> FrameCache:
    """Return the FrameCache of a dask worker, an attribute of it; the first job on the worker makes it."""
    cache = getattr(worker, "doo3d_frame_cache", None)
    if cache is None:
        single_thread()
        cache = worker.doo3d_frame_cache = FrameCache()
    assert isinstance(cache, FrameCache)
    return cache

"""Execute jobs on the workers of a dask scheduler, which run on this machine or on others."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

from ..errors import InputError, require
from .executor import Call, do_calls
from .frame_cache import FrameCache
from .retrying_executor import RESUME_MESSAGE, JobLost, RetryingExecutor, WorkerJob
from .threads import single_thread

MAX_SECONDS_WITHOUT_WORKERS = 60.0
"""Time in s without any worker after which the run ends; dask replaces a dead worker within some seconds."""

POLL_SECONDS = 1.0
"""Time in s between checks that workers are alive, while waiting for a job."""

CLOSE_SECONDS = 5.0
"""Greatest time in s for closing the connection to the scheduler."""


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
    with _silent("distributed"), _client(scheduler) as client:
        try:
            client.wait_for_workers(1, timeout=MAX_SECONDS_WITHOUT_WORKERS)
        except distributed.TimeoutError:
            raise InputError(
                f"{scheduler}: has no workers: start some with: dask worker {scheduler} --nthreads 1", code="workers-missing"
            ) from None
        yield DaskExecutor(client, sum(client.nthreads().values()))


@contextmanager
def _client(scheduler: str) -> Iterator[Any]:
    """Yield a client that is connected to the scheduler, for the duration of a `with` block."""
    distributed = require("dask.distributed", "cluster")
    try:
        client = distributed.Client(scheduler, set_as_default=False, timeout="10s")
    except (OSError, ValueError, distributed.TimeoutError) as error:
        raise InputError(
            f"{scheduler}: no scheduler answers there ({error}): start one with: dask scheduler --no-dashboard",
            code="scheduler-unreachable",
        ) from None
    try:
        yield client
    finally:
        with suppress(OSError, distributed.TimeoutError, distributed.CancelledError):  # it may have gone
            client.close(timeout=CLOSE_SECONDS)


@contextmanager
def _silent(package: str) -> Iterator[None]:
    """Suppress the log messages of a package; errors are reported by exceptions of this module instead."""
    loggers = [logger for name, logger in logging.root.manager.loggerDict.items() if name.split(".")[0] == package]
    levels = {logger: logger.level for logger in loggers if isinstance(logger, logging.Logger)}
    try:
        for logger in levels:
            logger.setLevel(logging.CRITICAL + 1)
        yield
    finally:
        for logger, level in levels.items():
            logger.setLevel(level)


class DaskExecutor(RetryingExecutor):
    """Executor that sends the jobs of a run to workers of dask.distributed.

    Parameters
    ----------
    client
        the dask.distributed Client that is connected to the scheduler.
    workers
        number of worker threads, which is the number of frames worked on at a time.
    """

    def __init__(self, client: Any, workers: int) -> None:
        super().__init__(workers)
        self._client = client

    def _start(self, job: WorkerJob) -> None:
        options = {"workers": [job.worker], "allow_other_workers": True, "priority": 1} if job.worker else {}
        job.handle = self._client.submit(_run_job, os.getcwd(), job.function, job.calls, pure=False, **options)

    def _is_done(self, job: WorkerJob) -> bool:
        return bool(job.handle.done())

    def _settle(self, job: WorkerJob) -> None:
        # its values stay with the future; an exception is raised again by whoever asks for them
        with suppress(JobLost):
            self._poll(job)

    def _values(self, job: WorkerJob) -> list[Any]:
        try:
            job.worker, values = self._poll(job)
        finally:
            job.handle.release()
        return values

    def _poll(self, job: WorkerJob) -> tuple[str, list[Any]]:
        """Wait for a job while there are workers for it; return the worker's address and the job's values.

        Raises
        ------
        JobLost : its worker died. InputError : no workers are left, or the scheduler has gone.
        """
        distributed = require("dask.distributed", "cluster")
        last_alive = time.monotonic()
        while True:
            try:
                worker, values = job.handle.result(timeout=POLL_SECONDS)
                return worker, values
            except distributed.KilledWorker:
                raise JobLost from None
            except distributed.TimeoutError:
                alive = self._client.nthreads()
                if alive:
                    last_alive = time.monotonic()
                elif time.monotonic() - last_alive > MAX_SECONDS_WITHOUT_WORKERS:
                    raise InputError(f"no worker is left: {RESUME_MESSAGE}", code="workers-missing") from None
                if job.worker and job.worker not in alive:
                    job.worker = None  # dask keeps a job waiting for its preferred worker even after that has gone
                    self._start(job)
            except (OSError, distributed.CancelledError):
                raise InputError(f"the scheduler has gone: {RESUME_MESSAGE}", code="scheduler-unreachable") from None


def _run_job(folder: str, function: Callable[..., Any], calls: Sequence[Call]) -> tuple[str, list[Any]]:
    """Do a job on a worker.

    Parameters
    ----------
    folder
        working directory of the client, to which paths in the arguments are relative.
    function, calls
        the job: `function(cache, *call)` for each call, where `cache` is the FrameCache of the worker.

    Returns
    -------
    The worker's address, and the values of the job.
    """
    from distributed import get_worker

    worker = get_worker()
    cache = _worker_cache(worker)
    previous = os.getcwd()
    try:
        if os.path.isdir(folder):
            os.chdir(folder)
        return worker.address, do_calls(cache, function, calls)
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

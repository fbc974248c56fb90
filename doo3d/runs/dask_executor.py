"""The workers of dask.distributed: processes of this machine, or of others."""

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
from .threads import ONE_THREAD, single_thread

_AHEAD = 4  # frames under way per worker: one that takes long does not keep the others waiting, and memory stays small
_PATIENCE = 60.0  # s without any worker until the run ends; one that died is back within some seconds
_POLL = 1.0  # s between looks at who is there, while something is waited for
_LOST = "its worker died of it, twice (out of memory, or a crash in a library)"
# A local worker's death is blamed on all that it was given; which frame it was, each then shows alone.
_LOCAL = {
    "distributed.scheduler.allowed-failures": 0,
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.nanny.pre-spawn-environ": ONE_THREAD,
    "distributed.admin.low-level-log-length": 0,
    # dask looks after itself fifty times a second, samples what workers do, and moves work about: none of it is of use here
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.tick.limit": "30s",
    "distributed.admin.tick.cycle": "10s",
    "distributed.admin.system-monitor.interval": "10s",
    "distributed.worker.profile.enabled": False,
    "distributed.scheduler.work-stealing": False,
}


@contextmanager
def local(workers: int) -> Iterator[Cluster]:
    """So many processes of this machine, each with one thread, for as long as the block runs."""
    distributed = require("dask.distributed", "cluster")
    dask = require("dask", "cluster")
    settings = {"n_workers": workers, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with (
        dask.config.set(_LOCAL),
        distributed.LocalCluster(**settings, host="127.0.0.1", silence_logs=logging.CRITICAL) as processes,
        distributed.Client(processes, set_as_default=False) as client,
    ):
        yield Cluster(client, workers)


@contextmanager
def remote(scheduler: str) -> Iterator[Cluster]:
    """The workers that a running scheduler has, such as tcp://host:8786.

    Raises
    ------
    InputError : nobody answers there, or it has no workers.
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
            client.wait_for_workers(1, timeout=_PATIENCE)
        except distributed.TimeoutError:
            raise InputError(
                f"{scheduler}: has no workers: start some with: dask worker {scheduler} --nthreads 1", code="workers-missing"
            ) from None
        yield Cluster(client, sum(client.nthreads().values()))


@dataclass(eq=False)
class _Task:
    """Work on the cluster. place : the address of the worker that it is to be near, then of the one that did it."""

    cluster: Cluster
    function: Callable[..., Any]
    args: tuple[Any, ...]
    future: Any
    place: str | None = None

    def result(self) -> Any:
        try:
            self.place, value = self.cluster.outcome(self)
        finally:
            self.future.release()
        return value


@dataclass(eq=False)
class Cluster:
    """A client of dask.distributed as a executor."""

    client: Any
    workers: int
    _tasks: list[_Task] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.window = _AHEAD * self.workers

    def submit(self, function: Callable[..., Any], *args: Any, near: Future | None = None) -> Future:
        """Hand out work; what is near a job goes first, so that what waits for it is soon let go."""
        place = near.place if isinstance(near, _Task) else None
        task = _Task(self, function, args, self._start(function, args, place), place)
        self._tasks.append(task)
        return task

    def _start(self, function: Callable[..., Any], args: tuple[Any, ...], place: str | None = None) -> Any:
        where = {"workers": [place], "allow_other_workers": True, "priority": 1} if place else {}
        return self.client.submit(_work, os.getcwd(), function, args, pure=False, **where)

    def outcome(self, task: _Task) -> tuple[str, Any]:
        """Where it was done, and what came of it. Work whose worker died is done once more with nothing beside it."""
        killed = require("dask.distributed", "cluster").KilledWorker
        self._tasks.remove(task)
        try:
            return self._wait(task)
        except killed:
            for other in self._tasks:
                with suppress(killed):
                    self._wait(other)
        self._restart(task)
        try:
            return self._wait(task)
        except killed:
            raise WorkerLost(_LOST) from None

    def _restart(self, task: _Task) -> None:
        task.future, task.place = self._start(task.function, task.args), None

    def _wait(self, task: _Task) -> tuple[str, Any]:
        """Wait as long as there are workers that could do it.

        Raises
        ------
        KilledWorker : who did it died. InputError : there are no workers, or the scheduler has gone.
        """
        distributed = require("dask.distributed", "cluster")
        seen = time.monotonic()
        while True:
            try:
                place, value = task.future.result(timeout=_POLL)
                return place, value
            except distributed.TimeoutError:
                workers = self.client.nthreads()
                if workers:
                    seen = time.monotonic()
                elif time.monotonic() - seen > _PATIENCE:
                    raise InputError(f"no worker is left; finished frames are kept, {_AGAIN}", code="workers-missing") from None
                if task.place and task.place not in workers:
                    self._restart(task)  # dask lets work wait for the worker it was to be near, though that has gone
            except (OSError, distributed.CancelledError):
                raise InputError(
                    f"the scheduler has gone; finished frames are kept, {_AGAIN}", code="scheduler-unreachable"
                ) from None


_AGAIN = "the same command goes on where it was"
_ready: list[bool] = []


def _work(folder: str, function: Callable[..., Any], args: tuple[Any, ...]) -> tuple[str, Any]:
    """Run by the worker: its address and what the function gives, with paths relative to the folder of the client."""
    from distributed import get_worker

    if not _ready:
        single_thread()
        _ready.append(True)
    own = os.getcwd()
    try:
        if os.path.isdir(folder):
            os.chdir(folder)
        return get_worker().address, function(*args)
    finally:
        os.chdir(own)

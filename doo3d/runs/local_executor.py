"""Execute jobs in worker processes of this machine, which live as long as the run.

Each worker is a process with a pipe to a thread of this process. The thread sends a job only when the worker has none, so that
the two never block each other; a closed pipe shows that a worker died. The processes are spawned, not forked, so that threads and
locks of the calling program do not affect them.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from multiprocessing.reduction import ForkingPickler
from types import ModuleType
from typing import Any

from ..errors import InputError
from ..guard.guarding import first_line
from .executor import do_calls
from .retrying_executor import RESUME_MESSAGE, JobLost, JobTooSlow, RetryingExecutor, WorkerJob
from .threads import ONE_THREAD, single_thread
from .time_limit import PAUSE_SECONDS, limit_message

START_SECONDS = 120.0
"""Greatest time in s for a worker to load the libraries: 1 s from a disk, more from a network or on a busy computer."""

WATCH_SECONDS = 0.5
"""Time in s between checks of how long the workers have been busy."""


@contextmanager
def local_workers(workers: int, time_limit: float | None = None) -> Iterator[LocalExecutor]:
    """Start worker processes of one thread each on this machine, for the duration of a `with` block.

    Yields the LocalExecutor that sends jobs to these workers; `workers` is their number. A worker whose job takes longer than
    `time_limit` seconds (None: no limit) is replaced. The workers end with the block, and if this process is killed.
    """
    executor = LocalExecutor(workers, time_limit)
    try:
        yield executor
    finally:
        executor.close()


@dataclass(eq=False)
class _Outcome:
    """The state of a submitted job."""

    payload: Any
    """The pickled job; None once it was sent."""
    done: bool = False
    values: list[Any] | None = None
    """The values of its function; None before it is done, and if it failed."""
    error: BaseException | None = None
    """An exception raised by its function, or JobLost."""


@dataclass(eq=False)
class _Worker:
    """A worker process, its pipe, and the jobs that prefer it."""

    process: BaseProcess
    pipe: Connection
    preferring: deque[WorkerJob] = field(default_factory=deque)
    seconds_left: float | None = None
    """Time in s left for its job, not counting time in which this process was stopped; None while it has no job."""
    is_new: bool = True
    """Whether it has not started a job yet, so that it may still be loading the libraries."""


class LocalExecutor(RetryingExecutor):
    """Executor that sends the jobs of a run to processes of this machine, one thread each.

    A job goes to the first worker without work. Jobs with affinity go first, to the worker that they prefer; another worker takes
    one only if it would be idle otherwise. A worker that died, or whose job takes too long, is replaced at once.

    Parameters
    ----------
    workers
        number of processes to start.
    time_limit
        greatest time in s for a job of one or several frames, which usually takes 0.6 s; None for no limit.
    """

    def __init__(self, workers: int, time_limit: float | None = None) -> None:
        super().__init__(workers)
        self._time_limit = time_limit
        self._context = multiprocessing.get_context("spawn")
        self._changed = threading.Condition()
        self._waiting: deque[WorkerJob] = deque()
        self._closed = False
        self._broken: InputError | None = None
        self._workers: list[_Worker] = []
        self._threads: list[threading.Thread] = []
        try:
            for _ in range(workers):
                self._workers.append(_Worker(*self._spawn()))
                self._begin(self._drive, self._workers[-1])
            if time_limit is not None:
                self._begin(self._watch, time_limit)
        except Exception as error:
            self.close()
            raise _without_process(error) from error

    def _begin(self, function: Callable[[Any], None], argument: Any) -> None:
        """Start a thread of this executor."""
        thread = threading.Thread(target=function, args=(argument,), daemon=True)
        thread.start()
        self._threads.append(thread)

    def close(self) -> None:
        """End the workers at once, also during a job."""
        with self._changed:
            self._closed = True
            for worker in self._workers:
                worker.process.kill()
            self._changed.notify_all()
        for thread in self._threads:
            thread.join()
        for worker in self._workers:
            worker.process.join()
            worker.process.close()
            worker.pipe.close()

    def _spawn(self) -> tuple[BaseProcess, Connection]:
        """Start a process and return it with this end of its pipe."""
        here, there = self._context.Pipe()
        process = self._context.Process(target=_work, args=(there,), daemon=True)
        with _bare_surroundings(), _without_interrupts():
            process.start()
        there.close()
        return process, here

    def _start(self, job: WorkerJob) -> None:
        job.handle = _Outcome(ForkingPickler.dumps((job.function, job.calls)))
        with self._changed:
            if self._broken is not None:
                job.handle.error, job.handle.done = self._broken, True
            (self._waiting if job.worker is None else job.worker.preferring).append(job)
            self._changed.notify_all()

    def _is_done(self, job: WorkerJob) -> bool:
        return bool(job.handle.done)

    def _settle(self, job: WorkerJob) -> None:
        with self._changed:
            self._changed.wait_for(lambda: job.handle.done)

    def _values(self, job: WorkerJob) -> list[Any]:
        self._settle(job)
        outcome, job.handle = job.handle, _Outcome(None, done=True)  # the values are the caller's now
        if outcome.error is not None:
            raise outcome.error
        values: list[Any] = outcome.values
        return values

    def _drive(self, worker: _Worker) -> None:
        """Send jobs to a worker and receive its results, until the executor is closed."""
        while (job := self._next_job(worker)) is not None:
            outcome = job.handle
            payload, outcome.payload = outcome.payload, None
            values: list[Any] | None = None
            error: BaseException | None = None
            try:
                worker.pipe.send_bytes(payload)
                del payload
                if worker.is_new:
                    worker.pipe.recv_bytes()  # the libraries are loaded: the job begins
                    with self._changed:
                        worker.is_new, worker.seconds_left = False, self._time_limit
                values, error = worker.pipe.recv()
            except (EOFError, OSError):
                error = JobLost() if self._time_limit is None or self._is_in_time(worker) else self._too_slow(self._time_limit)
                try:
                    self._replace(worker)
                except Exception as reason:  # no file descriptor, process or memory is left
                    error = self._give_up(reason)
            except Exception as unreadable:
                error = unreadable
            with self._changed:
                job.worker, outcome.values, outcome.error, outcome.done = worker, values, error, True
                self._changed.notify_all()
            del job, outcome, values, error  # of several megabytes, not to be held until the next job is done

    def _give_up(self, reason: Exception) -> InputError:
        """Fail all waiting and future jobs, since no process can be started; return the error."""
        error = _without_process(reason)
        with self._changed:
            self._broken = error
            for queue in (self._waiting, *(worker.preferring for worker in self._workers)):
                for job in queue:
                    job.handle.error, job.handle.done = error, True
                queue.clear()
            self._changed.notify_all()
        return error

    def _next_job(self, worker: _Worker) -> WorkerJob | None:
        """Wait for a job for the worker and return it; None once the executor is closed or no process can be started."""
        with self._changed:
            while not self._closed and self._broken is None:
                others = max((other.preferring for other in self._workers), key=len)
                for queue in (worker.preferring, self._waiting, others):
                    if queue:
                        if self._time_limit is not None:
                            worker.seconds_left = START_SECONDS if worker.is_new else self._time_limit
                        return queue.popleft()
                worker.seconds_left = None
                self._changed.wait()
        return None

    def _watch(self, time_limit: float) -> None:
        """End workers whose job takes too long, also suspended ones, until the executor is closed.

        Time is counted in small steps, so that time in which this process is suspended with its workers hardly counts.
        """
        step, last = min(WATCH_SECONDS, time_limit / 4), time.monotonic()
        with self._changed:
            while not self._closed:
                self._changed.wait_for(lambda: self._closed, step)
                passed = min(time.monotonic() - last, PAUSE_SECONDS)
                last = time.monotonic()
                for worker in self._workers:
                    if worker.seconds_left is not None and worker.seconds_left > 0:
                        worker.seconds_left -= passed
                        if worker.seconds_left <= 0:
                            worker.process.kill()

    def _is_in_time(self, worker: _Worker) -> bool:
        with self._changed:
            return worker.seconds_left is None or worker.seconds_left > 0

    @staticmethod
    def _too_slow(time_limit: float) -> JobTooSlow:
        return JobTooSlow(limit_message(time_limit))

    def _replace(self, worker: _Worker) -> None:
        """Start a new process in place of one that died."""
        worker.process.join()
        with self._changed:
            if not self._closed:
                worker.pipe.close()
                process, worker.pipe = self._spawn()
                worker.process.close()
                worker.process = process
                worker.is_new, worker.seconds_left = True, None


def _without_process(reason: Exception) -> InputError:
    """Return the error for a process that could not be started."""
    sentence = f"no worker process can be started ({first_line(reason)}): use fewer workers, or close other programs"
    return InputError(f"{sentence}: {RESUME_MESSAGE}", code="workers-missing")


@contextmanager
def _bare_surroundings() -> Iterator[None]:
    """Prepare this process for starting workers in a `with` block: they inherit one thread, and no main script.

    Numerical libraries read the number of threads as they are loaded. Without a script in `__main__` a spawned process has none
    to import: it starts sooner, and scripts need no `if __name__ == "__main__":`.
    """
    before, script = {name: os.environ.get(name) for name in ONE_THREAD}, sys.modules["__main__"]
    os.environ.update(ONE_THREAD)
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Block Ctrl-C for processes started in this `with` block; the run ends its workers itself.

    Without signal masks (Windows), the processes ignore Ctrl-C once they begin to work.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    from multiprocessing import resource_tracker

    resource_tracker.ensure_running()  # when `Process.start` starts it, the signal is unblocked
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _work(pipe: Connection) -> None:
    """Do jobs until the run ends: the main function of a worker process.

    Parameters
    ----------
    pipe
        the connection over which jobs come and results go: a pickled pair (function, calls), then a pair (values, error). The
        first message sent says that the libraries are loaded.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes of a terminal; the run ends its workers itself
    threading.Thread(target=_end_with_parent, daemon=True).start()
    single_thread()
    from . import frame_jobs  # noqa: F401 - loads the method while the run prepares the first jobs
    from .frame_cache import FrameCache

    cache = FrameCache()
    with suppress(EOFError, OSError):
        pipe.send_bytes(b"ready")
        while True:
            payload = pipe.recv_bytes()
            try:
                function, calls = pickle.loads(payload)
                answer = ForkingPickler.dumps((do_calls(cache, function, calls), None))
            except Exception as error:
                answer = ForkingPickler.dumps((None, error))
            pipe.send_bytes(answer)


def _end_with_parent() -> None:
    """End this process as soon as the process of the run has ended, also by a kill."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)

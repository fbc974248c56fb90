"""Jobs done by worker processes of this machine, which live as long as the run.

Each worker is a process with a pipe to a thread of this process. The thread sends a job when the worker has none, so the two
never wait for each other to read, and a worker that died is noticed by the end of its pipe. The processes are spawned, not
forked: threads and locks of the calling program do not concern them.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from multiprocessing.reduction import ForkingPickler
from types import ModuleType
from typing import Any

from .executor import do_calls
from .retrying_executor import JobLost, RetryingExecutor, WorkerJob
from .threads import ONE_THREAD, single_thread


@contextmanager
def local_workers(workers: int) -> Iterator[LocalExecutor]:
    """Start worker processes of one thread each on this machine, for the duration of a `with` block.

    Yields the LocalExecutor that sends jobs to these workers; `workers` is their number. The workers end with the block, and if
    this process is killed.
    """
    executor = LocalExecutor(workers)
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


class LocalExecutor(RetryingExecutor):
    """Executor that sends the jobs of a run to processes of this machine, one thread each.

    A job goes to the first worker without work. Jobs with affinity go first, to the worker that they prefer; another worker takes
    one only if it would be idle otherwise. A worker that died is replaced at once.

    Parameters
    ----------
    workers
        number of processes to start.
    """

    def __init__(self, workers: int) -> None:
        super().__init__(workers)
        self._context = multiprocessing.get_context("spawn")
        self._changed = threading.Condition()
        self._waiting: deque[WorkerJob] = deque()
        self._closed = False
        self._workers = [_Worker(*self._spawn()) for _ in range(workers)]
        self._threads = [threading.Thread(target=self._drive, args=(worker,), daemon=True) for worker in self._workers]
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """End the workers at once, and whatever they are doing."""
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
        with _bare_surroundings():
            process.start()
        there.close()
        return process, here

    def _start(self, job: WorkerJob) -> None:
        job.handle = _Outcome(ForkingPickler.dumps((job.function, job.calls)))
        with self._changed:
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
            values, error = None, None
            try:
                worker.pipe.send_bytes(payload)
                del payload
                values, error = worker.pipe.recv()
            except (EOFError, OSError):
                error = JobLost()
                self._replace(worker)
            except Exception as unreadable:
                error = unreadable
            with self._changed:
                job.worker, outcome.values, outcome.error, outcome.done = worker, values, error, True
                self._changed.notify_all()
            del job, outcome, values, error  # of several megabytes, not to be held until the next job is done

    def _next_job(self, worker: _Worker) -> WorkerJob | None:
        """Wait for a job that the worker may do and return it; None once the executor is closed."""
        with self._changed:
            while not self._closed:
                others = max((other.preferring for other in self._workers), key=len)
                for queue in (worker.preferring, self._waiting, others):
                    if queue:
                        return queue.popleft()
                self._changed.wait()
        return None

    def _replace(self, worker: _Worker) -> None:
        """Start another process in place of one that died."""
        worker.process.join()
        with self._changed:
            if not self._closed:
                worker.process.close()
                worker.pipe.close()
                worker.process, worker.pipe = self._spawn()


@contextmanager
def _bare_surroundings() -> Iterator[None]:
    """Set what a process started in this `with` block takes over: one thread, and no script.

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


def _work(pipe: Connection) -> None:
    """Do jobs until the run ends: the main function of a worker process.

    Parameters
    ----------
    pipe
        the connection over which jobs come and results go: a pickled pair (function, calls), then a pair (values, error).
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes of a terminal; the run ends its workers itself
    threading.Thread(target=_end_with_parent, daemon=True).start()
    single_thread()
    from . import frame_jobs  # noqa: F401 - loads the method while the run prepares the first jobs
    from .frame_cache import FrameCache

    cache = FrameCache()
    with suppress(EOFError, OSError):
        while True:
            payload = pipe.recv_bytes()
            try:
                function, calls = pickle.loads(payload)
                answer = ForkingPickler.dumps((do_calls(cache, function, calls), None))
            except Exception as error:
                answer = ForkingPickler.dumps((None, error))
            pipe.send_bytes(answer)


def _end_with_parent() -> None:
    """End this process as soon as the process of the run has ended, also if that was killed."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)

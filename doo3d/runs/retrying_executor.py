"""Provide the base of executors with worker processes: the calls of a job whose worker died are repeated one by one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from .executor import Call, Future, WorkerLost, WorkerTooSlow

JOBS_PER_WORKER = 3
"""Greatest number of unwritten jobs per worker: one in work, one waiting, one being tracked or written. A slow job does not keep
other workers idle, and memory stays small."""

MAX_FRAMES_PER_JOB = 64
"""Greatest number of frames per job; limits memory, and the work that a kill loses, where frames take few milliseconds each."""

RESUME_MESSAGE = "finished frames are kept, repeat the same command to resume"

LOST_MESSAGE = "its worker died of it, twice (out of memory, or a crash in a library)"


class JobLost(Exception):
    """The error inside an executor for a job whose worker died."""


class JobTooSlow(JobLost):
    """The error inside an executor for a job whose worker was ended because it took too long; its message is for users."""


@dataclass(eq=False)
class WorkerJob:
    """A job submitted to a RetryingExecutor; implements the `Future` interface.

    Attributes
    ----------
    executor
        the executor that the job was submitted to.
    function, calls
        the job: `function(cache, *call)` for each call, where `cache` is the FrameCache of the worker.
    worker
        before the job is done, the preferred worker, or None if any worker may do it; afterwards the worker that did it. Each
        executor identifies workers in its own way.
    handle
        further data of the executor about the job.
    """

    executor: RetryingExecutor
    function: Callable[..., Any]
    calls: Sequence[Call]
    worker: Any = None
    handle: Any = None

    def done(self) -> bool:
        """Return whether the job is finished, or its worker has died."""
        return self.executor._is_done(self)

    def result(self) -> list[Any]:
        """Wait for the job and return the values of its function, with a WorkerLost for each call during which two workers died.

        Call it only once. An exception raised by the function is raised here.

        Raises
        ------
        InputError : no workers are left.
        """
        return self.executor._result(self)


@dataclass(eq=False)
class RetryingExecutor(ABC):
    """Base class of executors whose jobs are done by worker processes, which may die.

    If the worker of a job dies, the job's calls are repeated one by one, each as a job of its own, while no other job is running:
    a call that needs much memory then has all of it, and the cause of another death is certain. A call during which two workers
    died gets a WorkerLost as its result, and a call that alone takes longer than the time limit a WorkerTooSlow.

    Attributes
    ----------
    workers
        number of frames worked on at a time.
    max_jobs
        largest number of submitted jobs whose results are not yet written: 3 per worker.
    max_frames_per_job
        largest number of frames in one job: 64.
    works_here
        False: workers do the jobs.
    """

    workers: int
    max_jobs: int = field(init=False)
    max_frames_per_job: int = field(init=False, default=MAX_FRAMES_PER_JOB)
    works_here: bool = field(init=False, default=False)
    _pending: list[WorkerJob] = field(init=False, default_factory=list)

    def __post_init__(self) -> None:
        self.max_jobs = JOBS_PER_WORKER * self.workers

    def submit(self, function: Callable[..., Any], calls: Sequence[Call], affinity: Future | None = None) -> Future:
        """Submit a job: `function(cache, *call)` for each call, where `cache` is the FrameCache of the worker that does it.

        Parameters
        ----------
        function
            the function to call; the workers must be able to import it.
        calls
            the arguments of each call, after the cache; they must be picklable.
        affinity
            an earlier job that is finished. The new job prefers the worker that did it, which still holds the frames' data, and
            is done before jobs without affinity, so that the data are released soon. None if any worker may do the new job.

        Returns
        -------
        The job; its `result()` waits for the values of the function.
        """
        job = WorkerJob(self, function, calls, affinity.worker if isinstance(affinity, WorkerJob) else None)
        self._start(job)
        self._pending.append(job)
        return job

    def _result(self, job: WorkerJob) -> list[Any]:
        self._pending.remove(job)
        try:
            return self._values(job)
        except JobLost as error:
            if isinstance(error, JobTooSlow) and len(job.calls) == 1:
                return [WorkerTooSlow(str(error))]
            for other in self._pending:
                self._settle(other)
        return [self._repeated(job, call) for call in job.calls]

    def _repeated(self, lost: WorkerJob, call: Call) -> Any:
        """Repeat one call of a lost job alone and return its value; a WorkerLost if the call's worker died twice.

        The death of a worker during a job of several calls does not count, since any of the calls may be the cause.
        """
        for _ in range(2 if len(lost.calls) > 1 else 1):
            job = WorkerJob(self, lost.function, [call])
            self._start(job)
            try:
                (value,) = self._values(job)
            except JobTooSlow as error:
                return WorkerTooSlow(str(error))
            except JobLost:
                continue
            lost.worker = job.worker
            return value
        return WorkerLost(LOST_MESSAGE)

    @abstractmethod
    def _start(self, job: WorkerJob) -> None:
        """Hand the job to the workers."""

    @abstractmethod
    def _is_done(self, job: WorkerJob) -> bool:
        """Return whether the job is finished, or its worker has died."""

    @abstractmethod
    def _settle(self, job: WorkerJob) -> None:
        """Wait until no worker is working on the job, whether it succeeds or fails."""

    @abstractmethod
    def _values(self, job: WorkerJob) -> list[Any]:
        """Wait for the job and return the values of its function; set `job.worker` to the worker that did it.

        Raises
        ------
        JobLost : its worker died. InputError : no workers are left.
        """

"""What executors with worker processes have in common: the calls of a job whose worker died are repeated one by one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from .executor import Call, Future, WorkerLost, WorkerTooSlow

JOBS_PER_WORKER = 3
"""Jobs between submitting and writing per worker: one in work, one waiting, one being tracked or written. A slow job does not
keep other workers idle, and memory stays small."""

MAX_FRAMES_PER_JOB = 64
"""Limits the memory of a run and what a kill loses, where frames take few milliseconds each."""

RESUME_MESSAGE = "finished frames are kept, repeat the same command to resume"

LOST_MESSAGE = "its worker died of it, twice (out of memory, or a crash in a library)"


class JobLost(Exception):
    """Raised inside of an executor for a job whose worker died."""


class JobTooSlow(JobLost):
    """Raised inside of an executor for a job that took too long, so that its worker was ended; the message is for users."""


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
        before the job is done, the preferred worker, or None if any worker may do it; afterwards the worker that did it. What
        identifies a worker is up to the executor.
    handle
        whatever else the executor keeps of the job.
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

        To be called once. An exception raised by the function is raised here.

        Raises
        ------
        InputError : no workers are left.
        """
        return self.executor._result(self)


@dataclass(eq=False)
class RetryingExecutor(ABC):
    """Base class of executors whose jobs are done by worker processes, which may die.

    If the worker of a job dies, the job's calls are repeated one by one, each as a job of its own, while no other job is running:
    a call that needs much memory then has all of it, and no other call can be blamed for it. A call that two workers have died of
    is given up, and so is one that alone takes longer than the time limit.

    Attributes
    ----------
    workers
        number of frames worked on at a time.
    max_jobs
        largest number of jobs that may be submitted but not yet written: 3 per worker.
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
        """Return the value of one call of a lost job, done again by itself; a WorkerLost if the call's worker has died twice.

        The death of the worker of a job with several calls counts for none of them, since any of them may be the cause.
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
        """Wait until no worker is working on the job, whatever its outcome."""

    @abstractmethod
    def _values(self, job: WorkerJob) -> list[Any]:
        """Wait for the job and return the values of its function; set `job.worker` to the worker that did it.

        Raises
        ------
        JobLost : its worker died. InputError : no workers are left.
        """

"""Define the interface between a run and the processes that do its work: executors, futures, lost workers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from .frame_cache import FrameCache

Call = tuple[Any, ...]
"""The arguments of one call of a job's function, after the cache."""


class WorkerLost(Exception):
    """The result of a call whose worker process died twice, for example from lack of memory.

    The message is a sentence for the user; `code` is "worker-lost".
    """

    code = "worker-lost"


class WorkerTooSlow(WorkerLost):
    """The result of a call that took longer than the time limit; its worker process was replaced.

    The message is a sentence for the user; `code` is "time-limit".
    """

    code = "time-limit"


class Future(Protocol):
    """A submitted job, whose results can be waited for."""

    def done(self) -> bool:
        """Return whether the results are ready, so that `result` does not wait."""
        ...

    def result(self) -> list[Any]:
        """Wait for the job and return the values of its function, one for each call, in order.

        For a call whose worker died twice, the list has a WorkerLost instead of a value. An exception raised by the function is
        raised here.

        Raises
        ------
        InputError : no workers are left.
        """
        ...


class Executor(Protocol):
    """The interface of an executor, which does the jobs of a run, in this process or in worker processes.

    Attributes
    ----------
    workers
        number of frames processed at the same time.
    max_jobs
        largest number of submitted jobs whose results are not yet written; it limits the memory of a run.
    max_frames_per_job
        largest number of frames in one job.
    works_here
        whether the thread that asks for a result does the job itself, instead of workers in the background.
    """

    workers: int
    max_jobs: int
    max_frames_per_job: int
    works_here: bool

    def submit(self, function: Callable[..., Any], calls: Sequence[Call], affinity: Future | None = None) -> Future:
        """Submit a job: `function(cache, *call)` for each call, in order, with the FrameCache of the process that does it.

        Parameters
        ----------
        function
            the function to call; other processes must be able to import it.
        calls
            the arguments of each call, after the cache; they must be picklable.
        affinity
            an earlier job that is finished. The new job prefers the process that did it, which still holds the frames' data, and
            is done before jobs without affinity, so that the data are released soon. None if any process may do the new job.

        Returns
        -------
        The job; its `result()` waits for the values of the function.
        """
        ...


def do_calls(cache: FrameCache, function: Callable[..., Any], calls: Sequence[Call]) -> list[Any]:
    """Do one job: return `function(cache, *call)` for each call, in order."""
    return [function(cache, *call) for call in calls]

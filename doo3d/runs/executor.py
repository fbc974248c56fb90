"""The interface between a run and the processes that do its work: executors, futures, lost workers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol


class WorkerLost(Exception):
    """Raised for a job whose worker process died twice while doing it, for example from lack of memory.

    The message is a sentence for the user; `code` is "worker-lost".
    """

    code = "worker-lost"


class Future(Protocol):
    """A submitted job, whose result can be waited for."""

    def result(self) -> Any:
        """Wait for the job and return the value of its function.

        An exception raised by the function is raised here.

        Raises
        ------
        WorkerLost : the worker died while it did the job, twice.
        InputError : no workers are left.
        """
        ...


class Executor(Protocol):
    """The interface of an executor: it does the jobs of a run, in this process or in worker processes.

    Attributes
    ----------
    workers
        number of frames worked on at a time.
    max_pending
        largest number of frames that may be submitted but not yet written; it limits the memory of a run.
    """

    workers: int
    max_pending: int

    def submit(self, function: Callable[..., Any], *args: Any, affinity: Future | None = None) -> Future:
        """Submit the job `function(cache, *args)`, where `cache` is the FrameCache of the process that does it.

        Parameters
        ----------
        function
            the function to call; other processes must be able to import it.
        *args
            the function's arguments after the cache; they must be picklable.
        affinity
            an earlier job that is finished. The new job prefers the process that did it, which still holds the frame's data. None
            if any process may do the new job.

        Returns
        -------
        The job; its `result()` waits for the value of the function.
        """
        ...

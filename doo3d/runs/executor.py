"""The interface between a run and the processes that do its work: executors, futures, lost workers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol


class WorkerLost(Exception):
    """Error of a job whose worker died twice while doing it, such as from lack of memory.

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
    """Interface of what does the jobs of a run: this process, or worker processes.

    Attributes
    ----------
    workers
        number of frames worked on at a time.
    max_pending
        largest number of frames that may be in progress (submitted, and not yet written); bounds the memory of a run.
    """

    workers: int
    max_pending: int

    def submit(self, function: Callable[..., Any], *args: Any, affinity: Future | None = None) -> Future:
        """Submit the job `function(cache, *args)`, where `cache` is the FrameCache of the process that does it.

        Parameters
        ----------
        function
            importable by other processes.
        *args
            arguments after the cache; can be pickled.
        affinity
            a finished job. The new job prefers the process that did it, which still holds the frame's data. None for any process.

        Returns
        -------
        The job; its `result()` waits for the value of the function.
        """
        ...

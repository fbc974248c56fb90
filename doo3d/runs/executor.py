"""The interface between a run and the processes that do its work: executors, futures, lost workers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol


class WorkerLost(Exception):
    """A job that killed its worker, twice. The message is a sentence; `code` is the code of the frame's error."""

    code = "worker-lost"


class Future(Protocol):
    """A submitted job."""

    def result(self) -> Any:
        """Wait for the job and return its result.

        Raises
        ------
        WorkerLost : the job's worker died, repeatedly. InputError : no workers are left.
        """
        ...


class Executor(Protocol):
    """Processes that do jobs.

    Attributes
    ----------
    workers
        number of frames worked on at a time.
    max_pending
        number of frames between reading and writing at most; bounds the memory of a run.
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
            a finished job; the new job goes to the same worker, which holds its frame, if that is still alive.
        """
        ...

"""Jobs done by this process, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from .executor import Call, Future, do_calls
from .frame_cache import FrameCache


@dataclass(frozen=True)
class _DeferredJob:
    """A job that is done when its result is asked for."""

    cache: FrameCache
    function: Callable[..., Any]
    calls: Sequence[Call]

    def done(self) -> bool:
        """Return False: there is always work to do before the result is there."""
        return False

    def result(self) -> list[Any]:
        """Do the job now and return the values of its function; each call does the job again."""
        return do_calls(self.cache, self.function, self.calls)


class SerialExecutor:
    """Executor that does all jobs of a run in this process, one at a time.

    Attributes
    ----------
    workers, max_jobs, max_frames_per_job
        1 each: one frame is worked on at a time and none is waiting, so that each frame is written as soon as it is done.
    cache
        the FrameCache passed to every job.
    """

    workers, max_jobs, max_frames_per_job = 1, 1, 1

    def __init__(self) -> None:
        self.cache = FrameCache()

    def submit(self, function: Callable[..., Any], calls: Sequence[Call], affinity: Future | None = None) -> Future:
        """Return the job, which is carried out in this process when its `result()` is called.

        `function(cache, *call)` is called with the FrameCache of this executor, in which a job finds what earlier jobs loaded.
        `affinity` has no effect, since this process does all jobs.
        """
        return _DeferredJob(self.cache, function, calls)

"""Jobs done by this process, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from .executor import Call, Future, WorkerTooSlow
from .frame_cache import FrameCache
from .time_limit import TimeLimitReached, time_limit


@dataclass(frozen=True)
class _DeferredJob:
    """A job that is done when its result is asked for."""

    cache: FrameCache
    function: Callable[..., Any]
    calls: Sequence[Call]
    seconds_per_call: float | None

    def done(self) -> bool:
        """Return False: there is always work to do before the result is there."""
        return False

    def result(self) -> list[Any]:
        """Do the job now and return the values of its function; each call does the job again."""
        return [self._value(call) for call in self.calls]

    def _value(self, call: Call) -> Any:
        try:
            with time_limit(self.seconds_per_call):
                return self.function(self.cache, *call)
        except TimeLimitReached as error:
            return WorkerTooSlow(str(error))


class SerialExecutor:
    """Executor that does all jobs of a run in this process, one at a time.

    Parameters
    ----------
    seconds_per_call
        s that a call of a job's function may take; then it is interrupted. None for no limit.

    Attributes
    ----------
    workers, max_jobs, max_frames_per_job
        1 each: one frame is worked on at a time and none is waiting, so that each frame is written as soon as it is done.
    cache
        the FrameCache passed to every job.
    """

    workers, max_jobs, max_frames_per_job = 1, 1, 1

    def __init__(self, seconds_per_call: float | None = None) -> None:
        self.cache = FrameCache()
        self._seconds_per_call = seconds_per_call

    def submit(self, function: Callable[..., Any], calls: Sequence[Call], affinity: Future | None = None) -> Future:
        """Return the job, which is carried out in this process when its `result()` is called.

        `function(cache, *call)` is called with the FrameCache of this executor, in which a job finds what earlier jobs loaded.
        `affinity` has no effect, since this process does all jobs.
        """
        return _DeferredJob(self.cache, function, calls, self._seconds_per_call)

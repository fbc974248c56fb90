"""Jobs done by this process, one after the other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .executor import Future
from .frame_cache import FrameCache


@dataclass(frozen=True)
class _DeferredJob:
    """A job that is done when its result is asked for."""

    function: Callable[..., Any]
    args: tuple[Any, ...]

    def result(self) -> Any:
        """Do the job now and return the value of its function; each call does the job again."""
        return self.function(*self.args)


class SerialExecutor:
    """Executor that does all jobs of a run in this process, one at a time.

    Attributes
    ----------
    workers, max_pending
        1 each: one frame is worked on at a time and none is waiting.
    cache
        the FrameCache passed to every job.
    """

    workers, max_pending = 1, 1

    def __init__(self) -> None:
        self.cache = FrameCache()

    def submit(self, function: Callable[..., Any], *args: Any, affinity: Future | None = None) -> Future:
        """Return the job `function(cache, *args)`, which is carried out in this process when its `result()` is called.

        `cache` is the FrameCache of this executor, in which a job finds what earlier jobs loaded. `affinity` has no effect, since
        this process does all jobs.
        """
        return _DeferredJob(function, (self.cache, *args))

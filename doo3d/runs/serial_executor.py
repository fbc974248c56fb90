"""Execute jobs in this process: detect frame after frame, while threads read the next and draw the last."""

from collections.abc import Callable, Sequence
from concurrent import futures
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from ..inputs import FrameData, FrameRef
from .executor import Call, Future, WorkerTooSlow
from .frame_cache import FrameCache
from .helper_thread import HelperThread
from .time_limit import TimeLimitReached, time_limit

MAX_JOBS = 4
"""Greatest number of frames that are read ahead, detected or drawn: enough to even out their times, in little memory."""


class _ReadAhead:
    """The loader of a frame that a thread is reading in advance.

    frame : the frame. reader : the thread.
    """

    def __init__(self, frame: FrameRef, reader: HelperThread) -> None:
        self._frame, self._reader = frame, reader
        self._loaded: futures.Future[FrameData] | None = reader.submit(frame.load)

    def __call__(self) -> FrameData:
        """Wait for the frame's data and return them, without keeping them; a further call reads the frame again."""
        loaded, self._loaded = self._loaded, None
        if loaded is None:
            return self._frame.load()
        try:
            return loaded.result()
        finally:
            if not loaded.done():  # the wait was given up
                self._reader.replace()
            del loaded  # an exception would hold this call, and this call the exception


@dataclass(frozen=True)
class _Job:
    """A job whose values come from functions without arguments, which do the work or wait for a thread.

    begun : the tasks of the thread, if it does the job. give_up : called if a value takes too long.
    """

    values: Sequence[Callable[[], Any]]
    limit: Callable[[], AbstractContextManager[None]]
    begun: Sequence[futures.Future[Any]] = ()
    give_up: Callable[[], None] = lambda: None

    def done(self) -> bool:
        """Return whether a thread has done the job; False for a job that `result` itself will do."""
        return bool(self.begun) and all(value.done() for value in self.begun)

    def result(self) -> list[Any]:
        """Return the values of the job's function."""
        return [self._value(value) for value in self.values]

    def _value(self, value: Callable[[], Any]) -> Any:
        try:
            with self.limit():
                return value()
        except TimeLimitReached as error:
            self.give_up()
            return WorkerTooSlow(str(error))


class SerialExecutor:
    """Executor that does all jobs of a run in this process.

    The thread that asks for the results does the jobs, one at a time. Meanwhile one thread reads the frames of the next jobs, and
    another does the jobs with an affinity, which draw. Call `close` in the end.

    Parameters
    ----------
    seconds_per_call
        time in s after which a call of a job's function is interrupted; None for no limit.

    Attributes
    ----------
    workers, max_frames_per_job
        1 each: one frame is detected at a time, and each frame is written as soon as it is done.
    max_jobs
        greatest number of frames in memory.
    works_here
        True, since the caller's thread does the jobs.
    cache
        the FrameCache passed to every job.
    """

    workers, max_jobs, max_frames_per_job, works_here = 1, MAX_JOBS, 1, True

    def __init__(self, seconds_per_call: float | None = None) -> None:
        self.cache = FrameCache()
        self._seconds_per_call = seconds_per_call
        self._reader, self._drawer = HelperThread(), HelperThread()

    def submit(self, function: Callable[..., Any], calls: Sequence[Call], affinity: Future | None = None) -> Future:
        """Return the job, which runs when its `result()` is called, or in a thread if it follows another (`affinity`).

        `function(cache, *call)` is called with the FrameCache of this executor, in which a job finds what earlier jobs loaded.
        Frames among the arguments are read ahead.
        """
        if affinity is not None:
            begun = [self._drawer.submit(function, self.cache, *call) for call in calls]
            return _Job([each.result for each in begun], self._limit, begun, self._drawer.replace)
        ahead = [tuple(self._read_ahead(each) if isinstance(each, FrameRef) else each for each in call) for call in calls]
        return _Job([partial(function, self.cache, *call) for call in ahead], self._limit)

    def close(self) -> None:
        """End the threads; tasks not yet started are dropped."""
        self._reader.close()
        self._drawer.close()

    def _read_ahead(self, frame: FrameRef) -> FrameRef:
        return replace(frame, loader=_ReadAhead(frame, self._reader))

    def _limit(self) -> AbstractContextManager[None]:
        return time_limit(self._seconds_per_call)

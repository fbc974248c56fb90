"""Jobs done by this process: frames are detected one after the other, while the next are read and the last are drawn."""

from collections.abc import Callable, Sequence
from concurrent import futures
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from typing import Any

from ..inputs import FrameData, FrameRef
from .executor import Call, Future, WorkerTooSlow
from .frame_cache import FrameCache
from .helper_thread import HelperThread
from .time_limit import TimeLimitReached, time_limit

MAX_JOBS = 4
"""Frames that are being read ahead, detected or drawn: enough to even out the time that they take, in little memory."""


class _ReadAhead:
    """The loader of a frame that a thread has begun to read.

    frame : the frame. reader : the thread.
    """

    def __init__(self, frame: FrameRef, reader: HelperThread) -> None:
        self._frame, self._reader = frame, reader
        self._loaded: futures.Future[FrameData] | None = reader.submit(frame.load)

    def __call__(self) -> FrameData:
        """Wait for the frame's data and return them; they are not kept. A call after that reads the frame anew."""
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
class _DeferredJob:
    """A job that is done when its result is asked for."""

    cache: FrameCache
    function: Callable[..., Any]
    calls: Sequence[Call]
    limit: Callable[[], AbstractContextManager[None]]

    def done(self) -> bool:
        """Return False: there is always work to do before the result is there."""
        return False

    def result(self) -> list[Any]:
        """Do the job now and return the values of its function; each call does the job again."""
        return [self._value(call) for call in self.calls]

    def _value(self, call: Call) -> Any:
        try:
            with self.limit():
                return self.function(self.cache, *call)
        except TimeLimitReached as error:
            return WorkerTooSlow(str(error))


@dataclass(frozen=True)
class _BegunJob:
    """A job that a thread has begun."""

    values: Sequence[futures.Future[Any]]
    helper: HelperThread
    limit: Callable[[], AbstractContextManager[None]]

    def done(self) -> bool:
        """Return whether all calls are done."""
        return all(value.done() for value in self.values)

    def result(self) -> list[Any]:
        """Wait for the values of the job's function and return them."""
        return [self._value(value) for value in self.values]

    def _value(self, value: futures.Future[Any]) -> Any:
        try:
            with self.limit() if not value.done() else nullcontext():
                return value.result()
        except TimeLimitReached as error:
            self.helper.replace()
            return WorkerTooSlow(str(error))


class SerialExecutor:
    """Executor that does all jobs of a run in this process.

    Jobs are done one at a time by the thread that asks for their results. Meanwhile one thread reads the frames of the next jobs,
    and another does jobs that follow others, which draw. Call `close` in the end.

    Parameters
    ----------
    seconds_per_call
        s that a call of a job's function may take; then it is interrupted. None for no limit.

    Attributes
    ----------
    workers, max_frames_per_job
        1 each: one frame is detected at a time, and each frame is written as soon as it is done.
    max_jobs
        frames that are in memory at a time.
    works_here
        True: the caller does the jobs.
    cache
        the FrameCache passed to every job.
    """

    workers, max_jobs, max_frames_per_job, works_here = 1, MAX_JOBS, 1, True

    def __init__(self, seconds_per_call: float | None = None) -> None:
        self.cache = FrameCache()
        self._seconds_per_call = seconds_per_call
        self._reader, self._drawer = HelperThread(), HelperThread()

    def submit(self, function: Callable[..., Any], calls: Sequence[Call], affinity: Future | None = None) -> Future:
        """Return the job, which is carried out when its `result()` is called, or by a thread if it follows another (`affinity`).

        `function(cache, *call)` is called with the FrameCache of this executor, in which a job finds what earlier jobs loaded.
        Frames among the arguments are read ahead.
        """
        if affinity is not None:
            begun = [self._drawer.submit(function, self.cache, *call) for call in calls]
            return _BegunJob(begun, self._drawer, self._limit)
        ahead = [tuple(self._read_ahead(each) if isinstance(each, FrameRef) else each for each in call) for call in calls]
        return _DeferredJob(self.cache, function, ahead, self._limit)

    def close(self) -> None:
        """End the threads; what they have not begun is dropped."""
        self._reader.close()
        self._drawer.close()

    def _read_ahead(self, frame: FrameRef) -> FrameRef:
        return replace(frame, loader=_ReadAhead(frame, self._reader))

    def _limit(self) -> AbstractContextManager[None]:
        return time_limit(self._seconds_per_call)

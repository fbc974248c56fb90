"""Jobs done by this process: frames are detected one after the other, while the next are read and the last are drawn."""

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
class _Job:
    """A job whose values come from functions without arguments: those that do it now, or those that wait for a thread.

    begun : what the thread does, if it has begun the job. give_up : called if a value takes too long.
    """

    values: Sequence[Callable[[], Any]]
    limit: Callable[[], AbstractContextManager[None]]
    begun: Sequence[futures.Future[Any]] = ()
    give_up: Callable[[], None] = lambda: None

    def done(self) -> bool:
        """Return whether a thread has done the job; one that is done here is never done before its result is asked for."""
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
            return _Job([each.result for each in begun], self._limit, begun, self._drawer.replace)
        ahead = [tuple(self._read_ahead(each) if isinstance(each, FrameRef) else each for each in call) for call in calls]
        return _Job([partial(function, self.cache, *call) for call in ahead], self._limit)

    def close(self) -> None:
        """End the threads; what they have not begun is dropped."""
        self._reader.close()
        self._drawer.close()

    def _read_ahead(self, frame: FrameRef) -> FrameRef:
        return replace(frame, loader=_ReadAhead(frame, self._reader))

    def _limit(self) -> AbstractContextManager[None]:
        return time_limit(self._seconds_per_call)

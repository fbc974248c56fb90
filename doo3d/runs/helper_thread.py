"""Run tasks in a thread during the detection: reading ahead, drawing, writing.

Kernels, OpenCV and file operations release Python's lock, so that the threads run in parallel.
"""

import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from contextvars import Context, copy_context
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

T = TypeVar("T")

_Task = tuple[Future[Any], Context, Callable[..., Any], tuple[Any, ...]]

CLOSE_SECONDS = 1.0
"""Time in s that the end of a run waits for an unneeded task; a task that hangs is then abandoned."""

_LEFT: list[threading.Thread] = []
"""Threads that were abandoned because their task hangs."""


def end_if_left(error: BaseException | None) -> None:
    """End the process at once, with the code of a SystemExit, if a thread was abandoned.

    Otherwise Python would abort when the thread returns from native code during shutdown.
    """
    if isinstance(error, SystemExit) and any(thread.is_alive() for thread in _LEFT):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(error.code if isinstance(error.code, int) else 1)


class HelperThread:
    """A thread that does tasks one after the other, in the order of submission; it starts with the first task.

    The thread does not keep the process alive; see `end_if_left`.
    """

    def __init__(self) -> None:
        self._tasks: SimpleQueue[_Task | None] = SimpleQueue()
        self._thread: threading.Thread | None = None

    def submit(self, function: Callable[..., T], *arguments: Any) -> Future[T]:
        """Schedule a call of a function; return the future of its value or exception."""
        future = Future[T]()
        self._tasks.put((future, copy_context(), function, arguments))
        if self._thread is None:
            self._begin()
        return future

    def replace(self) -> None:
        """Abandon the thread with the task in which it hangs; a new thread does the waiting tasks."""
        if self._thread is not None:
            _LEFT.append(self._thread)
        self._begin()

    def close(self) -> None:
        """Drop the waiting tasks, and end the thread after its current task, waiting at most CLOSE_SECONDS."""
        with suppress(Empty):
            while True:
                self._tasks.get_nowait()
        thread, self._thread = self._thread, None
        if thread is not None:
            self._tasks.put(None)
            with suppress(RuntimeError):  # an interrupt came before it had started
                thread.join(CLOSE_SECONDS)
            if thread.is_alive():
                _LEFT.append(thread)

    def _begin(self) -> None:
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def _work(self) -> None:
        while (task := self._tasks.get()) is not None:
            _do(*task)
            del task  # with the data of a frame
            if self._thread is not threading.current_thread():
                return


def _do(future: Future[Any] | None, context: Context, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    """Call a function and put its value, or its exception, into the future."""
    assert future is not None
    try:
        future.set_result(context.run(function, *arguments))
    except BaseException as error:
        future.set_exception(error)
        future = None  # the exception holds this call, which would hold the exception

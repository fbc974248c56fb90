"""The time that a frame may take: a frame that takes longer fails, and the run goes on with the next one."""

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from ..errors import DooError

DEFAULT_SECONDS = 60.0
"""s per frame: 300 times what a frame of 1280x720 takes, so that it ends what hangs and nothing that is slow."""

PAUSE_SECONDS = 2.0
"""s by which a clock may jump between two looks at it; more means that the whole process was stopped or the computer slept, which
counts for no frame."""

_AGAIN_SECONDS = 1.0  # until the frame is interrupted once more, if it has caught the interruption


class TimeLimitReached(DooError):
    """Raised inside of a frame's work once the frame has taken too long; its code is "time-limit"."""


def limit_message(seconds: float) -> str:
    """Return the sentence about a frame that was given up after so many seconds."""
    return f"took longer than {seconds:g} s and was given up"


@contextmanager
def time_limit(seconds: float | None) -> Iterator[None]:
    """Raise TimeLimitReached in the `with` block once it has taken so many seconds.

    A system call that waits, and Python code, are interrupted; a call into a library is once it returns. Time during which the
    process is stopped does not count. Nothing is limited if `seconds` is None, outside of the main thread, where the platform has
    no interval timers (Windows), and where the program uses SIGALRM itself.
    """
    if (
        seconds is None
        or not hasattr(signal, "setitimer")
        or threading.current_thread() is not threading.main_thread()
        or signal.getsignal(signal.SIGALRM) not in (signal.SIG_DFL, None)
    ):
        yield
        return
    due, used, ended = time.monotonic() + seconds, time.process_time(), False

    def ring(number: int, frame: FrameType | None) -> None:
        nonlocal due, used
        if ended:
            return
        late, work = time.monotonic() - due, time.process_time() - used
        was_stopped = late > PAUSE_SECONDS and work < late / 2  # not late for a library's computing: the frame gets its time anew
        again = seconds if was_stopped else _AGAIN_SECONDS
        due, used = time.monotonic() + again, time.process_time()
        signal.setitimer(signal.ITIMER_REAL, again)
        if not was_stopped:
            raise TimeLimitReached(limit_message(seconds), code="time-limit")

    former = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        ended = True
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, former)

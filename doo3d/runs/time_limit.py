"""Limit the time of a frame: a frame that takes longer fails, and the run continues with the next one."""

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from ..errors import DooError

DEFAULT_SECONDS = 60.0
"""Default time limit of a frame in s: 300 times the time of a 1280x720 frame, so that it ends frames that hang, not slow ones."""

PAUSE_SECONDS = 2.0
"""Greatest step of the clock in s between two checks; a longer step means that the process was suspended or the computer slept,
which does not count."""

_AGAIN_SECONDS = 1.0  # until the frame is interrupted once more, if it has caught the interruption


class TimeLimitReached(DooError):
    """The error that interrupts a frame that takes too long; its code is "time-limit"."""


def limit_message(seconds: float) -> str:
    """Return the message for a frame that was aborted after a number of seconds."""
    return f"took longer than {seconds:g} s and was given up"


@contextmanager
def time_limit(seconds: float | None) -> Iterator[None]:
    """Raise TimeLimitReached in a `with` block once it has taken longer than `seconds`.

    Python code and waiting system calls are interrupted at once, a call into a library when it returns. Time during which the
    process is suspended does not count. There is no limit if `seconds` is None, outside the main thread, on platforms without
    interval timers (Windows), and if the program uses SIGALRM itself.
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

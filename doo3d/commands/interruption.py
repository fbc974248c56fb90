"""Handle Ctrl-C and SIGTERM during a run: print one line with the command that resumes it."""

from __future__ import annotations

import shlex
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

from .exit_codes import INTERRUPTED, TERMINATED
from .progress_bars import remove_bars

if TYPE_CHECKING:
    from .progress import Reporter


class Interruption:
    """The state of a run for the line printed on Ctrl-C or SIGTERM.

    Attributes
    ----------
    reporter
        the reporter of the run; None before the run starts.
    is_terminated
        whether it was interrupted by SIGTERM, as from a scheduler, and not by Ctrl-C.
    """

    reporter: Reporter | None = None
    is_terminated = False

    def line(self) -> str:
        """Return the line with the number of finished frames and the command that resumes the run."""
        finished, total = (self.reporter.finished, self.reporter.total) if self.reporter else (0, 0)
        state = f": {finished} of {total} frames are finished" if self.reporter else " before the first frame"
        word = "terminated" if self.is_terminated else "interrupted"
        return f"doo3d: {word}{state}; to go on: {self._command(bool(finished))}"

    def terminate(self, *_: object) -> None:
        """Handle SIGTERM: interrupt the run like Ctrl-C; a second SIGTERM ends the process."""
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        self.is_terminated = True
        raise KeyboardInterrupt

    @staticmethod
    def _command(has_results: bool) -> str:
        """Return the command line of this process, without --restart if the new run has written results."""
        words = ["doo3d", *(word for word in sys.argv[1:] if not (has_results and word == "--restart"))]
        return subprocess.list2cmdline(words) if sys.platform == "win32" else shlex.join(words)


@contextmanager
def interruptible() -> Iterator[Interruption]:
    """Yield an Interruption for a `with` block; on Ctrl-C or SIGTERM print its line on stderr and exit with code 130 or 143."""
    interruption = Interruption()
    handles = threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    if handles:
        signal.signal(signal.SIGTERM, interruption.terminate)
    try:
        with unmasked_interrupts():
            yield interruption
    except KeyboardInterrupt:
        remove_bars()
        typer.echo(interruption.line(), err=True)
        raise typer.Exit(TERMINATED if interruption.is_terminated else INTERRUPTED) from None
    finally:
        if handles:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)


@contextmanager
def unmasked_interrupts() -> Iterator[None]:
    """Raise the original KeyboardInterrupt if Ctrl-C makes the loading of a compiled module fail with another error."""
    try:
        yield
    except (ImportError, SystemError) as error:
        cause: BaseException | None = error
        while cause is not None:
            if isinstance(cause, KeyboardInterrupt):
                raise KeyboardInterrupt from None
            cause = cause.__cause__ or cause.__context__
        raise

"""What a run that is interrupted with Ctrl-C prints: one line, with the command to go on."""

from __future__ import annotations

import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

from .exit_codes import INTERRUPTED
from .progress_bars import remove_bars

if TYPE_CHECKING:
    from .progress import Reporter


class Interruption:
    """What is known of a run for the line printed on Ctrl-C.

    Attributes
    ----------
    reporter
        the reporter of the run; None before it has begun.
    """

    reporter: Reporter | None = None

    def line(self) -> str:
        """Return the line: how many frames are finished, and the command to go on."""
        finished, total = (self.reporter.finished, self.reporter.total) if self.reporter else (0, 0)
        state = f": {finished} of {total} frames are finished" if self.reporter else " before the first frame"
        return f"doo3d: interrupted{state}; to go on: {self._command(bool(finished))}"

    @staticmethod
    def _command(has_results: bool) -> str:
        """Return the command of this process, without --restart once results of the new run are there."""
        words = ["doo3d", *(word for word in sys.argv[1:] if not (has_results and word == "--restart"))]
        return subprocess.list2cmdline(words) if sys.platform == "win32" else shlex.join(words)


@contextmanager
def interruptible() -> Iterator[Interruption]:
    """Yield an Interruption for the duration of a `with` block; on Ctrl-C print its line on stderr and exit with code 130."""
    interruption = Interruption()
    try:
        with unmasked_interrupts():
            yield interruption
    except KeyboardInterrupt:
        remove_bars()
        typer.echo(interruption.line(), err=True)
        raise typer.Exit(INTERRUPTED) from None


@contextmanager
def unmasked_interrupts() -> Iterator[None]:
    """Raise the KeyboardInterrupt behind an error that a compiled module raises if Ctrl-C comes while it is loaded."""
    try:
        yield
    except (ImportError, SystemError) as error:
        cause: BaseException | None = error
        while cause is not None:
            if isinstance(cause, KeyboardInterrupt):
                raise KeyboardInterrupt from None
            cause = cause.__cause__ or cause.__context__
        raise

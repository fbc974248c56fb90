"""Capture the messages that C libraries write to the process's stderr, for use in exceptions."""

import os
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass
from typing import IO, Any, cast

_ONE_AT_A_TIME = threading.RLock()  # there is one stderr in a process


def _renew_lock() -> None:
    """Make a new lock in a forked process, since a thread of its parent may have held the old one."""
    global _ONE_AT_A_TIME
    _ONE_AT_A_TIME = threading.RLock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew_lock)

# files on stderr as it was, the last one on the present one; never closed, since others may hold them
_beside: list[IO[str]] = []


@dataclass
class NativeOutput:
    """The output captured by `capture_native_output`: `text`, without outer blanks; empty until the `with` block has ended."""

    text: str = ""


class _OfThisThread:
    """A replacement of stdout that keeps the text written by this thread until `end`; all other text goes to stdout.

    The class is not an IOBase, since Python closes an unused IOBase from whichever thread collects it.
    """

    def __init__(self, stdout: Any) -> None:
        self._stdout, self._thread, self._texts = stdout, threading.get_ident(), [""]

    def write(self, text: str) -> int:
        """Keep a text of this thread; write other text to stdout."""
        if threading.get_ident() != self._thread:
            return 0 if self._stdout is None else int(self._stdout.write(text))
        self._texts.append(str(text))
        return len(text)

    def end(self) -> str:
        """Return the text that this thread wrote; from now on, its text goes to stdout, too."""
        self._thread = -1
        return "".join(self._texts)

    def close(self) -> None:
        """Do nothing: stdout belongs to the program and stays open."""

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of stdout, such as `isatty` or `flush`."""
        return getattr(self._stdout, name)


@contextmanager
def capture_native_output() -> Iterator[NativeOutput]:
    """Capture what C libraries write to stderr (file descriptor 2) and Python to stdout inside a `with` block.

    Yields a NativeOutput; its `text` is filled when the block ends. Other threads can still write with Python, but messages of
    their libraries to stderr are captured as well, so the block should have only one call of a library.
    """
    captured = NativeOutput()
    with _ONE_AT_A_TIME, tempfile.TemporaryFile() as file:
        out = _OfThisThread(sys.stdout)
        sys.stderr.flush()
        saved = os.dup(2)
        try:
            with redirect_stdout(cast(IO[str], out)), _stderr_beside(saved):
                os.dup2(file.fileno(), 2)
                try:
                    yield captured
                finally:
                    os.dup2(saved, 2)
        finally:
            os.close(saved)
            file.seek(0)
            captured.text = (file.read().decode(errors="replace") + out.end()).strip()


def _stderr_beside(saved: int) -> Any:
    """Return a context in which Python's stderr still writes to the original stderr; `saved` : copy of its file descriptor."""
    with suppress(OSError, ValueError, AttributeError):
        if sys.stderr.fileno() == 2:
            if not (_beside and os.path.sameopenfile(_beside[-1].fileno(), saved)):
                _beside.append(open(os.dup(saved), "w", buffering=1, encoding=sys.stderr.encoding, errors=sys.stderr.errors))
            return redirect_stderr(_beside[-1])
    return nullcontext()

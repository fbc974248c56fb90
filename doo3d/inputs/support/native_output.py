"""Capture of the error messages that C libraries write to the process's stderr, for use in exceptions."""

from __future__ import annotations

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
    """Give a forked process a lock of its own: a thread of its parent may have held the former."""
    global _ONE_AT_A_TIME
    _ONE_AT_A_TIME = threading.RLock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew_lock)

# files on stderr as it was, the last one on the present one; never closed, since others may hold them
_beside: list[IO[str]] = []


@dataclass
class NativeOutput:
    """What `capture_native_output` captured: `text`, stripped of blanks at its ends; empty until the `with` block has ended."""

    text: str = ""


class _OfThisThread:
    """What takes the place of stdout: it keeps what this thread writes until `end`; everything else is passed to stdout.

    It is no IOBase: Python closes one that is no longer used, from whichever thread collects it.
    """

    def __init__(self, stdout: Any) -> None:
        self._stdout, self._thread, self._texts = stdout, threading.get_ident(), [""]

    def write(self, text: str) -> int:
        """Write a text here, or to stdout."""
        if threading.get_ident() != self._thread:
            return 0 if self._stdout is None else int(self._stdout.write(text))
        self._texts.append(str(text))
        return len(text)

    def end(self) -> str:
        """Return what this thread wrote; from here on its texts are passed to stdout as well."""
        self._thread = -1
        return "".join(self._texts)

    def close(self) -> None:
        """Leave stdout open: it belongs to the program."""

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of stdout, such as `isatty` or `flush`."""
        return getattr(self._stdout, name)


@contextmanager
def capture_native_output() -> Iterator[NativeOutput]:
    """Capture what C libraries write to stderr (file descriptor 2) and Python to stdout inside a `with` block.

    Yields a NativeOutput; its `text` is filled when the block ends. Other threads go on writing with Python; what their libraries
    write to stderr is captured as well: keep the block to one call of a library.
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
    """Return a context in which Python's stderr stays where it is, if it is the process's; `saved` is a copy of the latter."""
    with suppress(OSError, ValueError, AttributeError):
        if sys.stderr.fileno() == 2:
            if not (_beside and os.path.sameopenfile(_beside[-1].fileno(), saved)):
                _beside.append(open(os.dup(saved), "w", buffering=1, encoding=sys.stderr.encoding, errors=sys.stderr.errors))
            return redirect_stderr(_beside[-1])
    return nullcontext()

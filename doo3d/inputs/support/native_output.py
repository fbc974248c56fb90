"""Capture of the error messages that C libraries write to the process's stderr, for use in exceptions."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from io import StringIO


@dataclass
class NativeOutput:
    """What `capture_native_output` captured: `text`, stripped of blanks at its ends; empty until the `with` block has ended."""

    text: str = ""


@contextmanager
def capture_native_output() -> Iterator[NativeOutput]:
    """Capture what C libraries write to stderr (file descriptor 2) and Python to stdout inside a `with` block.

    Yields a NativeOutput; its `text` is filled when the block ends. The redirection affects the whole process: keep the block to
    one call of a library.
    """
    captured, out = NativeOutput(), StringIO()
    sys.stderr.flush()
    with tempfile.TemporaryFile() as file, redirect_stdout(out):
        saved = os.dup(2)
        try:
            os.dup2(file.fileno(), 2)
            yield captured
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            file.seek(0)
            captured.text = (file.read().decode(errors="replace") + out.getvalue()).strip()

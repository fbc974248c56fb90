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
    """Text written inside the block; complete after the block has ended."""

    text: str = ""


@contextmanager
def capture_native_output() -> Iterator[NativeOutput]:
    """Capture the text written to file descriptor 2 and to Python's stdout inside the block.

    The redirection affects the whole process: keep the block to one call of a library.
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

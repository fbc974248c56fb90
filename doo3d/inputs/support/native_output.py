"""C libraries write what went wrong to the process's stderr, past Python: here it is caught, so that it can be said."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from io import StringIO


@dataclass
class Said:
    """What was written meanwhile, complete when the block has ended."""

    text: str = ""


@contextmanager
def capture_native_output() -> Iterator[Said]:
    """Catch what is written to file descriptor 2 and to Python's stdout inside the block.

    The whole process is deaf meanwhile: keep the block to one call of a library.
    """
    said, out = Said(), StringIO()
    sys.stderr.flush()
    with tempfile.TemporaryFile() as file, redirect_stdout(out):
        saved = os.dup(2)
        try:
            os.dup2(file.fileno(), 2)
            yield said
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            file.seek(0)
            said.text = (file.read().decode(errors="replace") + out.getvalue()).strip()

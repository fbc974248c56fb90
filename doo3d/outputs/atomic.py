"""Files that are there whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
from pathlib import Path

PREFIX = ".doo3d-"  # of temporary names; a run that was killed may leave one behind


def write_bytes(path: Path, data: bytes) -> None:
    """Write under a temporary name in the same folder, flush to the disk, then take the name.

    Raises
    ------
    OSError : no room, no permission; what was at `path` before is untouched.
    """
    temporary = path.parent / f"{PREFIX}{os.getpid()}-{secrets.token_hex(4)}.tmp"
    try:
        with temporary.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise


def write_text(path: Path, text: str) -> None:
    """The same for text, in UTF-8 with the line ends as they are."""
    write_bytes(path, text.encode("utf-8"))

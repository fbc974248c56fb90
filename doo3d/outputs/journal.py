"""The journal of a run: one line per finished frame, append-only, so that a killed run loses nothing."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from .detection_json import finite


class Journal:
    """The journal of a run: a file to which one JSON object per line is appended, one for each finished frame.

    A line counts only if it is complete. An incomplete line at the end, left by a killed process, is overwritten by the next one.
    To continue an existing file, call `read` before `add`; otherwise the first `add` overwrites it from its start.

    Parameters
    ----------
    path
        the file; created by the first `add`.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._size = 0

    def read(self) -> list[dict[str, Any]]:
        """Return the objects of all lines, in order, up to the first line that is incomplete or not a JSON object.

        The next `add` appends after the last of these lines. Without a file, the list is empty.
        """
        entries: list[dict[str, Any]] = []
        self._size = 0
        try:
            lines = self.path.read_bytes().splitlines(keepends=True)
        except OSError:
            return entries
        for line in lines:
            try:
                values = json.loads(line) if line.endswith(b"\n") else None
            except ValueError:
                values = None
            if not isinstance(values, dict):
                break
            entries.append(values)
            self._size += len(line)
        return entries

    def add(self, values: dict[str, Any]) -> None:
        """Append a dict as one line and flush it to the disk; NaN and infinity become null.

        Raises
        ------
        OSError
            the disk is full or the file may not be written to; the line then does not count.
        """
        line = json.dumps(finite(values), ensure_ascii=False).encode("utf-8") + b"\n"
        with self.path.open("r+b" if self.path.exists() else "xb") as file:
            file.truncate(self._size)
            file.seek(self._size)
            file.write(line)
            file.flush()
            os.fsync(file.fileno())
        self._size += len(line)

    def remove(self) -> None:
        """Delete the journal's file, if it exists; the next `add` creates a new file."""
        self.path.unlink(missing_ok=True)
        self._size = 0

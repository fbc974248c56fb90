"""The journal of a run: one line per finished frame, append-only, so that a killed run loses nothing."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from .detection_json import finite


class Journal:
    """A file with one JSON object per line. A line counts once it is complete; an incomplete last line is overwritten."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._size = 0

    def read(self) -> list[dict[str, Any]]:
        """Return the objects of the file up to the first line that is not a JSON object."""
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
        """Append one line and flush it to the disk.

        Raises
        ------
        OSError : the disk is full or the file may not be written to; the line then does not count.
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
        """Delete the file."""
        self.path.unlink(missing_ok=True)
        self._size = 0

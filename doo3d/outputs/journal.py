"""What is finished of a run, a line each: only ever added to, so that a run that is killed loses nothing."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from .detection_json import finite


class Journal:
    """A file of lines of JSON. A line counts once it is on the disk whole; half a one at the end is written over."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._size = 0

    def read(self) -> list[dict[str, Any]]:
        """The objects in it, up to the first line that is none."""
        found: list[dict[str, Any]] = []
        self._size = 0
        try:
            lines = self.path.read_bytes().splitlines(keepends=True)
        except OSError:
            return found
        for line in lines:
            try:
                values = json.loads(line) if line.endswith(b"\n") else None
            except ValueError:
                values = None
            if not isinstance(values, dict):
                break
            found.append(values)
            self._size += len(line)
        return found

    def add(self, values: dict[str, Any]) -> None:
        """Write one line and flush it to the disk.

        Raises
        ------
        OSError : no room, no permission; then it does not count.
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
        """Forget all."""
        self.path.unlink(missing_ok=True)
        self._size = 0

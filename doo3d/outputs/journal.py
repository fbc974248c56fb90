"""Write and read the journal of a run: one appended line per finished frame, so that a kill loses no frame."""

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..guard.parsing import is_plain
from . import PICTURES
from .atomic import write_bytes
from .detection_json import finite

_MAX_NUMBER = 1e300  # larger integers cannot become floats


class Journal:
    """The journal of a run: a file to which one JSON object per line is appended, one for each finished frame.

    A line counts only if it is complete. An incomplete line at the end, left by a killed process, is overwritten by the next one.
    A frame that is processed again gets another line; its last one counts. To continue an existing file, call `read` before
    `add`; otherwise the first `add` overwrites it from its start. A symbolic link in place of the file is replaced by a file,
    never written through.

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

        The next `add` appends after the last of these lines. Objects that are not records of a frame are left out. Without a
        file, the list is empty.
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
            except (ValueError, RecursionError):
                values = None
            if not isinstance(values, dict):
                break
            if is_frame_line(values) and is_plain(values):
                entries.append(values)
            self._size += len(line)
        return entries

    def add(self, values: dict[str, Any]) -> None:
        """Append a dict as one line and flush it to the disk; NaN and infinity become null.

        Raises
        ------
        OSError
            the disk is full or the file may not be written to; the line is then ignored when the journal is read.
        """
        line = _encoded(values)
        if self.path.is_symlink():
            write_bytes(self.path, self.path.read_bytes()[: self._size] if self._size else b"")
        flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
        with os.fdopen(os.open(self.path, flags, 0o666), "r+b") as file:
            file.truncate(self._size)
            file.seek(self._size)
            file.write(line)
            file.flush()
            os.fsync(file.fileno())
        self._size += len(line)

    def rewrite(self, entries: Iterable[dict[str, Any]]) -> None:
        """Replace the whole file by these lines, atomically.

        Raises
        ------
        OSError
            the disk is full or the folder may not be written to; the file is then as before.
        """
        content = b"".join(map(_encoded, entries))
        write_bytes(self.path, content)
        self._size = len(content)

    def remove(self) -> None:
        """Delete the journal's file, if it exists; the next `add` creates a new file."""
        self.path.unlink(missing_ok=True)
        self._size = 0


def _encoded(values: dict[str, Any]) -> bytes:
    # a file name that is not UTF-8 holds surrogates, which json.loads takes from bytes as they are
    return json.dumps(finite(values), ensure_ascii=False).encode("utf-8", "surrogatepass") + b"\n"


def is_frame_line(values: dict[str, Any]) -> bool:
    """Return whether a line of a journal is the record of a frame, with values of the right types."""
    return (
        isinstance(values.get("name"), str)
        and values.get("status") in ("ok", "failed")
        and all(isinstance(values.get(key), str) for key in ("source", "units"))
        and all(isinstance(values.get(key), str | None) for key in ("error", "code"))
        and all(_is_number(values.get(key)) for key in ("timestamp", "seconds", "occluded"))
        and values.get("seconds") is not None
        and values.get("picture") in (None, *PICTURES)
        and all(_are_numbers(values.get(key)) for key in ("lengths", "radii", "confidences"))
        and isinstance(values.get("doubtful"), list)
        and all(_are_numbers(each) and len(each) == 2 for each in values["doubtful"])
        and all(_is_number(values.get(key)) for key in ("objects", "junctions"))
        and isinstance(values.get("notes"), list)
        and all(isinstance(note, str) for note in values["notes"])
        and isinstance(values.get("stages"), dict)
        and isinstance(values.get("evidence"), dict)
        and all(_is_number(seconds) for seconds in values["stages"].values())
    )


def _are_numbers(values: Any) -> bool:
    return isinstance(values, list) and all(map(_is_number, values))


def _is_number(value: Any) -> bool:
    """Return whether a value is a number or null, which stands for an unknown one."""
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < _MAX_NUMBER)

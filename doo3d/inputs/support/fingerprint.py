"""Whether an input is still what it was, told without reading it."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

_RESULTS = ("manifest.json", "config.yaml")  # what a run leaves, which may lie inside its input


def fingerprint(paths: Iterable[Path]) -> str:
    """SHA-256 over path, size and time of change of all files at `paths`, folders with all that is in them.

    Folders of results are left out. One that cannot be looked at counts as such.
    """
    found = sorted({file for path in paths for file in _files(path)})
    return hashlib.sha256("\n".join(map(_state, found)).encode(errors="surrogateescape")).hexdigest()


def _files(path: Path) -> Iterator[str]:
    if not path.is_dir():
        yield os.path.abspath(path)
        return
    for folder, folders, files in os.walk(path):
        if all(name in files for name in _RESULTS):
            folders.clear()
            continue
        yield from (os.path.abspath(os.path.join(folder, file)) for file in files)


def _state(file: str) -> str:
    try:
        stat = os.stat(file)
    except OSError:
        return f"{file} ?"
    return f"{file} {stat.st_size} {stat.st_mtime_ns}"

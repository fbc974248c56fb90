"""Fingerprint of input files, for detecting changes without reading their content."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

_RESULT_FILES = ("manifest.json", "config.yaml")  # mark a folder of results, which may lie inside the input


def fingerprint(paths: Iterable[Path]) -> str:
    """Return a SHA-256 (hex) of the paths, sizes and modification times of input files, to detect changes.

    No file content is read. Folders among `paths` count with all files below them, except folders of doo3d's results (those
    with manifest.json and config.yaml). A file whose size and time cannot be read counts with its path alone.
    """
    files = sorted({file for path in paths for file in _files(path)})
    return hashlib.sha256("\n".join(map(_state, files)).encode(errors="surrogateescape")).hexdigest()


def _files(path: Path) -> Iterator[str]:
    if not path.is_dir():
        yield os.path.abspath(path)
        return
    for folder, folders, files in os.walk(path):
        if all(name in files for name in _RESULT_FILES):
            folders.clear()
            continue
        yield from (os.path.abspath(os.path.join(folder, file)) for file in files)


def _state(file: str) -> str:
    try:
        stat = os.stat(file)
    except OSError:
        return f"{file} ?"
    return f"{file} {stat.st_size} {stat.st_mtime_ns}"

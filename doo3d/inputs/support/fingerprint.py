"""Fingerprint of input files, for detecting changes without reading their content."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

_RESULT_FILES = ("manifest.json", "config.yaml")  # mark a folder of results, which may lie inside the input


def fingerprint(paths: Iterable[Path]) -> str:
    """Return a digest of input files that differs once a file was changed, added or removed.

    The digest is the SHA-256, as 64 hexadecimal digits, of the paths, sizes and modification times; no file content is read. A
    folder among `paths` stands for all files below it, except those in folders of doo3d's results (which hold manifest.json and
    config.yaml). Of a file whose size and time cannot be read, only the path enters the digest.
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

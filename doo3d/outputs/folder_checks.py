"""Checks of a run's folder and of the names of its files, before anything is written or removed."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from ..errors import InputError
from ..guard.file_names import is_file_name
from . import MANIFEST, STRANDS, SUFFIXES
from .atomic import PREFIX
from .run_identity import read_manifest
from .torn_manifest import is_torn


def lies_in_input(path: Path, source: Path) -> bool:
    """Return whether a folder that holds something else than results of a run is the input, at `source`, or part of it."""
    inside = path.is_dir() and source in (path.resolve(), *path.resolve().parents)
    return inside and any(not file.name.startswith(PREFIX) for file in path.iterdir()) and not is_of_run(path)


def is_of_run(path: Path) -> bool:
    """Return whether a folder has a manifest of doo3d, be it a torn one."""
    return read_manifest(path) is not None or is_torn(path)


def check_names(path: Path, names: Sequence[str]) -> None:
    """Raise InputError if a frame's name is used twice or cannot be that of its files; `path` is the folder of the results."""
    checked: set[str] = set()
    for name in names:
        if name in checked:
            raise InputError(
                f"two frames are called {name}: both would be written to {path / name}.json, rename one", code="frame-names-clash"
            )
        if f"{name}.json" == MANIFEST or not is_file_name(name):
            raise InputError(
                f"a frame is called {name!r}: {path / name}.json cannot be its file, rename the frame", code="frame-name-invalid"
            )
        checked.add(name)


def check_writable(path: Path) -> None:
    """Raise InputError if a folder cannot be made or written to, as far as permissions tell."""
    existing = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
    if not existing.is_dir():
        raise InputError(f"{path}: {existing} is a file, expected a folder for the results", code="out-is-file")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise InputError(
            f"{path}: no permission to write in {existing}", code="out-unwritable", remedy="give another folder with -o"
        )


def remove_files(path: Path, names: Iterable[str]) -> None:
    """Delete the files of frames in a folder; `names` are those of the frames."""
    for name in names:
        for suffix in (*SUFFIXES.values(), STRANDS):
            (path / f"{name}{suffix}").unlink(missing_ok=True)

"""Checks of a run's folder and of the names of its files, before anything is written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError
from ..guard.file_names import is_file_name
from . import MANIFEST
from .atomic import PREFIX
from .run_identity import read_manifest


def lies_in_input(path: Path, source: Path) -> bool:
    """Return whether a folder that holds something else than results of a run is the input, at `source`, or part of it."""
    inside = path.is_dir() and source in (path.resolve(), *path.resolve().parents)
    return inside and any(not file.name.startswith(PREFIX) for file in path.iterdir()) and read_manifest(path) is None


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

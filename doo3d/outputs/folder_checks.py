"""Check a run's folder and the names of its files before anything is written or removed."""

import os
from collections.abc import Iterable, Sequence
from itertools import count
from pathlib import Path

from ..errors import InputError
from ..guard.file_names import is_file_name
from . import CONFIG, JOURNAL, MANIFEST, STRANDS, SUFFIXES
from .atomic import PREFIX
from .run_identity import read_manifest
from .torn_manifest import is_torn


def lies_in_input(path: Path, source: Path) -> bool:
    """Return whether a folder is the input at `source` or part of it, unless it holds the results of a run."""
    inside = path.is_dir() and source in (path.resolve(), *path.resolve().parents)
    return inside and any(not file.name.startswith(PREFIX) for file in path.iterdir()) and not is_of_run(path)


def is_of_run(path: Path) -> bool:
    """Return whether a folder has a manifest of doo3d, even one that a power failure cut off."""
    return read_manifest(path) is not None or is_torn(path)


def check_names(path: Path, names: Sequence[str]) -> None:
    """Raise InputError if a frame's name occurs twice or cannot be a file name; `path` is the folder of the results."""
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
    """Raise InputError if the permissions do not allow to make a folder or to write to it."""
    existing = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
    if not existing.is_dir():
        raise InputError(f"{path}: {existing} is a file, expected a folder for the results", code="out-is-file")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise InputError(
            f"{path}: no permission to write in {existing}", code="out-unwritable", remedy="give another folder with -o"
        )


def remove_files(path: Path, names: Iterable[str]) -> None:
    """Delete the files of frames in a folder; `names` are those of the frames."""
    for file in _files_of(path, names):
        file.unlink(missing_ok=True)


def folder_aside(path: Path, names: Iterable[str]) -> Path:
    """Return the folder to which the results in a folder are moved: OUT_1 for OUT, or the next free number.

    A folder that an interrupted `move_aside` began to fill is returned again. `names` are those of the frames.
    """
    path = path.resolve() if path.name in ("", "..") else path
    moved = {file.name for file in _files_of(path, names)}
    folders = (path.with_name(f"{path.name}_{number}") for number in count(1))
    return next(
        folder
        for folder in folders
        if not folder.exists() or (folder.is_dir() and {file.name for file in folder.iterdir()} <= moved)
    )


def move_aside(path: Path, names: Iterable[str], aside: Path) -> None:
    """Move the files of a run to another folder; the manifest, which marks a folder as a run's, is moved last.

    Raises
    ------
    InputError : the files cannot be moved there.
    """
    try:
        aside.mkdir(exist_ok=True)
        for file in (*_files_of(path, names), path / JOURNAL, path / CONFIG, path / MANIFEST):
            if file.exists():
                file.rename(aside / file.name)
    except OSError as error:
        raise InputError(
            f"{aside}: the results in {path} cannot be kept there ({error.strerror or error})",
            code="out-unwritable",
            remedy="give another folder with -o, or --restart to replace them",
        ) from None


def _files_of(path: Path, names: Iterable[str]) -> list[Path]:
    """Return the paths of all files that frames may have in a folder."""
    return [path / f"{name}{suffix}" for name in names for suffix in (*SUFFIXES.values(), STRANDS)]

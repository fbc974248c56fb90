"""Record the state of input files, to detect changes without reading their content."""

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ..capture import FrameRef

_RESULT_FILES = ("manifest.json", "config.yaml")  # mark a folder of results, which may lie inside the input
_OWN_PREFIX = ".doo3d-"  # of temporary files and locks of runs
_MAX_DEPTH = 8  # of a loader's arguments: wrappers around loaders, with tuples of files
_MAX_ITEMS = 64  # longer lists hold numbers or messages


class FramePaths(Mapping[str, list[str]]):
    """Mapping from the name of a frame to the absolute paths of its files, which are found when requested.

    frames : the frames of the capture.
    """

    def __init__(self, frames: Iterable[FrameRef]) -> None:
        self._frames = {frame.name: frame for frame in frames}

    def __getitem__(self, name: str) -> list[str]:
        """Return the paths of a frame."""
        return frame_paths(self._frames[name])

    def __iter__(self) -> Iterator[str]:
        """Yield the names of the frames, in the capture's order."""
        return iter(self._frames)

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self._frames)


def file_states(paths: Iterable[Path], without: Path) -> dict[str, str]:
    """Return the size and modification time of input files, as a dict absolute path -> text; no file content is read.

    A folder among `paths` stands for all files below it, except those in folders of doo3d's results (which hold manifest.json and
    config.yaml) and in the folder `without`, where the run itself writes. The text is "?" for a file whose size and time cannot
    be read.
    """
    excluded = os.path.abspath(without)
    return {file: _state(file) for file in sorted({file for path in paths for file in _files(path, excluded)})}


def frame_paths(frame: FrameRef) -> list[str]:
    """Return the absolute paths of the files that a frame is read from: its source, and those among its loader's arguments.

    Folders are left out.
    """
    paths = {os.path.abspath(path) for path in (frame.source, *_paths_in(frame.loader, _MAX_DEPTH))}
    return sorted(path for path in paths if not os.path.isdir(path))


def _paths_in(value: Any, depth: int) -> Iterator[Path]:
    """Yield the paths within a loader or its arguments."""
    items: Iterable[Any] = ()
    if isinstance(value, Path):
        yield value
    elif isinstance(value, partial):
        items = (*value.args, *value.keywords.values())
    elif isinstance(value, dict | tuple | list) and len(value) <= _MAX_ITEMS:
        items = value.values() if isinstance(value, dict) else value
    elif is_dataclass(value) and not isinstance(value, type):
        items = [getattr(value, each.name) for each in fields(value)]
    for item in items if depth else ():
        yield from _paths_in(item, depth - 1)


def _files(path: Path, excluded: str) -> Iterator[str]:
    if not path.is_dir():
        yield os.path.abspath(path)
        return
    for folder, folders, files in os.walk(path):
        is_excluded = os.path.abspath(folder) == excluded and folder != os.fspath(path)
        if is_excluded or all(name in files for name in _RESULT_FILES):
            folders.clear()
            continue
        yield from (os.path.abspath(os.path.join(folder, file)) for file in files if not file.startswith(_OWN_PREFIX))


def _state(file: str) -> str:
    try:
        stat = os.stat(file)
    except OSError:
        return "?"
    return f"{stat.st_size} {stat.st_mtime_ns}"

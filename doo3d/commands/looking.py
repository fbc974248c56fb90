"""What the commands share that make something to look at of a run."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from ..errors import InputError

Results = Annotated[Path, typer.Argument(metavar="OUT", help="What doo3d detect wrote.")]
T = TypeVar("T")


def free(path: Path, force: bool) -> None:
    """Refuse to write over a file, or into a folder that there is not.

    Raises
    ------
    InputError : the file is there and `force` is not given, or its folder is not there.
    """
    if path.is_dir():
        raise InputError(f"{path}: is a folder, expected the name of a file to write", code="out-is-folder")
    if path.exists() and not force:
        raise InputError(f"{path}: is there already: give another name with -o, or --force to write over it", code="out-exists")
    if not path.absolute().parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist", code="out-folder-missing")


def watching(frames: Sequence[T]) -> Iterable[T]:
    """The frames one after the other, with a bar on stderr where that is a terminal."""
    if len(frames) < 2 or not sys.stderr.isatty():
        return frames
    from rich.console import Console
    from rich.progress import track

    return track(frames, "", console=Console(stderr=True), transient=True)

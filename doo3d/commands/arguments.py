"""Arguments and options that several commands have, and what is done with them."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from ..errors import InputError

if TYPE_CHECKING:
    from ..config import Config
    from ..inputs import Capture, FrameRef

Preset = Annotated[str, typer.Option("--config", "-c", help="A preset (see doo3d presets) or a YAML file.")]
Overrides = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Set one field, such as merge.chains=2; repeat for more.")
]
MaskOption = Annotated[
    Path | None, typer.Option("--mask", help="The object's pixels, instead of the capture's own: an image, or a folder of them.")
]

InputOption = Annotated[
    list[str] | None,
    typer.Option(
        "--input-option", metavar="KEY=VALUE", help="How INPUT is to be read, such as depth_scale=5000; repeat for more."
    ),
]

EveryOption = Annotated[
    int, typer.Option(min=1, metavar="N", help="Of the frames left by the others, the first and then every Nth.")
]
StartOption = Annotated[
    str | None,
    typer.Option(
        metavar="PLACE",
        help="The first frame: its number from 0 (12), or from the end (-1 is the last), or a time since the first frame (12.5s; "
        "-2s is two seconds before the last).",
    ),
]
EndOption = Annotated[str | None, typer.Option(metavar="PLACE", help="The last frame, as --start; it is included.")]
FramesOption = Annotated[
    str | None,
    typer.Option(
        metavar="LIST",
        help="Frames and spans of them as for --start, both ends included: 3,7,10-20 or 2s-4.5s; a single time is the frame "
        "nearest to it.",
    ),
]


def config_of(name: str, overrides: list[str] | None) -> Config:
    """The effective configuration."""
    from ..config import load_config, parse_overrides

    return load_config(name, parse_overrides(overrides or []))


def split(names: str | None) -> list[str] | None:
    """The names of a comma-separated list."""
    return None if names is None else [name.strip() for name in names.split(",")]


def save(path: Path, content: str | bytes) -> None:
    """Write a file, or say why not."""
    from ..outputs.atomic import write_bytes

    try:
        write_bytes(path, content.encode("utf-8") if isinstance(content, str) else content)
    except OSError as error:
        raise InputError(f"{path}: cannot be written to ({error.strerror})", code="out-unwritable") from None


FrameOption = Annotated[
    str | None, typer.Option("--frame", metavar="N", help="Which frame: its name, or its number from 0; -1 is the last.")
]


def frame_of(capture: Capture, wanted: str | None, option: str = "--frame") -> FrameRef:
    """The frame that is called so, or has that number; the first without.

    Raises
    ------
    InputError : there is none.
    """
    frames = capture.frames
    for entry in frames:
        if wanted is not None and entry.name == wanted:
            return entry
    try:
        return frames[int(wanted or 0)]
    except (ValueError, IndexError):
        shown = f"{frames[0].name} to {frames[-1].name}" if len(frames) > 1 else "".join(entry.name for entry in frames)
        raise InputError(
            f"{option} {wanted}: {capture.path} has {len(frames)} frame{'s' * (len(frames) != 1)}, {shown}", code="frame-unknown"
        ) from None


def new_file(path: Path, force: bool) -> Path:
    """A place to write to.

    Raises
    ------
    InputError : something is there already, and it is not to be replaced.
    """
    if path.exists() and not force:
        raise InputError(f"{path} exists: give another name with -o, or --force to replace it", code="out-exists")
    return path


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


def with_progress(frames: Sequence[T]) -> Iterable[T]:
    """The frames one after the other, with a bar on stderr where that is a terminal."""
    if len(frames) < 2 or not sys.stderr.isatty():
        return frames
    from rich.console import Console
    from rich.progress import track

    return track(frames, "", console=Console(stderr=True), transient=True)

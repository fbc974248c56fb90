"""One frame of a capture, for the commands that look at one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError

if TYPE_CHECKING:
    from ..inputs import Capture, Entry

FrameOption = Annotated[
    str | None, typer.Option("--frame", metavar="N", help="Which frame: its name, or its number from 0; -1 is the last.")
]


def frame_of(capture: Capture, wanted: str | None, option: str = "--frame") -> Entry:
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

"""Options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError

if TYPE_CHECKING:
    from ..config import Config

Preset = Annotated[str, typer.Option("--config", "-c", help="A preset (see doo3d presets) or a YAML file.")]
Overrides = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Set one field, such as merge.chains=2; repeat for more.")
]
MaskOption = Annotated[
    Path | None, typer.Option("--mask", help="The object's pixels, instead of the capture's own: an image, or a folder of them.")
]

ReadOption = Annotated[
    list[str] | None,
    typer.Option("--read", metavar="KEY=VALUE", help="How INPUT is to be read, such as depth_scale=5000; repeat for more."),
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

"""Implement `doo3d export`: write results in the formats of other programs."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import ConfigError, DooWarning
from .arguments import MinConfidence, completing
from .progress_bars import with_progress

if TYPE_CHECKING:
    from ..exports import Export


def _formats() -> list[str]:
    from ..exports import FORMATS

    return list(FORMATS)


def export(
    results: Annotated[Path | None, typer.Argument(metavar="OUT", help="The folder written by doo3d detect.")] = None,
    to: Annotated[
        str | None,
        typer.Option("--to", metavar="FORMAT", help="The format to write, see --list.", autocompletion=completing(_formats)),
    ] = None,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="The file or folder to write. Default: beside OUT.")] = None,
    frame: Annotated[
        list[str] | None, typer.Option("--frame", metavar="NAME", help="Export only this frame; repeat for more.")
    ] = None,
    pose: Annotated[
        str | None,
        typer.Option(metavar="POSE", help="Pose of the camera in the world: a file with a 4x4 matrix, or x,y,z,qx,qy,qz,qw."),
    ] = None,
    segments: Annotated[
        int | None, typer.Option(metavar="N", help="Number of segments per chain for simulators, same as --set segments=N.")
    ] = None,
    count: Annotated[int | None, typer.Option(metavar="M", help="Number of nodes, same as --set count=M.")] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Set an option of the format, such as ground=true; repeat for more."),
    ] = None,
    min_confidence: MinConfidence = 0.0,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
    list_formats: Annotated[bool, typer.Option("--list", help="List the formats and their options.")] = False,
) -> None:
    """Write the chains in OUT to files for a simulator, a tracker or another program; print the number of files and the path.

    \b
    Examples:
      doo3d export out --to npz                                    all frames in one file, out.npz
      doo3d export out --to mjcf -o scenes --set ground=true       a MuJoCo model per frame
      doo3d export out --to urdf --segments 20                     few joints, for PyBullet
      doo3d export out --to nodes --frame 000000 --count 45        the initial nodes of TrackDLO
      doo3d export out --to usd --pose 0,0,1.2,1,0,0,0             in the world's coordinates

    Exit code 0: everything was written; 2: nothing was.
    """
    from ..config import parse_overrides
    from ..exports import FORMATS, default_path
    from ..exports import export as write

    if list_formats:
        for name, kind in FORMATS.working():
            typer.echo("\n".join(_description(name, kind)))
        return
    if results is None or to is None:
        raise ConfigError(
            "expected OUT and --to FORMAT, such as doo3d export out --to npz; formats: " + ", ".join(FORMATS),
            code="option-missing",
        )
    given = {"count": count, "segments": segments}
    options = parse_overrides(overrides or []) | {key: value for key, value in given.items() if value is not None}
    target = out or default_path(results, to)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DooWarning)
        shared: dict[str, Any] = {"pose": pose, "min_confidence": min_confidence, "force": force}
        written = write(results, to, target, frames=frame or None, with_progress=with_progress, **shared, **options)
    for line in _notes(caught):
        typer.echo(line, err=True)
    typer.echo(f"{len(written)} file{'s' * (len(written) != 1)} -> {written[0] if len(written) == 1 else target}")


def _notes(caught: Iterable[warnings.WarningMessage]) -> Iterator[str]:
    """Yield a line with the first warning and the number of frames with warnings; warnings of other libraries are left out."""
    messages = [str(item.message) for item in caught if issubclass(item.category, DooWarning)]
    if messages:
        more = f" ({len(messages) - 1} more like this)" if len(messages) > 1 else ""
        yield f"doo3d: note: {messages[0]}{more}"


def _description(name: str, kind: type[Export]) -> Iterator[str]:
    """Yield the lines of a format: summary, suffixes, dimensions, then its options."""
    suffixes = ", ".join(kind.suffixes) or "a folder"
    yield f"{name:<6} {kind.summary} ({suffixes}; one per {kind.file_per}; {'3-D and 2-D' if kind.supports_2d else '3-D'})"
    for key, field in kind.model_fields.items():
        default = "" if field.default is None else f" [{field.default}]"
        yield f"         {key}{default}: {field.description}"

"""Implement `doo3d compare`: compare the 3-D mode with the 2-D mode, frame by frame."""

from pathlib import Path
from typing import Annotated

import typer

from .arguments import ALL_FRAMES, DEFAULT_READING, DEFAULT_SETTINGS, Frames, Reading, Settings
from .exit_codes import NOTHING_DONE, SOME_FAILED


def compare(
    capture: Annotated[Path, typer.Argument(metavar="INPUT", help="A capture folder with depth.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for the pictures.")] = Path("compare"),
    settings: Settings = DEFAULT_SETTINGS,
    config_2d: Annotated[str, typer.Option("--config-2d", help="Preset or YAML file of the 2-D mode.")] = "image",
    overrides_2d: Annotated[
        list[str] | None, typer.Option("--set-2d", metavar="KEY=VALUE", help="Set one field of the 2-D mode; repeat for more.")
    ] = None,
    reading: Reading = DEFAULT_READING,
    selection: Frames = ALL_FRAMES,
    force: Annotated[bool, typer.Option("--force", help="Write into OUT even if it holds something else.")] = False,
) -> None:
    """Detect in every frame of INPUT in 3-D and in 2-D, from the same mask, and show where the two differ.

    The results of a frame agree if the 3-D chains, projected into the image, run along the 2-D chains and are at most 2 px away,
    or half the width of the 2-D chain if that is more. A number of chains set by merge.chains applies to both modes.

    Prints a line per frame, and writes a picture per frame (<frame>.png) and comparison.json to OUT.

    \b
    Example:
      doo3d compare sample_clouds/crossing -o compare

    Exit code 0: both agree in all frames; 1: they differ in some, or a frame failed; 2: nothing could be compared.
    """
    from ..config import load_config, parse_overrides

    effective = settings.load()
    shared = {} if effective.merge.chains is None else {"merge.chains": effective.merge.chains}
    effective_2d = load_config(config_2d, shared | parse_overrides(overrides_2d or []))
    opened = selection.of(reading.open(capture))
    from ..tools.compare import compare_capture

    column = max((len(entry.name) for entry in opened.frames), default=0)
    records = compare_capture(
        *(opened, out, effective, effective_2d),
        force=force,
        report=lambda record: typer.echo("\n".join(record.lines(column)), err=record.comparison is None),
    )
    if not any(record.comparison for record in records):
        raise typer.Exit(NOTHING_DONE)
    agreeing = sum(record.agrees for record in records)
    typer.echo(f"{agreeing} of {len(records)} frame{'s' * (len(records) > 1)} agree -> {out}")
    if agreeing < len(records):
        raise typer.Exit(SOME_FAILED)

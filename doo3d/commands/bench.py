"""`doo3d bench`: the time of each stage on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .arguments import Overrides, Preset, config_of


def bench(
    captures: Annotated[
        list[Path] | None,
        typer.Argument(metavar="INPUT", help="Captures; the first frame of each is timed. Without any, a frame is rendered."),
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="Timed runs of each frame.")] = 20,
    config: Preset = "default",
    overrides: Overrides = None,
) -> None:
    """Print the time of each stage of the detection, in one process and one thread: median and 95th percentile in ms.

    To compare machines, each median is also given in yardsticks; a yardstick is the time that this machine needs to convert
    1280x720 pixels to HSV and test their ranges. Without INPUT, a rendered frame of 1280x720 is timed. No file is written.

    \b
    Example:
      doo3d bench sample_clouds/crossing --runs 50
    """
    from ..inspection.benchmark import bench as time_captures
    from ..runs.threads import single_thread

    single_thread()
    for i, timing in enumerate(time_captures(captures or [], config_of(config, overrides), runs)):
        typer.echo("\n".join([""] * (i > 0) + timing.lines()))

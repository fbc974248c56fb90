"""`doo3d bench`: the time of each stage on this machine, and how the time grows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from .arguments import Overrides, Preset, config_of, save

if TYPE_CHECKING:
    from ..config import Config


def bench(
    captures: Annotated[
        list[Path] | None,
        typer.Argument(metavar="INPUT", help="Captures; the first frame of each is timed. Without any, a frame is rendered."),
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="Timed runs of each frame.")] = 20,
    scale: Annotated[
        bool,
        typer.Option(
            "--scale",
            help="Time drawn frames of growing size instead: pixels, length of the cable, number of cables, of crossings.",
        ),
    ] = False,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="With --scale: a PNG file to draw the times to.")] = None,
    config: Preset = "default",
    overrides: Overrides = None,
) -> None:
    """Print the time of each stage of the detection, in one process and one thread: median and 95th percentile in ms.

    To compare machines, each median is also given in yardsticks; a yardstick is the time that this machine needs to convert
    1280x720 pixels to HSV and test their ranges. Without INPUT, a rendered frame of 1280x720 is timed. No file is written, except
    with --plot.

    \b
    Examples:
      doo3d bench sample_clouds/crossing --runs 50
      doo3d bench --scale --plot scale.png
    """
    from ..inspection.benchmark import bench as time_captures
    from ..runs.threads import single_thread

    if scale and captures:
        raise InputError("--scale times frames that it draws itself: give no INPUT with it", code="options-conflict")
    if plot and not scale:
        raise InputError("--plot draws the times of --scale: give that too", code="options-conflict")
    single_thread()
    if scale:
        _print_scaling(config_of(config, overrides), runs, plot)
        return
    for i, timing in enumerate(time_captures(captures or [], config_of(config, overrides), runs)):
        typer.echo("\n".join([""] * (i > 0) + timing.lines()))


def _print_scaling(config: Config, runs: int, plot: Path | None) -> None:
    """Print a table for each respect in which frames grow, and draw the plot if a file is given."""
    from ..inspection.scaling import HEADING, SIZES, UNITS, ScalePoint, growth, time_sizes
    from ..viz.encoding import encode_image
    from ..viz.scaling_plot import draw_scaling

    series: dict[str, list[ScalePoint]] = {}
    typer.echo(HEADING)
    for point in time_sizes(config, runs):
        points = series.setdefault(point.respect, [])
        points.append(point)
        typer.echo(point.line())
        if len(points) == len(SIZES[point.respect]):
            typer.echo(f"the time grows with the power {growth(points):.2f} of the size, between the two largest\n")
    if plot:
        times = {UNITS[name]: [(p.size, p.milliseconds / p.yardstick) for p in points] for name, points in series.items()}
        save(plot, encode_image(draw_scaling(times, "yardsticks")))
        typer.echo(f"plot: {plot}")

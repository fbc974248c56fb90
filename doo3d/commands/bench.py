"""Implement `doo3d bench`: time each stage on this machine, and measure how the time grows with size."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from .arguments import DEFAULT_SETTINGS, Settings, save

if TYPE_CHECKING:
    from ..config import Config
    from ..tools.benchmark import Timing


def bench(
    captures: Annotated[
        list[Path] | None,
        typer.Argument(metavar="INPUT", help="Captures; the first frame of each is timed. Without any, frames are rendered."),
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="Timed runs of each frame.")] = 20,
    stages: Annotated[
        bool, typer.Option("--stages", help="Without INPUT: print the time of each stage of each frame, before the table.")
    ] = False,
    large: Annotated[bool, typer.Option("--large", help="Without INPUT: time a cloud of 1,000,000 points too.")] = False,
    only: Annotated[
        str, typer.Option(metavar="TEXT", help="Without INPUT: time the frames whose names hold TEXT, such as photograph.")
    ] = "",
    scale: Annotated[
        bool,
        typer.Option(
            "--scale",
            help="Time drawn frames of growing size instead: pixels, length of the cable, number of cables, of crossings.",
        ),
    ] = False,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="With --scale: a PNG file to draw the times to.")] = None,
    settings: Settings = DEFAULT_SETTINGS,
) -> None:
    """Print the time of each stage of the detection, in one process and one thread: median and 95th percentile in ms.

    To compare machines, each median is also given in yardsticks; a yardstick is the time that this machine needs to convert
    1280x720 pixels to HSV and test their ranges. Without INPUT, whole detections in frames that this project renders are timed:
    scenes with and without a mask, a stereo camera's frame with a ragged mask, images as busy as a photograph with the presets
    image and paper_2d, and a cloud. No file is written, except with --plot.

    \b
    Examples:
      doo3d bench
      doo3d bench --only crossing --stages
      doo3d bench sample_clouds/crossing --runs 50
      doo3d bench --scale --plot scale.png
    """
    from ..runs.threads import single_thread
    from ..tools.benchmark import bench as time_captures

    if (captures or scale) and (stages or large or only):
        sentence = "--stages, --large and --only are for the rendered frames: give neither INPUT nor --scale with them"
        raise InputError(sentence, code="options-conflict")
    if scale and captures:
        raise InputError("--scale times frames that it draws itself: give no INPUT with it", code="options-conflict")
    if plot and not scale:
        raise InputError("--plot draws the times of --scale: give that too", code="options-conflict")
    single_thread()
    if scale:
        _print_scaling(settings.load(), runs, plot)
        return
    if captures:
        _print_stages(time_captures(captures, settings.load(), runs))
    else:
        _print_cases(settings.load(), runs, stages, large, only)


def _print_stages(timings: Sequence[Timing]) -> None:
    """Print the time of each stage, frame by frame."""
    for i, timing in enumerate(timings):
        typer.echo("\n".join([""] * (i > 0) + timing.lines()))


def _print_cases(config: Config, runs: int, stages: bool, large: bool, only: str) -> None:
    """Time the rendered frames whose names contain `only`, and print a table; with `stages`, first the stages of each frame."""
    from ..tools.bench_cases import CASES, LARGE_CASE, time_cases
    from ..tools.benchmark import table
    from .progress_bars import with_progress

    cases = [case for case in (*CASES, *([LARGE_CASE] if large else [])) if only in case.name]
    timings = list(time_cases(config, runs, cases, with_progress))
    if not timings:
        names = "; ".join(case.name for case in CASES)
        raise InputError(f"--only: no frame's name holds {only!r}; there are {names}", code="choice-unknown")
    if stages:
        _print_stages(timings)
        typer.echo()
    typer.echo("\n".join(table(timings)))


def _print_scaling(config: Config, runs: int, plot: Path | None) -> None:
    """Print a table for each respect in which frames grow, and draw the plot if a file is given."""
    from ..tools.scaling import HEADING, SIZES, UNITS, ScalePoint, growth, time_sizes
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

"""Implement `doo3d view`: show a run in the Rerun viewer."""

from pathlib import Path
from typing import Annotated

import typer

from .arguments import Results, check_new_file
from .progress_bars import with_progress


def view(
    results: Results,
    save: Annotated[
        Path | None, typer.Option("--save", metavar="FILE", help="Write a recording (.rrd) instead of opening the viewer.")
    ] = None,
    frame: Annotated[
        list[str] | None, typer.Option("--frame", metavar="N", help="Show only this frame, by name or number; repeat for more.")
    ] = None,
    stages: Annotated[
        bool, typer.Option("--stages/--no-stages", help="Run the stages again and show the product of each.")
    ] = True,
    force: Annotated[bool, typer.Option("--force", help="Replace FILE.")] = False,
) -> None:
    """Show a run in the Rerun viewer: images, clouds, chains, stage products and merge costs on a timeline.

    With --save, writes all this into a file for the viewer instead of opening the viewer. Without a display, the viewer is a web
    page; it listens on 127.0.0.1 only, until Ctrl-C.

    \b
    Examples:
      doo3d detect sample_clouds/crossing -o out && doo3d view out
      doo3d view out --save out.rrd                    without a screen; open it elsewhere with: rerun out.rrd
    """
    from ..outputs.products import Products
    from ..outputs.run_reader import open_results

    opened = open_results(results)
    if save is not None:
        check_new_file(save, force, results)
    from ..tools.rerun_viewer import RerunRecording, select_frames

    names = select_frames(opened, frame)
    recording = RerunRecording(opened, save)
    for name in with_progress(names):
        recording.log_frame(name, stages)
    if save is not None:
        Products(results).add([save])
    if recording.warning:
        typer.echo(f"note: {recording.warning}", err=True)
    typer.echo(f"{len(names)} frame{'s' * (len(names) != 1)} -> {save or 'the viewer'}")
    if recording.viewer is not None and recording.viewer.page:
        typer.echo(f"no display: open {recording.viewer.page} in a browser of this machine; Ctrl-C ends the viewer")
        try:
            recording.viewer.process.wait()
        finally:
            recording.viewer.process.terminate()

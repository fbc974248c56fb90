"""`doo3d video`: a run's pictures as a video."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .arguments import Results, check_new_file, with_progress


def video(
    results: Results,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE", help="The video, MP4.")] = Path("out.mp4"),
    fps: Annotated[
        float | None, typer.Option("--fps", help="Frames per second; by default as the stamps say, 10 without them.")
    ] = None,
    codec: Annotated[
        str, typer.Option(metavar="mp4v|vp09|avc1", help="MPEG-4; VP9, which browsers play; H.264, where OpenCV can make it.")
    ] = "mp4v",
    skip_failed: Annotated[
        bool, typer.Option("--skip-failed", help="Leave frames that failed out, instead of showing their reason.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Write over FILE.")] = False,
) -> None:
    """Make a video of the pictures of a run.

    \b
    Example:
      doo3d detect sample_clouds/crossing -o out && doo3d video out -o out.mp4 --fps 5
    """
    from ..outputs.run_reader import open_results
    from ..viz.video import write_video

    opened = open_results(results)
    check_new_file(out, force)
    made = write_video(opened, out, fps, codec, skip_failed, with_progress)
    failed = f" ({made.failed} failed, {'left out' if skip_failed else 'shown as such'})" if made.failed else ""
    frames = f"{made.frames} frame{'' if made.frames == 1 else 's'}"
    typer.echo(f"{frames}{failed}, {made.fps:g} per second, {made.size[0]}x{made.size[1]} -> {out}")

"""`doo3d video`: the pictures of a run as a video."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .arguments import Results, check_new_file, with_progress


def video(
    results: Results,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE", help="The MP4 file to write.")] = Path("out.mp4"),
    fps: Annotated[
        float | None, typer.Option("--fps", help="Frames per second. Default: from the timestamps; 10 without them.")
    ] = None,
    codec: Annotated[
        str,
        typer.Option(metavar="mp4v|vp09|avc1", help="MPEG-4; VP9, which browsers play; H.264, if OpenCV has it."),
    ] = "mp4v",
    skip_failed: Annotated[bool, typer.Option("--skip-failed", help="Omit failed frames instead of showing the reason.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace FILE.")] = False,
) -> None:
    """Write the pictures of a run as an MP4 video.

    Prints the number of frames, the frame rate and the size of the video.

    \b
    Example:
      doo3d detect sample_clouds/crossing -o out && doo3d video out -o out.mp4 --fps 5
    """
    from ..outputs.run_reader import open_results
    from ..viz.video import write_video

    opened = open_results(results)
    check_new_file(out, force)
    written = write_video(opened, out, fps, codec, skip_failed, with_progress)
    failed = f" ({written.failed} failed, {'left out' if skip_failed else 'shown as such'})" if written.failed else ""
    frames = f"{written.frames} frame{'' if written.frames == 1 else 's'}"
    typer.echo(f"{frames}{failed}, {written.fps:g} per second, {written.size[0]}x{written.size[1]} -> {out}")

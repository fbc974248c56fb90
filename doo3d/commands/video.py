"""Implement `doo3d video`: write the pictures of a run as a video."""

from pathlib import Path
from typing import Annotated

import typer

from .arguments import Results, check_new_file, named_after
from .progress_bars import with_progress


def video(
    results: Results,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="FILE", help="The WebM or MP4 file to write. Default: OUT.webm, beside OUT."),
    ] = None,
    fps: Annotated[
        float | None, typer.Option("--fps", help="Frames per second. Default: from the timestamps; 10 without them.")
    ] = None,
    codec: Annotated[
        str | None,
        typer.Option(
            metavar="vp08|vp09|mp4v|avc1",
            help="VP8, VP9 (half the size, three times as slow), MPEG-4, or H.264 if OpenCV has it. Default: VP8 in a .webm, "
            "which browsers play, else MPEG-4.",
        ),
    ] = None,
    skip_failed: Annotated[bool, typer.Option("--skip-failed", help="Omit failed frames instead of showing the reason.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace FILE.")] = False,
) -> None:
    """Write the pictures of a run as a video.

    The file is WebM if its name ends in .webm, MP4 otherwise. Prints the number of frames, the frame rate and the
    size of the video.

    \b
    Examples:
      doo3d detect sample_clouds/crossing -o out && doo3d video out --fps 5
      doo3d video out -o out.mp4                       for players and editors
    """
    from ..outputs.products import Products
    from ..outputs.run_reader import open_results
    from ..viz.video import write_video

    opened, out = open_results(results), out or named_after(results, ".webm")
    check_new_file(out, force, results)
    written = write_video(opened, out, fps, codec, skip_failed, with_progress)
    Products(results).add([out])
    failed = f" ({written.failed} failed, {'left out' if skip_failed else 'shown as such'})" if written.failed else ""
    failed += f" ({written.undrawn} without a picture left out)" if written.undrawn else ""
    frames = f"{written.frames} frame{'' if written.frames == 1 else 's'}"
    typer.echo(f"{frames}{failed}, {written.fps:g} per second, {written.size[0]}x{written.size[1]} -> {out}")

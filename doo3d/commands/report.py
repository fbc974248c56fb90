"""`doo3d report`: a run as one page of HTML."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .arguments import Results, check_new_file, save, with_progress


def report(
    results: Results,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE", help="The page.")] = Path("report.html"),
    clouds: Annotated[
        bool, typer.Option("--clouds/--no-clouds", help="Show points of the capture about the chains, where it is still there.")
    ] = True,
    force: Annotated[bool, typer.Option("--force", help="Write over FILE.")] = False,
) -> None:
    """Make one page of HTML of what was found: figures, plots, pictures, and each frame's chains to turn about.

    The page holds all it needs and opens without a network.

    \b
    Example:
      doo3d detect sample_clouds/crossing -o out && doo3d report out -o report.html
    """
    from ..outputs.run_reader import open_results
    from ..viz.report import report_page

    opened = open_results(results)
    check_new_file(out, force)
    page = report_page(opened, out.absolute().parent, clouds, with_progress)
    save(out, page)
    typer.echo(f"{len(opened.manifest['frames'])} frames, {len(page.encode()) / 1e6:.1f} MB -> {out}")

"""Implement `doo3d report`: write a run as one HTML page."""

from pathlib import Path
from typing import Annotated

import typer

from .arguments import MinConfidence, Results, check_new_file, named_after, save
from .progress_bars import with_progress


def report(
    results: Results,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="The HTML file to write. Default: OUT.html, beside OUT.")
    ] = None,
    clouds: Annotated[
        bool, typer.Option("--clouds/--no-clouds", help="Show points of the capture around the chains, if it can still be read.")
    ] = True,
    min_confidence: MinConfidence = 0.0,
    force: Annotated[bool, typer.Option("--force", help="Replace FILE.")] = False,
) -> None:
    """Write a run as one HTML page: figures, plots, pictures, and the chains of each frame in 3-D.

    The page is a single file that opens without a network. Prints the number of frames and the size of the page.

    \b
    Example:
      doo3d detect sample_clouds/crossing -o out && doo3d report out
    """
    from ..runs.threads import single_thread

    single_thread()
    from ..outputs.products import Products
    from ..outputs.run_reader import open_results
    from ..viz.report import report_page

    opened, out = open_results(results, min_confidence), out or named_after(results, ".html")
    check_new_file(out, force, results)
    page = report_page(opened, out.absolute().parent, clouds, with_progress)
    save(out, page)
    Products(results).add([out])
    typer.echo(f"{len(opened.manifest['frames'])} frames, {len(page.encode()) / 1e6:.1f} MB -> {out}")

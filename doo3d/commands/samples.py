"""Implement `doo3d samples`: render captures and clouds with known truth."""

from pathlib import Path
from typing import Annotated

import typer

from .progress_bars import with_progress


def samples(folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Output folder; made if missing.")]) -> None:
    """Render the sample captures and clouds into FOLDER.

    Beside each capture and cloud is a file with the true shape of its cables. Prints the paths of what was written.
    """
    from ..evaluation.sample_captures import write_samples

    for path in write_samples(folder, with_progress):
        typer.echo(path)

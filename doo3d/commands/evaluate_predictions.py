"""Implement `doo3d evaluate predictions` and `doo3d evaluate sets`: a benchmark for the output of any program."""

from pathlib import Path
from typing import Annotated

import typer

from . import evaluate_options as shared
from .arguments import split
from .progress_bars import with_progress


def predictions(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="The predictions: <family>/<frame>.json or .png, or <frame> alone.")
    ],
    data: Annotated[
        Path,
        typer.Option(
            metavar="SET", help="Folder of mbest or cset (see doo3d evaluate dataset), or captures with truth files (3-D)."
        ),
    ],
    table: shared.Csv = None,
    document: shared.Json = None,
) -> None:
    """Score the output of any program against labelled photographs or true cables.

    Prints a table of scores. A frame without a file counts as empty, and is listed.

    <frame>.json holds {"chains": [{"points": [[x, y], ...], "radius": r}, ...]}. For photographs, points and radius are in px;
    chains that cross are in order, the upper one last. For captures, points are [x, y, z] and everything is in metres, in the
    camera's optical frame (z forward). radius may be a number for each point, "closed": true marks a ring, and "ms" beside
    "chains" is the time on one core. <frame>.png holds the number of the instance at each pixel, 0 for none (8 or 16 bit;
    photographs only). Results of doo3d detect --instances are read, too.

    \b
    Examples:
      doo3d evaluate predictions masks_of_a_network --data mBEST
      doo3d evaluate sets benchmark && doo3d evaluate predictions chains --data benchmark/frames/test
    """
    from ..config import Config
    from ..evaluation.photos.evaluate import name, remarks
    from ..evaluation.predictions.files import prediction_files
    from ..evaluation.predictions.frames import frame_cases, prediction_benchmark
    from ..evaluation.predictions.photos import photo_benchmark, photo_cases

    in_space = any(data.rglob("*truth.json")) or any(data.rglob("truth.npz"))
    cases = frame_cases(data) if in_space else photo_cases(data)
    files = prediction_files(folder, cases)
    benchmark = prediction_benchmark(files) if in_space else photo_benchmark(files)
    settings = {"predictions": str(folder), "data": str(data)}
    rows = shared.measure(benchmark, cases, settings, shared.Outputs(table, document), Config())
    if missing := [row.frame if in_space else name(row) for row in rows if row.error]:
        typer.echo(f"no prediction: {', '.join(missing)}")
    for line in [] if in_space else remarks([row for row in rows if not row.error]):
        typer.echo(line)


def sets(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Output folder; made if missing.")],
    names: Annotated[str, typer.Option("--sets", help="Comma-separated: frames, sequences, harness, bundles; or all.")] = "all",
    seeds: Annotated[
        int | None, typer.Option(min=1, help="Scenes of each family and part. Default: below 200 MB in all.")
    ] = None,
    size: shared.Size = "640x480",
) -> None:
    """Render the benchmark's own data into FOLDER: SET/train and SET/test, with true cables, and a card for each set.

    The same arguments give the same files. Prints the paths of what was written.

    \b
    Examples:
      doo3d evaluate sets benchmark
      doo3d evaluate sets small --sets bundles --seeds 1
    """
    from ..evaluation.predictions.sets import SETS, set_writers

    chosen = list(SETS) if names == "all" else split(names) or []
    for name in chosen:
        shared.check_choice("--sets", name, [*SETS, "all"])
    for write in with_progress(set_writers(folder, chosen, seeds, shared.parse_size(size))):
        typer.echo(write())

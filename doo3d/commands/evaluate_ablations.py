"""Implement `doo3d evaluate ablations`: measure the benefit and the cost of each step of the method."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from .arguments import save, split
from .evaluate_options import check_choice, parse_size, use_single_thread
from .progress_bars import with_progress

FAMILIES = "crossings,occluded,air,several,tangle,hairpin,knots,bundle,two_radii,coil,hook,gripper,touch,thin"


def ablations(
    data: Annotated[
        str,
        typer.Option(
            metavar="all|KIND,...",
            help="Kinds of data: frames, stereo, ragged, untold, images, photographs, clouds, lines, harnesses, harness clouds.",
        ),
    ] = "all",
    families: Annotated[str, typer.Option(help="Comma-separated families of scenes; harnesses are always all tried.")] = FAMILIES,
    seeds: Annotated[int, typer.Option(min=1, help="Scenes of each family.")] = 2,
    start: Annotated[int, typer.Option(min=0, metavar="SEED", help="Seed of the first scene of each family.")] = 0,
    size: Annotated[str, typer.Option(metavar="WxH", help="Size of the images, px.")] = "1280x720",
    steps: Annotated[str, typer.Option(metavar="all|STEP,...", help="Steps to take out, by the names in the table.")] = "all",
    workers: Annotated[int, typer.Option(min=1, help="Processes; times are exact with one.")] = 1,
    table: Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write the rows of the table to FILE.")] = None,
    document: Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write rows and settings to FILE.")] = None,
) -> None:
    """Take out one step of the method at a time, and count the frames that become right or wrong by the step.

    Prints two lines for each step: on the kinds of data that it was made for, and on all. +3 -1 under "strict" means that the
    step makes three frames right and one wrong by the strict rule. "chance" is how often as uneven a change would come by
    chance (sign test); "lines" and "numbers" are those of modules that only the step needs.

    \b
    Examples:
      doo3d evaluate ablations --seeds 4 --workers 2
      doo3d evaluate ablations --data stereo,ragged --steps "strand filter,spurs" --csv bill.csv
    """
    use_single_thread()
    from ..evaluation.benchmark.ablations import format_ablations, rows_of, run_ablations
    from ..evaluation.benchmark.run import in_processes
    from ..evaluation.benchmark.steps import ABLATIONS
    from ..evaluation.benchmark.tables import csv_text
    from ..evaluation.benchmark.trials import KINDS, make_trials
    from ..evaluation.scenes.registry import FAMILIES as ALL
    from ..outputs.detection_json import dumps

    kinds = list(KINDS) if data == "all" else [check_choice("--data", name, KINDS) for name in split(data) or []]
    chosen = list(ABLATIONS) if steps == "all" else [check_choice("--steps", name, ABLATIONS) for name in split(steps) or []]
    scenes = [check_choice("--families", name, ALL) for name in split(families) or []]
    trials = list(make_trials(kinds, scenes, range(start, start + seeds), parse_size(size)))
    results = list(with_progress(in_processes(partial(run_ablations, steps=chosen), trials, workers), len(trials)))
    rows = rows_of(results, chosen)
    typer.echo(format_ablations(rows))
    if table:
        save(table, csv_text(rows))
    if document:
        settings = {"data": data, "families": families, "seeds": seeds, "start": start, "size": size, "steps": steps}
        save(document, dumps({"schema": "doo3d/ablations/1", "settings": settings, "rows": rows}))

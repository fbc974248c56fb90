"""`doo3d evaluate trees`: the detection of branched objects on rendered harnesses."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import ConfigError
from .arguments import Overrides, config_of, split
from .evaluate_options import (
    FEW_MASKS,
    MASKS,
    Csv,
    FewMasks,
    Json,
    Out,
    Outputs,
    Pictures,
    Seeds,
    Sensor,
    Size,
    Start,
    Workers,
    Worst,
    check_choice,
    measure,
    parse_sensor,
    parse_size,
    use_single_thread,
)


def trees(
    families: Annotated[str, typer.Option(help="Comma-separated families of branched objects, or all.")] = "all",
    seeds: Seeds = 40,
    start: Start = 0,
    motion: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="Motion capture of a branched cable (.npy) to render, too; may be repeated."),
    ] = None,
    sensor: Sensor = "d435",
    size: Size = "1280x720",
    mask: FewMasks = "given",
    config: Annotated[str, typer.Option("--config", "-c", help="A preset or a YAML file.")] = "harness",
    overrides: Overrides = None,
    table: Csv = None,
    document: Json = None,
    pictures: Pictures = None,
    worst: Worst = 1,
    out: Out = None,
    workers: Workers = 1,
) -> None:
    """Render harnesses with known junctions, detect in them, and compare the trees with the truth.

    An object is right if every junction and tip is within 3 radii of its place and every edge is right. Prints a line of counts
    per family. 40 scenes of each family take about 20 minutes.

    \b
    Examples:
      doo3d evaluate trees
      doo3d evaluate trees --seeds 10 --sensor stereo --mask ragged --pictures worst --worst 3
      doo3d evaluate trees --families tree_hidden,tree_touch --motion BDLO1_0.npy --json trees.json
    """
    use_single_thread()
    from ..evaluation.benchmark.trees import tree_benchmark, tree_cases
    from ..evaluation.metrics.record import failures
    from ..evaluation.scenes.harnesses import read_markers
    from ..evaluation.scenes.registry import MOTION, TREES

    check_choice("--mask", mask, FEW_MASKS)
    for path in motion or []:
        read_markers(path)
    names = list(TREES) if families == "all" else split(families) or []
    for name in names:
        check_choice("--families", name, [*TREES])
    settings = config_of(config, overrides)
    if not settings.merge.branches:
        raise ConfigError("merge.branches is not set, so no junctions are found: use -c harness", code="options-conflict")
    chosen = [*names, *(f"{MOTION}:{path}" for path in motion or [])]
    cases = tree_cases(chosen, range(start, start + seeds), parse_sensor(sensor), parse_size(size))
    effective = {"families": families, "motion": [str(path) for path in motion or []], "seeds": seeds, "start": start}
    effective |= {"sensor": sensor, "size": size, "mask": mask, "config": config, "set": overrides or []}
    outputs = Outputs(table, document, pictures, worst, out, workers)
    try:
        rows = measure(tree_benchmark(settings, MASKS[mask]), cases, effective, outputs, settings)
    except RuntimeError as error:
        raise ConfigError(f"--size {size}: {error}", code="value-invalid") from None
    if failed := failures(rows):
        typer.echo(f"{failed} of {len(rows)} scenes failed")

"""Implement `doo3d evaluate trees`: measure the detection of branched objects on rendered harnesses."""

from pathlib import Path
from typing import Annotated

import typer

from ..errors import ConfigError
from . import evaluate_options as shared
from .arguments import Overrides, config_of, split, with_groups


@with_groups
def trees(
    families: Annotated[str, typer.Option(help="Comma-separated families of branched objects, or all.")] = "all",
    seeds: shared.Seeds = 40,
    start: shared.Start = 0,
    motion: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="Motion capture of a branched cable (.npy) to render, too; may be repeated."),
    ] = None,
    sensor: shared.Sensor = "d435",
    size: shared.Size = "1280x720",
    mask: shared.FewMasks = "given",
    config: Annotated[str, typer.Option("--config", "-c", help="A preset or a YAML file.")] = "harness",
    overrides: Overrides = None,
    outputs: shared.Outputs = shared.ONE_PICTURE,
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
    shared.use_single_thread()
    from ..evaluation.benchmark.trees import tree_benchmark, tree_cases
    from ..evaluation.metrics.record import failures
    from ..evaluation.scenes.harnesses import read_markers
    from ..evaluation.scenes.registry import MOTION, TREES

    shared.check_choice("--mask", mask, shared.FEW_MASKS)
    for path in motion or []:
        read_markers(path)
    names = list(TREES) if families == "all" else split(families) or []
    for name in names:
        shared.check_choice("--families", name, [*TREES])
    settings = config_of(config, overrides)
    if not settings.merge.branches:
        raise ConfigError("merge.branches is not set, so no junctions are found: use -c harness", code="options-conflict")
    chosen = [*names, *(f"{MOTION}:{path}" for path in motion or [])]
    cases = tree_cases(chosen, range(start, start + seeds), shared.parse_sensor(sensor), shared.parse_size(size))
    effective = {"families": families, "motion": [str(path) for path in motion or []], "seeds": seeds, "start": start}
    effective |= {"sensor": sensor, "size": size, "mask": mask, "config": config, "set": overrides or []}
    try:
        rows = shared.measure(tree_benchmark(settings, shared.MASKS[mask]), cases, effective, outputs, settings)
    except RuntimeError as error:
        raise ConfigError(f"--size {size}: {error}", code="value-invalid") from None
    if failed := failures(rows):
        typer.echo(f"{failed} of {len(rows)} scenes failed")

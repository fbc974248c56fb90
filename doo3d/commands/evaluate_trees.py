"""`doo3d evaluate trees`: the detection of branched objects on rendered harnesses."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import ConfigError
from .arguments import Overrides, config_of, save, split
from .evaluate_options import SENSORS, check_choice, parse_sensor, parse_size, use_single_thread


def trees(
    families: Annotated[str, typer.Option(help="Comma-separated families of branched objects, or all.")] = "all",
    seeds: Annotated[int, typer.Option(min=1, help="Scenes of each family.")] = 10,
    start: Annotated[int, typer.Option(min=0, metavar="SEED", help="Seed of the first scene of each family.")] = 0,
    motion: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="Motion capture of a branched cable (.npy) to render, too; may be repeated."),
    ] = None,
    sensor: Annotated[str, typer.Option(metavar="|".join(SENSORS), help="Simulated depth camera.")] = "d435",
    size: Annotated[str, typer.Option(metavar="WxH", help="Size of the image, px.")] = "1280x720",
    mask: Annotated[str, typer.Option(metavar="given|auto", help="Give the true mask, or use the config.")] = "given",
    config: Annotated[str, typer.Option("--config", "-c", help="A preset or a YAML file.")] = "harness",
    overrides: Overrides = None,
    document: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the sums and the counts of every frame to FILE.")
    ] = None,
) -> None:
    """Render harnesses with known junctions, detect in them, and compare the trees with the truth.

    An object is right if every junction and tip is within 3 radii of its place and every edge is right. Prints a line of counts
    per family.

    \b
    Examples:
      doo3d evaluate trees --seeds 40
      doo3d evaluate trees --families tree_hidden,tree_touch --motion BDLO1_0.npy --json trees.json
    """
    use_single_thread()
    from ..evaluation.benchmark.trees import evaluate_trees, tree_document, tree_families, tree_table
    from ..evaluation.scenes.registry import TREES
    from ..outputs.detection_json import dumps

    check_choice("--mask", mask, ["given", "auto"])
    chosen = tree_families(motion or [])
    if families != "all":
        for name in split(families) or []:
            check_choice("--families", name, [*TREES])
        chosen = [*(split(families) or []), *chosen[len(TREES) :]]
    settings = config_of(config, overrides)
    if not settings.merge.branches:
        raise ConfigError("merge.branches is not set, so no junctions are found: use -c harness", code="options-conflict")
    frame_size = parse_size(size)
    rows = list(evaluate_trees(chosen, range(start, start + seeds), settings, parse_sensor(sensor), frame_size, mask == "given"))
    typer.echo(tree_table(rows))
    if document is not None:
        save(document, dumps(tree_document(rows)))

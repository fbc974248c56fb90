"""`doo3d evaluate trees`: the detection of branched objects on rendered harnesses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import ConfigError
from ..outputs.atomic import writing
from .arguments import Overrides, config_of, save, split
from .evaluate_options import SENSORS, check_choice, parse_sensor, parse_size, use_single_thread
from .progress_bars import counting

if TYPE_CHECKING:
    from ..evaluation.benchmark.trees import Masking

MASKS: dict[str, Masking] = {"given": "given", "ragged": "ragged", "auto": "auto"}
"""Choices of --mask, as for `doo3d evaluate scenes`."""


def trees(
    families: Annotated[str, typer.Option(help="Comma-separated families of branched objects, or all.")] = "all",
    seeds: Annotated[int, typer.Option(min=1, help="Scenes of each family.")] = 40,
    start: Annotated[int, typer.Option(min=0, metavar="SEED", help="Seed of the first scene of each family.")] = 0,
    motion: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="Motion capture of a branched cable (.npy) to render, too; may be repeated."),
    ] = None,
    sensor: Annotated[str, typer.Option(metavar="|".join(SENSORS), help="Simulated depth camera.")] = "d435",
    size: Annotated[str, typer.Option(metavar="WxH", help="Size of the image, px.")] = "1280x720",
    mask: Annotated[
        str, typer.Option(metavar="|".join(MASKS), help="Give the true mask or a spoiled one, or use the config.")
    ] = "given",
    config: Annotated[str, typer.Option("--config", "-c", help="A preset or a YAML file.")] = "harness",
    overrides: Overrides = None,
    document: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the sums and the counts of every frame to FILE.")
    ] = None,
    pictures: Annotated[Path | None, typer.Option(metavar="DIR", help="Draw the worst scenes of each family into DIR.")] = None,
    worst: Annotated[int, typer.Option(min=1, help="Number of scenes of each family that are drawn.")] = 1,
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
    from ..evaluation.benchmark.trees import evaluate_trees, tree_document, tree_families, tree_table, worst_trees
    from ..evaluation.scenes.harnesses import read_markers
    from ..evaluation.scenes.registry import TREES
    from ..outputs.detection_json import dumps

    check_choice("--mask", mask, MASKS)
    for path in motion or []:
        read_markers(path)
    chosen = tree_families(motion or [])
    if families != "all":
        for name in split(families) or []:
            check_choice("--families", name, [*TREES])
        chosen = [*(split(families) or []), *chosen[len(TREES) :]]
    settings = config_of(config, overrides)
    if not settings.merge.branches:
        raise ConfigError("merge.branches is not set, so no junctions are found: use -c harness", code="options-conflict")
    drawn = evaluate_trees(chosen, range(start, start + seeds), settings, parse_sensor(sensor), parse_size(size), MASKS[mask])
    rows = []
    try:
        with counting(len(chosen) * seeds) as report:
            for row in drawn:
                rows.append(row)
                report(row)
    except RuntimeError as error:
        raise ConfigError(f"--size {size}: {error}", code="value-invalid") from None
    typer.echo(tree_table(rows))
    if document is not None:
        effective = {"families": families, "motion": [str(path) for path in motion or []], "seeds": seeds, "start": start}
        effective |= {"sensor": sensor, "size": size, "mask": mask, "config": config, "set": overrides or []}
        save(document, dumps(tree_document(rows, effective)))
    if pictures:
        from ..evaluation.benchmark.tree_pictures import write_tree_pictures

        with writing(pictures):
            paths = write_tree_pictures(pictures, worst_trees(rows, worst))
        typer.echo("\n".join(map(str, paths)))

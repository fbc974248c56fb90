"""`doo3d evaluate mbest` and `cset`: the 2-D mode on labelled photographs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import ConfigError
from .arguments import Overrides, Preset, config_of, save, split

if TYPE_CHECKING:
    from ..evaluation.photos.evaluate import Row

Subsets = Annotated[str | None, typer.Option("--subset", metavar="S1,S2", help="Comma-separated subsets; none: all.")]
KnownCount = Annotated[
    bool, typer.Option("--known-count/--chains-from-data", help="Say how many cables there are; else as the config does.")
]
Table = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write a line per image here.")]
Worst = Annotated[int, typer.Option(min=0, help="Name this many of the worst images.")]
Pictures = Annotated[Path | None, typer.Option(metavar="DIR", help="Draw the worst images (5 without --worst) into DIR.")]


def mbest(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="S1, S2, S3 with images/ and labels/ each, or mBEST's checkout.")],
    config: Preset = "image",
    overrides: Overrides = None,
    subsets: Subsets = None,
    masks: Annotated[str, typer.Option(metavar="labels|hsv", help="The labels' foreground, or the cables' colour.")] = "labels",
    known_count: KnownCount = False,
    single: Annotated[bool, typer.Option("--single", help="Each cable alone: is it traced?")] = False,
    table: Table = None,
    worst: Worst = 0,
    pictures: Pictures = None,
) -> None:
    """Detect in mBEST's photographs of one to three cables (S1 to S3) and score against their labels.

    drawn: DICE of the chains drawn with their own width; labelled: of the mask with each pixel given to the nearest chain;
    ordered: the same with pixels that the right chain covers left to it, as the upper cable's at a crossing.
    """
    from ..runs.threads import single_thread

    single_thread()
    from ..evaluation.photos import datasets as photos_data
    from ..evaluation.photos import evaluate as photos

    if single and (masks != "labels" or known_count):
        raise ConfigError(
            "--single goes by each cable's label and wants one chain: leave --masks and --known-count out",
            code="options-conflict",
        )
    entries, effective = photos_data.mbest(folder, masks, split(subsets)), config_of(config, overrides)
    rows = photos.evaluate_cables(entries, effective) if single else photos.evaluate_photos(entries, effective, known_count)
    _say_photos(rows, table, worst, pictures)


def cset(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="images/, labels/ and masks/, or the checkout of CVF3D-DLO.")],
    config: Preset = "image",
    overrides: Overrides = None,
    subsets: Subsets = None,
    masks: Annotated[str, typer.Option(metavar="labels|network", help="The labels' foreground, or masks/.")] = "labels",
    known_count: KnownCount = False,
    table: Table = None,
    worst: Worst = 0,
    pictures: Pictures = None,
) -> None:
    """Detect in photographs of cables before busy backgrounds (C1 to C3) and score against their labels."""
    from ..runs.threads import single_thread

    single_thread()
    from ..evaluation.photos import datasets as photos_data
    from ..evaluation.photos import evaluate as photos

    entries = photos_data.cset(folder, masks, split(subsets))
    _say_photos(photos.evaluate_photos(entries, config_of(config, overrides), known_count), table, worst, pictures)


def _say_photos(rows: list[Row], table: Path | None, worst: int, pictures: Path | None) -> None:
    from ..evaluation.photos import evaluate as photos
    from ..evaluation.photos import pictures as photos_pictures

    typer.echo(photos.format_rows(rows))
    chosen = photos.worst(rows, worst or (5 if pictures else 0))
    for row in chosen:
        typer.echo(f"worst: {photos.caption(row)}")
    if table:
        save(table, photos.csv_text(rows))
    if pictures:
        for path in photos_pictures.write_pictures(pictures, chosen):
            typer.echo(path)

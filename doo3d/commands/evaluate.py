"""`doo3d evaluate`: how good the detection is, against known truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import ConfigError
from . import photos
from .options import Overrides, Preset, config_of

app = typer.Typer(no_args_is_help=True, help="How good the detection is, against known truth.", rich_markup_mode=None)


@app.command("samples")
def samples(
    folder: Annotated[Path, typer.Argument(help="Captures and clouds with their truth beside them, such as sample_clouds.")],
    config: Preset = "default",
    overrides: Overrides = None,
) -> None:
    """Detect in all captures below FOLDER and score against their truth."""
    from ..evaluation import table

    typer.echo(table.format_table(table.evaluate_captures(folder, config_of(config, overrides))))


@app.command("scenes")
def scenes(
    families: Annotated[str, typer.Option(help="Comma-separated families of scenes, or all.")] = "all",
    seeds: Annotated[int, typer.Option(min=1, help="Scenes of each family.")] = 10,
    config: Preset = "default",
    overrides: Overrides = None,
) -> None:
    """Render scenes of known truth, detect in them and score."""
    from ..evaluation import table
    from ..evaluation.scenes import FAMILIES

    chosen = list(FAMILIES) if families == "all" else [name.strip() for name in families.split(",")]
    if unknown := [name for name in chosen if name not in FAMILIES]:
        raise ConfigError(f"--families {unknown[0]}: there are {', '.join(FAMILIES)}")
    typer.echo(table.format_table(table.evaluate_scenes(chosen, range(seeds), config_of(config, overrides))))


app.command("mbest")(photos.mbest)
app.command("cset")(photos.cset)

"""`doo3d config`: the settings, explained."""

from __future__ import annotations

from typing import Annotated

import typer

from .arguments import Overrides, config_of


def config(
    name: Annotated[str, typer.Argument(metavar="NAME", help="A preset or a YAML file.")] = "default",
    overrides: Overrides = None,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print the page of the documentation instead.")] = False,
) -> None:
    """Print the effective configuration, each field explained."""
    from ..config import documentation

    typer.echo(documentation.markdown() if markdown else documentation.annotated_yaml(config_of(name, overrides)), nl=False)

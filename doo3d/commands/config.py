"""Implement `doo3d config`: print the settings with explanations."""

from typing import Annotated

import typer

from .arguments import Overrides, config_of


def config(
    name: Annotated[str, typer.Argument(metavar="NAME", help="A preset or a YAML file.")] = "default",
    overrides: Overrides = None,
    expert: Annotated[
        bool, typer.Option("--all", help="Print the expert settings too; else only those that differ from their defaults.")
    ] = False,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print the page of the documentation instead.")] = False,
) -> None:
    """Print the effective configuration as YAML, with an explanation above each setting.

    \b
    Examples:
      doo3d config > mine.yaml                 the basic settings, to edit and pass with -c mine.yaml
      doo3d config tubes --all                 every setting of a preset
    """
    from ..config import documentation

    if markdown:
        text = documentation.markdown()
    else:
        text = documentation.annotated_yaml(config_of(name, overrides), expert=expert)
    typer.echo(text, nl=False)

"""Implement `doo3d presets`: list the configurations shipped with doo3d."""

import typer


def presets() -> None:
    """Print the presets that -c takes by name, each with its purpose."""
    from ..config import preset_folder, preset_names

    for name in preset_names():
        lines = (preset_folder() / f"{name}.yaml").read_text(encoding="utf-8").splitlines()
        comment = " ".join(line.removeprefix("#").strip() for line in lines if line.startswith("#"))
        typer.echo(f"{name:<12}  {comment.partition('. ')[0].rstrip('.')}.")

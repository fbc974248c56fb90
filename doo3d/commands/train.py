"""Implement `doo3d train`: train the network for thin objects, on drawn images and on the user's own."""

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError, require
from .arguments import check_new_file, save


def train(
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE", help="The network to write, an ONNX file.")],
    data: Annotated[
        list[Path] | None,
        typer.Option(
            "--data",
            metavar="FOLDER",
            help="Images to train on as well: a capture with masks, or accepted results of doo3d detect; repeat for more.",
        ),
    ] = None,
    share: Annotated[
        float, typer.Option("--share", min=0.0, max=1.0, help="Part of the images taken from --data; the others are drawn.")
    ] = 0.5,
    steps: Annotated[int, typer.Option("--steps", min=1, help="Steps in all, of 8 images each.")] = 30_000,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of everything drawn at random.")] = 0,
    work: Annotated[
        Path | None,
        typer.Option("--work", metavar="FOLDER", help="Checkpoint, curve and images in use, 4 GB. Default: FILE.training."),
    ] = None,
    threads: Annotated[int, typer.Option("--threads", min=1, help="Threads of torch, beside the process that draws.")] = 1,
    force: Annotated[bool, typer.Option("--force", help="Replace FILE.")] = False,
) -> None:
    """Train a network for thin objects on drawn images, and on your own.

    Needs the extra train: pip install 'doo3d[train]'. Interrupted training resumes from its last checkpoint: repeat the same
    command. The learning curve is written to curve.csv in the folder of --work.

    \b
    Example:
      doo3d train --data sample_clouds/photos -o mine.onnx --steps 2000
      doo3d detect photo.jpg -c image --set segment.method=network --set segment.onnx.model=mine.onnx
    """
    if out.suffix != ".onnx":
        raise InputError(f"-o {out}: a network has the suffix .onnx: give another name", code="out-suffix")
    check_new_file(out, force)
    for module in ("torch", "onnx"):
        require(module, "train")
    from ..training.learning import Settings, exported
    from ..training.learning import train as learn
    from .progress_bars import has_bar, progress_display

    folder = work or out.with_suffix(".training")
    settings = Settings(folder, steps, seed, threads=threads, data=tuple(data or ()), share=share)
    if has_bar(steps):
        with progress_display("{task.fields[status]}") as bar:
            task = bar.add_task("", total=steps, status="")
            checkpoint = learn(
                settings,
                lambda step, loss: bar.update(task, completed=step, status=f"loss {loss:.3f}"),
                lambda count, total: bar.update(task, status=f"first images: {count} of {total}"),
            )
    else:
        checkpoint = learn(settings)
    save(out, exported(checkpoint))
    typer.echo(f"{steps} steps, curve {folder / 'curve.csv'} -> {out}")

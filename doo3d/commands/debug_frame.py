"""Implement `doo3d detect --debug-frame`: write the product of every stage for a frame as files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..outputs.atomic import writing
from .arguments import frame_of, save
from .explain import lines, run_with_stages

if TYPE_CHECKING:
    from ..config import Config
    from ..inputs import Capture, FrameRef


DebugFrameOption = Annotated[
    list[str] | None,
    typer.Option(
        "--debug-frame",
        metavar="N",
        help="Write the product of every stage for this frame, by name or number, to OUT/stages; repeat for more.",
    ),
]


def debug_frames(capture: Capture, wanted: list[str] | None) -> list[FrameRef]:
    """Return the frames given with `--debug-frame`, in the order of `wanted`; an empty list if `wanted` is None.

    `wanted` are names or numbers of frames; 0 is the first frame, -1 the last.

    Raises
    ------
    InputError : no frame has one of the names or numbers.
    """
    return [frame_of(capture, name, "--debug-frame") for name in wanted or []]


def write_debug_frames(out: Path, entries: list[FrameRef], config: Config) -> None:
    """Repeat the detection in the frames `entries`, and write the product of each stage to `out`/stages/<frame>.

    For each frame, a line with the number of files and the folder is printed.

    Raises
    ------
    InputError : a frame cannot be read or used, or a folder cannot be written to.
    """
    for entry in entries:
        folder = out / "stages" / entry.name
        typer.echo(f"{len(write_stage_products(folder, entry, config))} files of its stages -> {folder}")


def write_stage_products(folder: Path, entry: FrameRef, config: Config) -> list[Path]:
    """Run the detection in one frame; write the product of each stage as PLY and PNG, and the explanation as JSON and text.

    Parameters
    ----------
    folder
        folder for the files, such as `4-branches.ply`, `4-branches.png`, `explanation.json`, `explanation.txt`; made if missing.
    entry
        reference to the frame.
    config
        configuration of the detection.

    Returns
    -------
    The paths of the written files.

    Raises
    ------
    InputError : the frame cannot be read or used, or the folder cannot be written to.
    """
    from ..outputs.detection_json import dumps
    from ..outputs.ply import encode_points
    from ..tools.explain import explain_stages
    from ..tools.stage_products import products
    from ..types import Image
    from ..viz.backdrop import backdrop_of, planar_backdrop
    from ..viz.encoding import encode_image
    from ..viz.stage_products import draw_product

    data, stages = run_with_stages(entry, config)
    explanation = explain_stages(stages, config)
    backdrop = planar_backdrop(data.color) if isinstance(data, Image) else backdrop_of(data)
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    files: dict[str, str | bytes] = {
        "explanation.json": dumps({"frame": entry.name, **explanation.to_dict()}),
        "explanation.txt": "\n".join(lines(explanation)) + "\n",
    }
    for product in products(stages, explanation):
        files[f"{product.name}.ply"] = encode_points(product.points, product.colors, product.edges)
        files[f"{product.name}.png"] = encode_image(draw_product(backdrop, product))
    for name, content in files.items():
        save(folder / name, content)
    return [folder / name for name in files]

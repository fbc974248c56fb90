"""Implement `doo3d explain`: explain the chains of a frame."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .arguments import (
    DEFAULT_READING,
    DEFAULT_SETTINGS,
    CamerasOption,
    FrameOption,
    Reading,
    Settings,
    check_new_file,
    frame_of,
    save,
)

if TYPE_CHECKING:
    from ..config import Config
    from ..inputs import FrameRef
    from ..pipeline import Stages
    from ..tools.explain import Choice, Explanation
    from ..types import Cloud, Frame, Image


def explain(
    capture: Annotated[Path, typer.Argument(metavar="INPUT", help="A capture, as for doo3d detect.")],
    frame: FrameOption = None,
    settings: Settings = DEFAULT_SETTINGS,
    reading: Reading = DEFAULT_READING,
    cameras: CamerasOption = None,
    document: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the explanation with all its numbers to this file.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace FILE if it exists.")] = False,
) -> None:
    """Print what each stage made of a frame and what it dropped, and why chain ends were joined.

    For each two chain ends that were joined, the cost of the join and the cost of the best alternative are printed.

    \b
    Examples:
      doo3d explain sample_clouds/crossing --frame 0
      doo3d explain photo.jpg -c image --json why.json
    """
    from ..camera.open_rig import open_frames

    effective = settings.load()
    opened = open_frames(capture, effective, reading.mask, reading.options(cameras))
    frame_ref = frame_of(opened, frame)
    if document is not None:
        check_new_file(document, force)
    from ..tools.explain import explain_stages

    _, stages = run_with_stages(frame_ref, effective)
    explanation = explain_stages(stages, effective)
    if document is not None:
        from ..outputs.detection_json import dumps

        save(document, dumps({"frame": frame_ref.name, **explanation.to_dict()}))
    typer.echo("\n".join([f"frame {frame_ref.name}", *lines(explanation)]))


def run_with_stages(frame: FrameRef, config: Config) -> tuple[Frame | Cloud | Image, Stages]:
    """Read a frame, run the detection, and return the data and the products of all stages.

    Returns
    -------
    data : the frame's data as the detection used it: a Frame, a Cloud or an Image.
    stages : the product of every stage, such as the mask, the skeleton and the chains.

    Raises
    ------
    InputError : the frame cannot be read or used.
    """
    from ..pipeline import run_stages
    from ..types.conversions import as_mode_data

    loaded = frame.load()
    data = as_mode_data(loaded.data, config.mode)
    return data, run_stages(data, config, loaded.mask_for(config))


def lines(explanation: Explanation) -> Iterator[str]:
    """Yield the lines that `doo3d explain` prints.

    The lines state what each stage made and dropped, then for each connection of two chain ends its cost, its confidence, and the
    cost of the best alternative.
    """
    for account in explanation.accounts:
        yield f"{account.stage:<9} {account.made}"
        for sentence in account.dropped:
            yield f"{'':<9}   dropped: {sentence}"
    if explanation.merges:
        yield "merges, in order:"
    for i, merge in enumerate(explanation.merges):
        kept = "" if merge.kept else "   (in a chain that was dropped)"
        yield f"{i + 1:>4}  {_choice(merge.chosen)}   confidence {merge.confidence:.2f}{kept}"
        other = merge.runner_up
        yield f"{'':>4}  next best: {_choice(other) if other else 'none that is allowed'}"


def _choice(choice: Choice) -> str:
    """Return a connection as text: its ends, its cost, and the terms of the cost."""
    terms = ", ".join(f"{name} {cost:.1f}" for name, cost in choice.terms.items() if round(cost, 1))
    return f"{choice.ends[0]} - {choice.ends[1]}: {choice.cost:.1f}{f' = {terms}' if terms else ''}"

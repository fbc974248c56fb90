"""`doo3d explain`: why the chains of a frame are what they are."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .arguments import FrameOption, InputOption, MaskOption, Overrides, Preset, check_new_file, config_of, frame_of, save
from .progress import say_compiling

if TYPE_CHECKING:
    from ..config import Config
    from ..inputs import FrameRef
    from ..inspection.explain import Choice, Explanation
    from ..pipeline import Stages
    from ..types import Cloud, Frame, Image


def explain(
    capture: Annotated[Path, typer.Argument(metavar="INPUT", help="What doo3d detect takes.")],
    frame: FrameOption = None,
    config: Preset = "default",
    overrides: Overrides = None,
    mask: MaskOption = None,
    input_options: InputOption = None,
    document: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the same, with every number, here.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it is there.")] = False,
) -> None:
    """Say what every stage made of a frame and dropped, and what each connection cost beside the next best.

    \b
    Examples:
      doo3d explain sample_clouds/crossing --frame 0
      doo3d explain photo.jpg -c image --json why.json
    """
    from ..inputs import ReadOptions, open_capture

    effective = config_of(config, overrides)
    opened = open_capture(capture, effective.mode == "2d", mask, ReadOptions.from_pairs(input_options or []))
    entry = frame_of(opened, frame)
    if document is not None:
        check_new_file(document, force)
    say_compiling()
    from ..inspection.explain import explain as account

    _, stages = run_with_stages(entry, effective)
    found = account(stages, effective)
    if document is not None:
        from ..outputs.detection_json import dumps

        save(document, dumps({"frame": entry.name, **found.to_dict()}))
    typer.echo("\n".join([f"frame {entry.name}", *lines(found)]))


def run_with_stages(entry: FrameRef, config: Config) -> tuple[Frame | Cloud | Image, Stages]:
    """Return a frame and the products of all stages, made as in detection.

    Raises
    ------
    InputError : the frame cannot be read or used.
    """
    from ..pipeline import run_with_stages as walk

    loaded = entry.load()
    return walk(loaded.data, config, loaded.mask_for(config))


def lines(found: Explanation) -> Iterator[str]:
    """The explanation, line by line."""
    for account in found.accounts:
        yield f"{account.stage:<9} {account.made}"
        for sentence in account.dropped:
            yield f"{'':<9}   dropped: {sentence}"
    if found.merges:
        yield "merges, in order:"
    for i, merge in enumerate(found.merges):
        kept = "" if merge.kept else "   (in a chain that was dropped)"
        yield f"{i + 1:>4}  {_choice(merge.chosen)}   sure {merge.confidence:.2f}{kept}"
        other = merge.runner_up
        yield f"{'':>4}  next best: {_choice(other) if other else 'none that is allowed'}"


def _choice(choice: Choice) -> str:
    terms = ", ".join(f"{name} {cost:.1f}" for name, cost in choice.terms.items() if round(cost, 1))
    return f"{choice.ends[0]} - {choice.ends[1]}: {choice.cost:.1f}{f' = {terms}' if terms else ''}"

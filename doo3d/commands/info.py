"""`doo3d info`: what a capture is, before hours are spent on it."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from .arguments import EndOption, EveryOption, FramesOption, InputOption, MaskOption, StartOption
from .exit_codes import NOTHING_DONE, SOME_FAILED

if TYPE_CHECKING:
    from ..inputs.capture import FrameData
    from ..inputs.inspection import Look, Summary
    from ..viz.contact_sheet import Tile

MOST_REASONS = 3  # of frames that cannot be read
_PICTURES = (".png", ".jpg", ".jpeg")


def info(
    capture: Annotated[Path, typer.Argument(metavar="INPUT", help="Whatever doo3d detect takes.")],
    sheet: Annotated[
        Path | None,
        typer.Option(
            "--contact-sheet", metavar="FILE", help="Draw the frames that are looked at into this PNG or JPEG; else nothing is."
        ),
    ] = None,
    document: Annotated[bool, typer.Option("--json", help="Print it as JSON.")] = False,
    samples: Annotated[int, typer.Option(min=1, metavar="N", help="How many frames are looked at, evenly.")] = 8,
    mask: MaskOption = None,
    input_options: InputOption = None,
    every: EveryOption = 1,
    start: StartOption = None,
    end: EndOption = None,
    frames: FramesOption = None,
) -> None:
    """Say what INPUT is: format, frames, times, image and camera, depth, masks, poses, and what looks wrong with it.

    \b
    Examples:
      doo3d info sample_clouds/crossing
      doo3d info sample_clouds/crossing --contact-sheet sheet.png --samples 12

    Nothing is written but the sheet. Exit code 0: all frames that were looked at can be read; 1: some cannot; 2: none.
    """
    from ..inputs import ReadOptions, format_class, open_capture
    from ..inputs.frame_selection import Selection, selected
    from ..inputs.inspection import summarize_capture

    opened = selected(
        open_capture(capture, masks=mask, options=ReadOptions.from_pairs(input_options or [])),
        Selection(every, start, end, frames),
    )
    if sheet:
        _check_place(sheet, capture)
    from ..viz import contact_sheet as drawing

    tiles: list[Tile] = []

    def see(look: Look, shot: FrameData | None) -> None:
        numbered = look.name.isdecimal() and int(look.name) == look.index
        caption = look.name if numbered else f"{look.index}: {look.name}"
        caption += "" if look.timestamp is None else f"   {look.timestamp:.3f} s"
        blank = drawing.Tile(caption, fault=look.error or "")
        tiles.append(blank if shot is None else drawing.tile(caption, shot.data, shot.mask))

    found = summarize_capture(opened, samples, see if sheet else lambda look, shot: None)
    if document:
        typer.echo(json.dumps(found.to_dict(), indent=2, allow_nan=False))
    else:
        typer.echo("\n".join(lines(found, format_class(found.format).what)))
    if sheet:
        _draw(sheet, f"{capture.resolve().name}   {found.format}   {_frames(found.frames)}", tiles)
        typer.echo(f"sheet -> {sheet}", err=document)
    if len(found.good) < len(found.looks):
        raise typer.Exit(SOME_FAILED if found.good else NOTHING_DONE)


def lines(found: Summary, what: str) -> list[str]:
    """What `doo3d info` prints, a line per matter; those that do not apply are left out."""
    good, cameras = found.good, {look.camera for look in found.good if look.camera is not None}
    sizes = sorted({look.size for look in good if look.size is not None})
    matters = [
        ("format", f"{found.format}: {re.split(r' ?[(:]', what)[0]}"),
        ("frames", _frames(found.frames) + (f", {found.names[0]} to {found.names[1]}" if found.names else "")),
        ("selection", f"{found.selection}, of {_frames(found.total)}" if found.selection else ""),
        ("time", _time(found)),
        *(("part", part) for part in found.parts),
        ("looked at", _looked(found)),
        ("holds", _holds(good)),
        ("image", ", ".join(f"{width}x{height}" for width, height in sizes)),
        *(("camera", f"fx {c.fx:.2f}  fy {c.fy:.2f}  cx {c.cx:.2f}  cy {c.cy:.2f} px") for c in sorted(cameras, key=repr)),
        ("depth", _depth(found)),
        ("cloud", _clouds(good)),
        *(("unreadable", text) for text in _unreadable(found.looks)),
        *(("note", note) for note in found.notes),
    ]
    return [found.path, *(f"  {label:<10}  {text}" for label, text in matters if text)]


def _frames(count: int) -> str:
    return f"{count} frame{'s' * (count != 1)}"


def _time(found: Summary) -> str:
    timing = found.timing
    if timing is None:
        return ""
    rate = f", {timing.rate:.2f} per second" if timing.rate else ""
    longest = "" if timing.longest is None else f", at most {timing.longest:.3g} s apart"
    return f"{timing.last - timing.first:.3f} s from {timing.first:.3f} s{rate}{longest}"


def _looked(found: Summary) -> str:
    if not found.looks:
        return ""
    failed = len(found.looks) - len(found.good)
    return f"{_frames(len(found.looks))}" + (f", of which {failed} cannot be read" if failed else ", all can be read")


def _unreadable(looks: Sequence[Look]) -> list[str]:
    """Why frames cannot be read: of the first few, for mostly it is the same of all."""
    reasons = [f"{look.name}: {look.error}" for look in looks if look.error is not None]
    more = len(reasons) - MOST_REASONS
    return reasons[:MOST_REASONS] + [f"{more} more, which --json names"] * (more > 0)


def _holds(good: Sequence[Look]) -> str:
    """What the frames hold, and how many of them where it is not all."""
    counts = {
        "depth": sum(look.kind == "depth" for look in good),
        "points": sum(look.kind == "cloud" for look in good),
        "colour": sum(look.color for look in good),
        "masks": sum(look.mask for look in good),
        "poses": sum(look.pose for look in good),
        "viewpoints": sum(look.viewpoint for look in good),
    }
    held = [name if count == len(good) else f"{name} in {count} of {len(good)}" for name, count in counts.items() if count]
    wanted = ("points", "viewpoints") if counts["points"] else ("depth", "masks", "poses")
    lacking = [f"no {name}" for name in wanted if not counts[name]]
    return ", ".join([*held, *lacking]) if good else ""


def _depth(found: Summary) -> str:
    missing = "" if found.missing is None else f"{found.missing:.1%} of the pixels without"
    if found.depth is None:
        return missing
    near, middle, far = found.depth
    return f"{near:.3f} to {far:.3f} m, median {middle:.3f} m; {missing}"


def _clouds(good: Sequence[Look]) -> str:
    clouds = [look for look in good if look.low is not None and look.high is not None]
    if not clouds:
        return ""
    points = sorted({look.points or 0 for look in clouds})
    ends = [
        (min(look.low[axis] for look in clouds if look.low), max(look.high[axis] for look in clouds if look.high))
        for axis in range(3)
    ]
    box = ", ".join(f"{name} {low:.3f} to {high:.3f}" for name, (low, high) in zip("xyz", ends, strict=True))
    return f"{points[0]}{f' to {points[-1]}' if len(points) > 1 else ''} points; {box} m"


def _check_place(sheet: Path, capture: Path) -> None:
    if sheet.suffix.lower() not in _PICTURES:
        raise InputError(f"--contact-sheet {sheet}: expected a name that ends in {', '.join(_PICTURES)}", code="out-suffix")
    if capture.resolve() in (sheet.resolve(), *sheet.resolve().parents):
        raise InputError(
            f"--contact-sheet {sheet}: belongs to the input, which would no longer be what it is: give another place",
            code="out-in-input",
        )


def _draw(path: Path, title: str, tiles: Sequence[Tile]) -> None:
    import cv2

    from ..outputs.atomic import write_bytes
    from ..viz.contact_sheet import sheet

    try:
        write_bytes(path, cv2.imencode(path.suffix.lower(), sheet(title, tiles)[:, :, ::-1])[1].tobytes())
    except OSError as error:
        raise InputError(
            f"--contact-sheet {path}: cannot be written to ({error.strerror or error})", code="out-unwritable"
        ) from None

"""Implement `doo3d info`: print format, frames and content of a capture, and warnings."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import DooError, InputError
from .arguments import ALL_FRAMES, DEFAULT_READING, Frames, Reading
from .exit_codes import NOTHING_DONE, SOME_FAILED
from .messages import wrapped

if TYPE_CHECKING:
    from ..inputs.capture import FrameData
    from ..inputs.inspection import CaptureSummary, FrameSummary
    from ..viz.contact_sheet import Tile

MAX_REASONS = 3  # reasons printed for unreadable frames; mostly all have the same
_LABEL = "  {:<14}  "
_PICTURE_SUFFIXES = (".png", ".jpg", ".jpeg")


def _list_formats(wanted: bool) -> None:
    """Print a line for each format, then end the command."""
    if wanted:
        from ..inputs import FORMATS

        typer.echo("\n".join(f"{name:<10}  {reader.what}" for name, reader in FORMATS.working() if hasattr(reader, "what")))
        raise typer.Exit


def info(
    capture: Annotated[Path, typer.Argument(metavar="INPUT", help="A capture, as for doo3d detect.")],
    contact_sheet: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw the checked frames into this PNG or JPEG; without it nothing is written."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
    formats: Annotated[
        bool, typer.Option("--formats", callback=_list_formats, is_eager=True, help="List the formats that can be read.")
    ] = False,
    samples: Annotated[int, typer.Option(min=1, metavar="N", help="Number of frames to check, evenly spaced.")] = 8,
    reading: Reading = DEFAULT_READING,
    selection: Frames = ALL_FRAMES,
) -> None:
    """Print a summary of INPUT: format, frames, times, image size, camera, depth, masks, poses, and warnings.

    \b
    Examples:
      doo3d info sample_clouds/crossing
      doo3d info --formats
      doo3d info sample_clouds/crossing --contact-sheet sheet.png --samples 12

    Exit code 0: all checked frames can be read; 1: some cannot; 2: none can. Nothing but the contact sheet is written.
    """
    from ..inputs import format_class
    from ..inputs.inspection import summarize_capture
    from ..types import Frame

    opened = selection.of(reading.open(capture))
    if contact_sheet:
        _check_sheet_path(contact_sheet, capture)
    from ..viz import contact_sheet as drawing

    tiles: list[Tile] = []

    def add_tile(frame: FrameSummary, loaded: FrameData | None) -> None:
        numbered = frame.name.isdecimal() and int(frame.name) == frame.index
        caption = frame.name if numbered else f"{frame.index}: {frame.name}"
        caption += "" if frame.timestamp is None else f"   {frame.timestamp:.3f} s"
        blank = drawing.Tile(caption, error=frame.error or "")
        tiles.append(blank if loaded is None else drawing.make_tile(caption, loaded.data, loaded.mask))

    found: list[tuple[str, ...]] = []

    def visit(frame: FrameSummary, loaded: FrameData | None) -> None:
        if contact_sheet:
            add_tile(frame, loaded)
        if not found and loaded is not None and isinstance(loaded.data, Frame):
            found.append(_notes_on(loaded))

    summary = summarize_capture(opened, samples, visit)
    summary = replace(summary, frame_notes=found[0] if found else ())
    if as_json:
        typer.echo(json.dumps(summary.to_dict(), indent=2, allow_nan=False))
    else:
        lines = summary_lines(summary, format_class(summary.format).what)
        typer.echo("\n".join(wrapped(line, sys.stdout, len(_LABEL.format(""))) for line in lines))
    if contact_sheet:
        _draw(contact_sheet, f"{capture.resolve().name}   {summary.format}   {_frames(summary.frames)}", tiles)
        typer.echo(f"contact sheet -> {contact_sheet}", err=as_json)
    if len(summary.readable) < len(summary.checked):
        raise typer.Exit(SOME_FAILED if summary.readable else NOTHING_DONE)


def _notes_on(loaded: FrameData) -> tuple[str, ...]:
    """Return sentences about implausible values of a frame and the chains that the default configuration finds in it."""
    from ..pipeline import detect
    from ..types.plausibility import METHOD, topic_of

    try:
        notes = detect(loaded.data, mask=loaded.mask).notes
    except DooError:
        return ()
    return tuple(note for note in notes if topic_of(note) not in (None, METHOD))


def summary_lines(summary: CaptureSummary, format_description: str) -> list[str]:
    """Return the lines that `doo3d info` prints: the capture's path, then a label and a text per line.

    Labels without content are left out. `format_description` is the attribute `what` of the format's class; its words before a
    colon or bracket are printed.
    """
    readable = summary.readable
    cameras = {frame.camera for frame in readable if frame.camera is not None}
    sizes = sorted({frame.size for frame in readable if frame.size is not None})
    rows = [
        ("format", f"{summary.format}: {re.split(r' ?[(:]', format_description)[0]}"),
        ("frames", _frames(summary.frames) + (f", {summary.names[0]} to {summary.names[1]}" if summary.names else "")),
        ("selection", f"{summary.selection}, of {_frames(summary.total)}" if summary.selection else ""),
        ("time", _time(summary)),
        *(("topic", topic) for topic in summary.topics),
        ("frames checked", _checked(summary)),
        ("content", _content(readable)),
        ("image", ", ".join(f"{width}x{height}" for width, height in sizes)),
        *(("camera", f"fx {c.fx:.2f}  fy {c.fy:.2f}  cx {c.cx:.2f}  cy {c.cy:.2f} px") for c in sorted(cameras, key=repr)),
        ("depth", _depth(summary)),
        ("cloud", _clouds(readable)),
        *(("unreadable", text) for text in _unreadable(summary.checked)),
        *(("note", note) for note in summary.notes),
        *(("warning", warning) for warning in summary.warnings),
    ]
    return [summary.path, *(_LABEL.format(label) + text for label, text in rows if text)]


def _frames(count: int) -> str:
    return f"{count} frame{'s' * (count != 1)}"


def _time(summary: CaptureSummary) -> str:
    timing = summary.timing
    if timing is None:
        return ""
    rate = f", {timing.rate:.2f} per second" if timing.rate else ""
    longest = "" if timing.longest is None else f", at most {timing.longest:.3g} s apart"
    return f"{timing.last - timing.first:.3f} s from {timing.first:.3f} s{rate}{longest}"


def _checked(summary: CaptureSummary) -> str:
    if not summary.checked:
        return ""
    failed = len(summary.checked) - len(summary.readable)
    return f"{len(summary.checked)}, of which {failed} cannot be read" if failed else f"{len(summary.checked)}, all can be read"


def _unreadable(checked: Sequence[FrameSummary]) -> list[str]:
    """Return the reasons of the first few unreadable frames, and the number of the others."""
    reasons = [f"{frame.name}: {frame.error}" for frame in checked if frame.error is not None]
    more = len(reasons) - MAX_REASONS
    return reasons[:MAX_REASONS] + [f"{more} more, listed by --json"] * (more > 0)


def _content(readable: Sequence[FrameSummary]) -> str:
    """Return the kinds of data in the frames as text, each with its number of frames unless all have it."""
    counts = {
        "depth": sum(frame.kind == "depth" for frame in readable),
        "points": sum(frame.kind == "cloud" for frame in readable),
        "color": sum(frame.color for frame in readable),
        "masks": sum(frame.mask for frame in readable),
        "poses": sum(frame.pose for frame in readable),
        "viewpoints": sum(frame.viewpoint for frame in readable),
    }
    present = [
        name if count == len(readable) else f"{name} in {count} of {len(readable)}" for name, count in counts.items() if count
    ]
    expected = ("points", "viewpoints") if counts["points"] else ("depth", "masks", "poses")
    absent = [f"no {name}" for name in expected if not counts[name]]
    return ", ".join([*present, *absent]) if readable else ""


def _depth(summary: CaptureSummary) -> str:
    missing = "" if summary.missing is None else f"{summary.missing:.1%} of the pixels without depth"
    if summary.depth is None:
        return missing
    near, median, far = summary.depth
    return f"{near:.3f} to {far:.3f} m, median {median:.3f} m; {missing}"


def _clouds(readable: Sequence[FrameSummary]) -> str:
    clouds = [frame for frame in readable if frame.low is not None and frame.high is not None]
    if not clouds:
        return ""
    counts = sorted({frame.points or 0 for frame in clouds})
    bounds = [
        (min(frame.low[axis] for frame in clouds if frame.low), max(frame.high[axis] for frame in clouds if frame.high))
        for axis in range(3)
    ]
    box = ", ".join(f"{name} {low:.3f} to {high:.3f}" for name, (low, high) in zip("xyz", bounds, strict=True))
    return f"{counts[0]}{f' to {counts[-1]}' if len(counts) > 1 else ''} points; {box} m"


def _check_sheet_path(path: Path, capture: Path) -> None:
    if path.suffix.lower() not in _PICTURE_SUFFIXES:
        raise InputError(
            f"--contact-sheet {path}: expected a name that ends in {', '.join(_PICTURE_SUFFIXES)}", code="out-suffix"
        )
    if capture.resolve() in (path.resolve(), *path.resolve().parents):
        raise InputError(
            f"--contact-sheet {path}: lies inside the input, which must not change: give a path outside of it",
            code="out-in-input",
        )


def _draw(path: Path, title: str, tiles: Sequence[Tile]) -> None:
    import cv2

    from ..outputs.atomic import write_bytes, writing
    from ..viz.contact_sheet import draw_sheet

    with writing(f"--contact-sheet {path}"):
        write_bytes(path, cv2.imencode(path.suffix.lower(), draw_sheet(title, tiles)[:, :, ::-1])[1].tobytes())

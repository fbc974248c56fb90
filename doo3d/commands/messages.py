"""Format the lines that a run prints: one per frame, and one about all frames."""

import os
import textwrap
from collections.abc import Sequence
from typing import TextIO

_NARROW_COLUMNS = 40
"""Characters per line below which lines are left to the terminal's own wrapping, since words fill such lines badly."""


def wrapped(line: str, stream: TextIO, hang: int = len("note: ")) -> str:
    """Wrap a long line between words for a terminal; for a file or a pipe, return it unchanged.

    Parameters
    ----------
    line
        the text, such as "note: the depth is in millimetres".
    stream
        the stream that it will be written to.
    hang
        number of blanks before its further lines in a terminal.
    """
    try:
        columns = os.get_terminal_size(stream.fileno()).columns if stream.isatty() else 0
    except (OSError, ValueError):  # a stream without a file
        columns = 0
    if columns < _NARROW_COLUMNS + hang:
        return line
    return textwrap.fill(line, columns, subsequent_indent=" " * hang, break_long_words=False, break_on_hyphens=False)


def frame_line(
    name: str,
    lengths: Sequence[float],
    radii: Sequence[float],
    confidences: Sequence[float],
    occluded: float | None,
    units: str,
    seconds: float,
    column: int = 0,
    trees: tuple[int, int] | None = None,
    doubtful: Sequence[tuple[float, float]] = (),
) -> str:
    """Return the line printed for a frame.

    For example "000012   1 chain   0.832 m   radius 4.2 mm   12 % occluded   confidence 0.97   48 ms". With branched objects it
    begins like "000012   1 object, 5 chains, 2 junctions", with a doubtful chain like
    "000012   0 chains, 1 doubtful (0.82 m, 0.13)".

    Parameters
    ----------
    name
        name of the frame.
    lengths, radii, confidences
        length and radius of each chain, m (px in 2-D), and its confidence, 0 to 1.
    occluded
        fraction of the segments of all chains that are occluded, 0 to 1; None without chains.
    units
        unit of `lengths` and `radii`: "m", or "px" in 2-D.
    seconds
        time that the frame took, s.
    column
        number of characters to which the name is padded with blanks.
    trees
        number of objects and of junctions; None if the detection did not look for branched objects.
    doubtful
        length, m (px in 2-D), and confidence of each doubtful chain.
    """
    count = "1 chain" if len(lengths) == 1 else f"{len(lengths)} chains"
    if trees is not None:
        from ..types.display import tree_text

        count = tree_text(trees[0], len(lengths), trees[1])
    if doubtful:
        from ..types.display import doubtful_text

        count += f", {doubtful_text(doubtful, units == 'px')}"
    parts = [name.ljust(column), count]
    if lengths:
        factor, unit = (1000, "mm") if units == "m" else (1, "px")
        digits = 3 if units == "m" else 0
        parts.append(" + ".join(f"{length:.{digits}f}" for length in lengths) + f" {units}")
        parts.append("radius " + ", ".join(f"{radius * factor:.1f}" for radius in radii) + f" {unit}")
        parts.append(f"{occluded or 0:.0%}".replace("%", " %") + " occluded")
        if confidences:
            parts.append("confidence " + ", ".join(f"{confidence:.2f}" for confidence in confidences))
    return "   ".join([*parts, f"{seconds * 1000:.0f} ms"])


def failure_line(name: str, error: str, column: int = 0) -> str:
    """Return the line printed for a failed frame, such as "000012   failed: depth/000012.png is cut off".

    `name` is the frame's name, padded with blanks to `column` characters; `error` is the reason of the failure.
    """
    return f"{name.ljust(column)}   failed: {error}"


def closing_line(frames: int, failed: int, chains: int, out: str, doubtful: int = 0) -> str:
    """Return the last line printed by a run, such as "2 of 3 frames, 2 chains, 1 doubtful -> out".

    Parameters
    ----------
    frames, failed
        number of all frames, and number of frames that failed.
    chains
        number of chains in all frames.
    out
        folder of the results, as text.
    doubtful
        number of doubtful chains in all frames.
    """
    number = f"{frames - failed} of {frames} frames" if failed else "1 frame" if frames == 1 else f"{frames} frames"
    doubted = f", {doubtful} doubtful" if doubtful else ""
    return f"{number}, {chains} chain{'' if chains == 1 else 's'}{doubted} -> {out}"

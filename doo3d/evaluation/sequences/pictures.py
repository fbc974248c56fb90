"""Draw the hard frames of a sequence: detected for itself on the left, with the whole sequence on the right."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...types import Array, Camera
from ...viz import draw
from ...viz.contact_sheet import Tile, draw_sheet, scaled_down
from ..benchmark.pictures import CROP_MARGIN_PX, write_png
from .rows import Row, SequenceResult
from .scenes import Sequence as TrueSequence


def hard_frames(result: SequenceResult, count: int) -> list[int]:
    """Return up to `count` frames of a sequence, in order: spread over those that are wrong singly, then the most hidden ones."""
    singles = [row for row in result.rows if row.variant == "single"]
    wrong = [row.frame for row in singles if not row.score.correct]
    if len(wrong) >= count:
        return [wrong[k] for k in np.linspace(0, len(wrong) - 1, count).round().astype(int)]
    rest = sorted((row for row in singles if row.score.correct), key=lambda row: (row.measured.mean(), row.frame))
    return sorted([*wrong, *(row.frame for row in rest[: count - len(wrong)])])


def draw_hard_frames(sequence: TrueSequence, result: SequenceResult, sensor: str = "d435", count: int = 6) -> Array:
    """Draw a contact sheet of the hard frames of a sequence.

    Parameters
    ----------
    sequence
        the sequence; its frames are rendered again.
    result
        its result.
    sensor
        as for the result.
    count
        number of frames at most.

    Returns
    -------
    (H, W, 3) uint8 RGB; for each frame the chains of the frame alone, and beside them those of the whole sequence.
    """
    rows = {(row.frame, row.variant): row for row in result.rows}
    crop = _crop(sequence, frames := hard_frames(result, count))
    tiles = []
    for frame in frames:
        single, whole = rows[frame, "single"], rows[frame, "sequence"]
        data = sequence.frame(frame, sensor).frame
        pictures = tuple(scaled_down(np.ascontiguousarray(draw(data, row.detection)[crop])) for row in (single, whole))
        tiles.append(Tile(f"{single.time:.2f} s   single: {_verdict(single)}   sequence: {_verdict(whole)}", pictures))
    return draw_sheet(f"{result.name}: each frame for itself, and with the whole sequence", tiles)


def write_pictures(folder: Path, sequence: TrueSequence, result: SequenceResult, sensor: str = "d435", count: int = 6) -> Path:
    """Write the contact sheet of a sequence (see `draw_hard_frames`) to `<name>.png` in a folder, and return its path.

    The folder is made if necessary.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{result.name}.png"
    write_png(path, draw_hard_frames(sequence, result, sensor, count))
    return path


def _verdict(row: Row) -> str:
    return "correct" if row.score.correct else "; ".join(row.score.reasons)


def _crop(sequence: TrueSequence, frames: Sequence[int]) -> tuple[slice, slice]:
    """Return the rows and columns of the image in which the cable is in some frames, with a margin of CROP_MARGIN_PX."""
    camera: Camera = sequence.motion.camera
    pixels = camera.project(np.concatenate([sequence.motion.axes[frame] for frame in frames]))
    size = np.array((camera.width, camera.height))
    low = np.clip(pixels.min(axis=0) - CROP_MARGIN_PX, 0, size - 1).astype(int)
    high = np.clip(pixels.max(axis=0) + CROP_MARGIN_PX, low + 1, size).astype(int)
    return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))

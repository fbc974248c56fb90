"""Draw pictures of frames: the detection on the left, the truth on the right."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ...kernels import lay_equal_chords
from ...outputs.atomic import write_bytes
from ...types import Array, Chain, Cloud, Detection, Floats, Frame, Image
from ...viz import draw
from ...viz.contact_sheet import Tile, draw_sheet, scaled_down
from ...viz.palette import DARK, LIGHT
from ..metrics.record import Record, Records
from ..scenes.model import Truth
from .tables import grouped

if TYPE_CHECKING:
    from .run import Benchmark

TRUTH_SEGMENT_LENGTH = 0.005
"""Segment length in m of the true cables, which are drawn as chains."""

CROP_MARGIN_PX = 60
"""Margin in px around cables and chains when a picture is cropped."""

FAILURES, MAX_FAILURES = "failures.png", 60
"""File name of the contact sheet of wrong frames, and the greatest number of frames on it."""

MAX_TILE_TEXT = 105
"""Greatest number of characters in the caption of a pair of pictures on the sheet."""

UNREADABLE = "cannot be read"
"""Reason that the record of a frame gives if its file cannot be read."""

_FONT = cv2.FONT_HERSHEY_DUPLEX
_CAPTION_HEIGHT_PX = 36


def frame_panels(row: Record) -> tuple[Array, Array]:
    """Draw the detection of a record over its frame, and the truth over the same frame.

    Both pictures are (H, W, 3) uint8 RGB. A frame is cropped to its cables and chains with a margin of 60 px; a cloud is drawn
    whole.
    """
    known = row.case.load()
    cables = [truth_chain(cable) for cable in known.truths if cable.length > TRUTH_SEGMENT_LENGTH]
    return panels(known.data, row.detection, Detection(matching_order(cables, row.detection)))


def panels(data: Frame | Cloud | Image, detection: Detection, truth: Detection) -> tuple[Array, Array]:
    """Draw a detection and the truth over a frame, cropped to both: (H, W, 3) uint8 RGB each."""
    if isinstance(data, Frame):
        joints = [chain.joints for chain in (*detection.chains, *truth.chains)]
        data = cropped(data, np.concatenate([*joints, np.zeros((0, 3))]))
    return draw(data, detection), draw(data, truth)


def frame_caption(row: Record) -> str:
    """Return a caption for the picture of a record, in one line.

    The caption holds the frame's name; the error, the reasons why the frame is wrong or, if it is correct, the RMS distances in
    mm; and the numbers of wrong occlusions and crossings.
    """
    distances = f"correct, RMS seen {row.rms_seen:.2f} mm"
    if row.rms_hidden > 0:
        distances += f", hidden {row.rms_hidden:.2f} mm"
    text = row.get("error") or "; ".join(row.reasons) or distances
    if missed := row.occlusions - row.occlusions_correct:
        text += f"; {missed} of {row.occlusions} occlusions wrong"
    if missed := row.crossings - row.crossings_correct:
        text += f"; upper strand wrong at {missed} of {row.crossings} crossings"
    return f"{row.frame}   {text}   (detection left, truth right)"


def with_caption(image: Array, text: str) -> Array:
    """Return the image with a line of text above it: (H + 36, W, 3) uint8 RGB.

    A text wider than the image is drawn smaller, down to half the size.

    Parameters
    ----------
    image
        (H, W, 3) uint8 RGB.
    text
        the line of text.
    """
    strip = np.full((_CAPTION_HEIGHT_PX, image.shape[1], 3), DARK, np.uint8)
    size = 0.6
    while size > 0.3 and cv2.getTextSize(text, _FONT, size, 1)[0][0] > image.shape[1] - 20:
        size -= 0.05
    cv2.putText(strip, text, (10, 24), _FONT, size, LIGHT, 1, cv2.LINE_AA)
    return np.concatenate((strip, image))


def worst(rows: Records, count: int, badness: Callable[[Record], Any]) -> list[Record]:
    """Return the `count` worst records, worst first."""
    return sorted(rows, key=badness, reverse=True)[:count]


def write_pictures(folder: Path, rows: Records, benchmark: Benchmark, count: int) -> list[Path]:
    """Write a PNG for each of the worst records of each group, and a contact sheet of the wrong ones among them.

    A picture is named after its record and the record's family. The folder is made if necessary. The sheet, failures.png, shows
    up to MAX_FAILURES wrong records. Records of cases marked as counted only are not drawn.

    Parameters
    ----------
    folder
        output folder.
    rows
        the records; one without a detection is measured again.
    benchmark
        the benchmark that measured them.
    count
        number of pictures of each group.

    Returns
    -------
    The path of each picture; the sheet comes first if any record is wrong.
    """
    folder.mkdir(parents=True, exist_ok=True)
    shown = [row for row in rows if not row.counted and UNREADABLE not in row.get("reasons", ())]
    chosen = [row for group in grouped(shown).values() for row in worst(group, count, benchmark.badness)]
    failures = worst([row for row in shown if not row.correct], MAX_FAILURES, benchmark.badness)
    paths, tiles = [], []
    for row in [*chosen, *(row for row in failures if row not in chosen)]:
        both = benchmark.panels(with_detection(row, benchmark))
        text = benchmark.caption(row)
        if row in chosen:
            paths.append(folder / f"{_file_name(row)}.png")
            write_png(paths[-1], with_caption(np.concatenate(both, axis=1), text))
        if not row.correct:
            tiles.append(Tile(text.partition("   (")[0][:MAX_TILE_TEXT], tuple(map(scaled_down, both))))
    if tiles:
        paths.insert(0, folder / FAILURES)
        write_png(paths[0], draw_sheet(f"{len(tiles)} wrong frames: detection left, truth right", tiles))
    return paths


def with_detection(row: Record, benchmark: Benchmark) -> Record:
    """Return a record with its detection; if it has none, as after reading it from disk, its case is measured again."""
    if row.detection is None:
        again = benchmark.measure(row.case)
        row.detection = next(each.detection for each in again if _file_name(each) == _file_name(row))
    return row


def _file_name(row: Record) -> str:
    parts = [str(row[key]) for key in ("family", "frame", "cable", "variant") if row.get(key) is not None]
    if parts[1].startswith(parts[0]):
        parts = parts[1:]
    return "_".join(parts).replace("/", "_").replace(" ", "_")


def write_png(path: Path, image: Array) -> None:
    """Write an image (H, W, 3) uint8 RGB to a PNG file; an existing file is replaced."""
    ok, encoded = cv2.imencode(".png", np.ascontiguousarray(image[:, :, ::-1]))
    if not ok:
        raise RuntimeError(f"{path.name}: OpenCV could not encode the picture")
    write_bytes(path, encoded.tobytes())


def truth_chain(truth: Truth) -> Chain:
    """Convert a true cable to a chain, for drawing."""
    axis = truth.line
    joints = lay_equal_chords(axis, TRUTH_SEGMENT_LENGTH)[0]
    seen = np.ones(len(axis), dtype=bool) if truth.seen is None else truth.seen[np.arange(len(axis)) % len(truth.axis)]
    middle = (np.arange(len(joints) - 1) + 0.5) / (len(joints) - 1) * (len(axis) - 1)
    return Chain(joints, TRUTH_SEGMENT_LENGTH, truth.radius, occluded=~seen[np.round(middle).astype(int)])


def matching_order(cables: list[Chain], detection: Detection) -> tuple[Chain, ...]:
    """Return the cables in the order of their matching chains, so that both have equal colors; unmatched cables come last."""
    distances = np.array(
        [[cKDTree(cable.joints).query(chain.joints)[0].mean() for chain in detection.chains] for cable in cables]
    )
    rows, columns = linear_sum_assignment(distances.reshape(len(cables), len(detection.chains)))
    order = dict(zip(rows.tolist(), columns.tolist(), strict=True))
    return tuple(cables[k] for k in sorted(range(len(cables)), key=lambda k: order.get(k, len(detection.chains))))


def cropped(frame: Frame, points: Floats) -> Frame:
    """Return the frame cropped to points (N, 3) m with a margin of CROP_MARGIN_PX; the whole frame if there are none."""
    camera, points = frame.camera, points[points[:, 2] > 0]
    if not len(points):
        return frame
    pixels = camera.project(points)
    low = np.clip(pixels.min(axis=0) - CROP_MARGIN_PX, 0, (camera.width - 1, camera.height - 1)).astype(int)
    high = np.clip(pixels.max(axis=0) + CROP_MARGIN_PX, low + 1, (camera.width, camera.height)).astype(int)
    crop = (slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0])))
    (width, height), (left, top) = (high - low).tolist(), low.tolist()
    cropped_camera = replace(camera, cx=camera.cx - left, cy=camera.cy - top, width=width, height=height)
    return Frame(None if frame.color is None else frame.color[crop], frame.depth[crop], cropped_camera, frame.name)

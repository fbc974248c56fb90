"""Draw the detection in a frame beside the truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ...kernels import lay_equal_chords
from ...outputs.atomic import write_bytes
from ...types import Array, Chain, Detection, Floats, Frame
from ...viz import draw
from ...viz.palette import DARK, LIGHT
from ..scenes.model import Truth
from .rows import Row

TRUTH_SEGMENT_LENGTH = 0.005
"""m, of the truth as it is drawn."""

CROP_MARGIN_PX = 60
"""px shown round cables and chains."""

_FONT = cv2.FONT_HERSHEY_DUPLEX
_CAPTION_HEIGHT_PX = 36


def picture(row: Row) -> Array:
    """Draw the detection over its frame, with the truth over the same frame to the right and a caption above.

    Parameters
    ----------
    row
        the result for one frame, with its case and its detection.

    Returns
    -------
    (H, W, 3) uint8 RGB. A frame is cropped to its cables and chains with a margin of 60 px; a cloud is drawn whole.

    Raises
    ------
    ValueError : the row has no case or no detection.
    """
    if row.case is None or row.detection is None:
        raise ValueError(f"{row.name}: the frame is unknown")
    known = row.case.load()
    cables = [truth_chain(cable) for cable in known.truths if cable.length > TRUTH_SEGMENT_LENGTH]
    both = row.detection, Detection(matching_order(cables, row.detection))
    data = known.data
    if isinstance(data, Frame):
        joints = [chain.joints for detection in both for chain in detection.chains]
        data = cropped(data, np.concatenate([*joints, np.zeros((0, 3))]))
    return with_caption(np.concatenate([draw(data, detection) for detection in both], axis=1), caption(row))


def caption(row: Row) -> str:
    """Return a caption for the picture of a row, in one line.

    It holds the frame's name; the error, the reasons why the frame is wrong or, if it is correct, the RMS distances in mm; and
    the numbers of occlusions and crossings that are wrong.
    """
    score = row.score
    distances = f"correct, RMS seen {score.rms_seen:.2f} mm"
    if score.rms_hidden > 0:
        distances += f", hidden {score.rms_hidden:.2f} mm"
    text = row.error or "; ".join(score.reasons) or distances
    if missed := score.occlusions - score.occlusions_correct:
        text += f"; {missed} of {score.occlusions} occlusions wrong"
    if missed := score.crossings - score.crossings_correct:
        text += f"; upper strand wrong at {missed} of {score.crossings} crossings"
    return f"{row.name}   {text}   (detection left, truth right)"


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


def write_pictures(folder: Path, rows: Sequence[Row]) -> list[Path]:
    """Write a PNG for each row into a folder: the detection over the frame, with the truth over the same frame to the right.

    A picture is named `<family>_<frame>.png`, or `<frame>.png` if the frame's name begins with its family. The folder is made if
    necessary.

    Returns
    -------
    The path of each picture, in the order of the rows.

    Raises
    ------
    ValueError : a row has no case or no detection.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for row in rows:
        name = row.name if row.name.startswith(row.family) else f"{row.family}_{row.name}"
        paths.append(folder / f"{name.replace('/', '_').replace(' ', '_')}.png")
        write_png(paths[-1], picture(row))
    return paths


def write_png(path: Path, image: Array) -> None:
    """Write an image (H, W, 3) uint8 RGB to a PNG file; an existing file is replaced."""
    ok, encoded = cv2.imencode(".png", np.ascontiguousarray(image[:, :, ::-1]))
    if not ok:
        raise RuntimeError(f"{path.name}: OpenCV could not encode the picture")
    write_bytes(path, encoded.tobytes())


def truth_chain(truth: Truth) -> Chain:
    """Return a cable as a chain, to be drawn."""
    axis = np.vstack((truth.axis, truth.axis[:1])) if truth.closed else truth.axis
    joints = lay_equal_chords(axis, TRUTH_SEGMENT_LENGTH)[0]
    seen = np.ones(len(axis), dtype=bool) if truth.seen is None else truth.seen[np.arange(len(axis)) % len(truth.axis)]
    middle = (np.arange(len(joints) - 1) + 0.5) / (len(joints) - 1) * (len(axis) - 1)
    return Chain(joints, TRUTH_SEGMENT_LENGTH, truth.radius, occluded=~seen[np.round(middle).astype(int)])


def matching_order(cables: list[Chain], detection: Detection) -> tuple[Chain, ...]:
    """Return the cables in the order of the chains that lie on them, so that colors agree; those without a chain last."""
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

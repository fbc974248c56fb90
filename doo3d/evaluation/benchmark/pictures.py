"""What was found in a scene beside what is there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ...kernels.equal_chords import lay_equal_chords
from ...outputs.atomic import write_bytes
from ...types import Array, Chain, Detection, Floats, Frame
from ...viz import draw
from ...viz.palette import DARK, LIGHT
from ..scenes.model import Truth
from .rows import Row

LINK = 0.005  # m, segment length of the truth as it is drawn
MARGIN = 60  # px round what is shown
_FONT = cv2.FONT_HERSHEY_DUPLEX
_STRIP = 36  # px, height of the caption


def picture(row: Row) -> Array:
    """(H, W, 3) uint8 RGB: the chains over what the camera saw, and the truth beside them, the caption above.

    Of a frame, the part is shown that the cables and the chains are in.

    Raises
    ------
    ValueError : the row does not know its frame.
    """
    if row.case is None or row.detection is None:
        raise ValueError(f"{row.name}: the frame is not known")
    known = row.case.load()
    cables = [_chain(cable) for cable in known.truths if cable.length > LINK]
    found, truth = row.detection, Detection(_in_order(cables, row.detection))
    data = known.data
    if isinstance(data, Frame):
        data = _cropped(
            data, np.concatenate([chain.joints for one in (found, truth) for chain in one.chains] + [np.zeros((0, 3))])
        )
    return captioned(np.concatenate([draw(data, one) for one in (found, truth)], axis=1), caption(row))


def caption(row: Row) -> str:
    """A row in a line: why it is wrong, or by how much it is right."""
    score = row.score
    right = f"correct, RMS seen {score.rms_seen:.2f} mm" + (f", hidden {score.rms_hidden:.2f} mm" if score.rms_hidden > 0 else "")
    reasons = row.error or "; ".join(score.reasons) or right
    if missed := score.occlusions - score.occlusions_correct:
        reasons += f"; {missed} of {score.occlusions} occlusions wrong"
    if missed := score.crossings - score.crossings_right:
        reasons += f"; upper strand wrong at {missed} of {score.crossings} crossings"
    return f"{row.name}   {reasons}   (found left, truth right)"


def captioned(image: Array, text: str) -> Array:
    """The (H, W, 3) image with a line of text in a strip above it, as large as fits."""
    strip = np.full((_STRIP, image.shape[1], 3), DARK, np.uint8)
    size = 0.6
    while size > 0.3 and cv2.getTextSize(text, _FONT, size, 1)[0][0] > image.shape[1] - 20:
        size -= 0.05
    cv2.putText(strip, text, (10, 24), _FONT, size, LIGHT, 1, cv2.LINE_AA)
    return np.concatenate((strip, image))


def write_pictures(folder: Path, rows: Sequence[Row]) -> list[Path]:
    """A PNG per row into `folder`, named by family and frame; it is made when it is not there."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for row in rows:
        name = row.name if row.name.startswith(row.family) else f"{row.family}_{row.name}"
        paths.append(folder / f"{name.replace('/', '_').replace(' ', '_')}.png")
        write_png(paths[-1], picture(row))
    return paths


def write_png(path: Path, image: Array) -> None:
    """Write (H, W, 3) uint8 RGB."""
    good, encoded = cv2.imencode(".png", np.ascontiguousarray(image[:, :, ::-1]))
    if not good:
        raise RuntimeError(f"{path.name}: OpenCV could not encode the picture")
    write_bytes(path, encoded.tobytes())


def _chain(truth: Truth) -> Chain:
    axis = np.vstack((truth.axis, truth.axis[:1])) if truth.closed else truth.axis
    joints = lay_equal_chords(axis, LINK)[0]
    seen = np.ones(len(axis), dtype=bool) if truth.seen is None else truth.seen[np.arange(len(axis)) % len(truth.axis)]
    middle = (np.arange(len(joints) - 1) + 0.5) / (len(joints) - 1) * (len(axis) - 1)
    return Chain(joints, LINK, truth.radius, occluded=~seen[np.round(middle).astype(int)])


def _in_order(cables: list[Chain], found: Detection) -> tuple[Chain, ...]:
    """The cables in the order of the chains that lie on them, so that colours agree; those without one last."""
    gap = np.array([[cKDTree(cable.joints).query(chain.joints)[0].mean() for chain in found.chains] for cable in cables])
    rows, columns = linear_sum_assignment(gap.reshape(len(cables), len(found.chains)))
    order = dict(zip(rows.tolist(), columns.tolist(), strict=True))
    return tuple(cables[k] for k in sorted(range(len(cables)), key=lambda k: order.get(k, len(found.chains))))


def _cropped(frame: Frame, points: Floats) -> Frame:
    """The part of a frame that points (N, 3) m are in, and MARGIN round it; all of it where there are none."""
    camera, points = frame.camera, points[points[:, 2] > 0]
    if not len(points):
        return frame
    pixels = camera.project(points)
    low = np.clip(pixels.min(axis=0) - MARGIN, 0, (camera.width - 1, camera.height - 1)).astype(int)
    high = np.clip(pixels.max(axis=0) + MARGIN, low + 1, (camera.width, camera.height)).astype(int)
    part = (slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0])))
    (width, height), (left, top) = (high - low).tolist(), low.tolist()
    smaller = replace(camera, cx=camera.cx - left, cy=camera.cy - top, width=width, height=height)
    return Frame(None if frame.color is None else frame.color[part], frame.depth[part], smaller, frame.name)

"""The picture of a frame: its chains drawn over what the camera saw."""

from __future__ import annotations

import cv2
import numpy as np

from ..types import Array, Chain, Cloud, Detection, Frame, Image
from .backdrop import backdrop_of, planar_backdrop
from .canvas import Canvas
from .chain_ribbon import Strand, bridges
from .palette import DARK, LIGHT, UNIT_PX, Rgb, chain_color

_CAPTIONS = 8  # chains that have a line of their own in the caption
_FONT = cv2.FONT_HERSHEY_DUPLEX


def draw(data: Frame | Cloud | Image | Array, detection: Detection) -> Array:
    """The chains over the colour image (the depth in colours where there is none, the points of a cloud).

    Each chain has a colour of its own (that of its id where it has one), a ribbon as wide as the object and a line through
    its joints; where it is occluded the line is dashed. A disc marks the first joint, a ring the last. Of two strands that
    cross, the upper is drawn on top, between two white lines where it is known; of a cloud without a viewpoint, the nearer
    in the picture.

    Parameters
    ----------
    data : what the detection was made from; an image may be an array (H, W, 3) uint8 RGB.
    detection : its chains.

    Returns
    -------
    (H, W, 3) uint8 RGB, of the frame's size.
    """
    backdrop = backdrop_of(data)
    if detection.mode == "2d":
        backdrop = planar_backdrop(backdrop.image)
    height, width = backdrop.image.shape[:2]
    unit = max(1.0, np.sqrt(height * width) / UNIT_PX)
    strands = [Strand.of(chain, backdrop, color, unit) for chain, color in zip(detection.chains, _colors(detection), strict=True)]
    canvas = Canvas(height, width)
    for strand in reversed(strands):
        strand.paint(canvas, np.ones(len(strand.hidden), dtype=bool))
    same_view = not isinstance(data, Cloud) or data.viewpoint is not None
    for index, chosen, known in bridges(strands, detection.crossings if same_view else ()):
        strands[index].paint(canvas, chosen)
        if known:
            strands[index].bridge(canvas, chosen)
    for strand in reversed(strands):
        strand.ends(canvas)
    return _caption(canvas.over(backdrop.image), canvas, detection)


def caption_lines(detection: Detection) -> list[str]:
    """One line per chain: length, radius and how much of it is occluded."""
    return [_line(chain, detection.mode == "3d") for chain in detection.chains]


def _colors(detection: Detection) -> list[Rgb]:
    """A chain's colour is that of its id, the same in all frames, or of its place where it has none."""
    return [chain_color(i if chain.id is None else chain.id) for i, chain in enumerate(detection.chains)]


def _line(chain: Chain, metric: bool) -> str:
    if metric:
        text = f"{chain.length:.3f} m   r {chain.radius * 1000:.1f} mm"
    else:
        text = f"{chain.length:.0f} px   r {chain.radius:.1f} px"
    hidden = float(chain.occluded.mean())
    return text + (f"   {max(hidden, 0.01):.0%} occluded" if hidden else "")


def _caption(image: Array, drawn: Canvas, detection: Detection) -> Array:
    """The image with a panel that names the chains, in the corner where it covers least of them."""
    lines = caption_lines(detection) or ["nothing found"]
    if len(lines) > _CAPTIONS:
        lines = [*lines[: _CAPTIONS - 1], f"and {len(lines) - _CAPTIONS + 1} more"]
    height, width = image.shape[:2]
    size = max(0.36, 0.42 * float(np.sqrt(height * width)) / UNIT_PX)
    (_, tall), _ = cv2.getTextSize("0", _FONT, size, 1)
    wide = max(cv2.getTextSize(line, _FONT, size, 1)[0][0] for line in lines)
    pad, row = tall, round(2.1 * tall)
    panel = (wide + 4 * pad, row * len(lines) + pad)
    if panel[0] > width or panel[1] > height:
        return image
    left, top = _free_corner(drawn.sheet[:, :, 3] > 0, panel, margin=pad)
    canvas = Canvas(height, width)
    canvas.box((left, top), (left + panel[0], top + panel[1]), DARK, 0.72)
    picture, colors = canvas.over(image), _colors(detection)
    thick = max(1, round(size * 1.3))
    for i, line in enumerate(lines):
        base = top + pad // 2 + row * i + (row + tall) // 2
        text_at = left + pad
        if i < len(detection.chains) and not line.startswith("and "):
            cv2.rectangle(picture, (left + pad, base - tall), (left + 2 * pad, base), colors[i], -1)
            text_at += 2 * pad
        cv2.putText(picture, line, (text_at, base), _FONT, size, LIGHT, thick, cv2.LINE_AA)
    return picture


def _free_corner(taken: Array, panel: tuple[int, int], margin: int) -> tuple[int, int]:
    """(left, top) px of the corner where a panel (width, height) lies over the fewest drawn pixels; top left first."""
    height, width = taken.shape
    right, bottom = max(width - panel[0] - margin, 0), max(height - panel[1] - margin, 0)
    margin = min(margin, right, bottom)
    corners = [(margin, margin), (right, margin), (margin, bottom), (right, bottom)]
    return min(corners, key=lambda at: int(taken[at[1] : at[1] + panel[1], at[0] : at[0] + panel[0]].sum()))

"""Draw the picture of a frame: its chains over the image."""

import cv2
import numpy as np

from ..geometry.polyline import net_turns
from ..judge.notes import COIL
from ..types import Array, Chain, Cloud, Detection, Floats, Frame, Image
from ..types.arguments import refused
from ..types.display import tree_text
from .backdrop import Backdrop, backdrop_of, planar_backdrop
from .canvas import Canvas
from .chain_ribbon import ChainRibbon, upper_pieces
from .palette import DARK, LIGHT, UNIT_PX, all_chains, chain_numbers, line_unit
from .segment_kinds import DEPTH_FILLED, FROM_TIME, segment_kinds
from .writing import write_outlined

_MAX_CAPTION_LINES = 8
_FONT = cv2.FONT_HERSHEY_DUPLEX
LABEL_SIZE, LABEL_OFFSET_PX = 0.5, 9.0  # of the number of a chain, at unit size


def draw(data: Frame | Cloud | Image | Array, detection: Detection) -> Array:
    """Draw the chains of a detection over its input: the color image, the depth in shades of gray, or the points of a cloud.

    - Each chain has its own color. If frames are tracked, an object has the same color in all of them.
    - A ribbon shows the width of the object, a line its center line with the joints. Where the object is occluded, the ribbon is
      pale and the line dashed; where other frames of a sequence filled it in, the line is white between the dashes.
    - A doubtful chain, one of `detection.doubtful` or with a confidence below 0.5, is a thin gray line, and the panel says so.
    - A disc marks the first joint, a ring the last. With several chains, the number of each stands beside its first joint, or its
      middle if that is at a junction: its id, or without tracking its index.
    - Where chains meet at a junction, a white square stands for their ends.
    - Where chains cross in the view, the upper one is drawn on top, between two white lines if the detection knows which one is
      upper. For a cloud without a viewpoint, the one nearer in the picture is drawn on top.
    - The word "coil" stands in the middle of the coil that a note names.
    - A panel in a corner lists number, length, radius and occluded share of each chain; where there are junctions, first how many
      objects, chains and junctions there are.

    Parameters
    ----------
    data
        the input that the detection was made from; an image may be an array (H, W, 3) uint8 RGB.
    detection
        the chains to draw, in the coordinates of `data`, or with the camera's `pose` in theirs.

    Returns
    -------
    (H, W, 3) uint8 RGB
        of the size of the input image; for a cloud, 1280 x 720 px.
    """
    if not isinstance(detection, Detection):
        raise refused(detection, "detection", "a doo3d.Detection, as detect returns it")
    detection, backdrop = detection.in_camera(), backdrop_of(data)
    if detection.mode == "2d":
        backdrop = planar_backdrop(backdrop.image)
    height, width = backdrop.image.shape[:2]
    unit = line_unit(backdrop.image)
    drawn = [ChainRibbon.of(chain, backdrop, style, unit) for chain, style, _ in all_chains(detection)]
    strands = drawn[: len(detection.chains)]
    canvas = Canvas(height, width)
    for strand in reversed(drawn):
        strand.paint(canvas, np.ones(len(strand.occluded), dtype=bool))
    same_view = not isinstance(data, Cloud) or data.viewpoint is not None
    for index, chosen, known in upper_pieces(strands, detection.crossings if same_view else ()):
        strands[index].paint(canvas, chosen)
        if known:
            strands[index].paint_bridge_edges(canvas, chosen)
    joined = {end for junction in detection.junctions for end in junction.ends}
    for index in reversed(range(len(drawn))):
        drawn[index].paint_ends(canvas, ((index, 0) not in joined, (index, 1) not in joined))
    _paint_junctions(canvas, detection, backdrop, unit)
    picture = canvas.blend_over(backdrop.image)
    _caption(picture, canvas, detection)
    if len(strands) > 1:
        for index, (number, strand) in enumerate(zip(chain_numbers(detection), strands, strict=True)):
            _label(picture, str(number), strand.points[len(strand.points) // 2 if (index, 0) in joined else 0], unit)
    if drawn and any(note.startswith(COIL) for note in detection.notes):
        turns = [net_turns(chain.joints) for chain, _, _ in all_chains(detection)]
        _label(picture, COIL, drawn[int(np.argmax(turns))].points.mean(axis=0), unit)
    return picture


def _label(picture: Array, text: str, joint: Floats, unit: float) -> None:
    """Write a number or a word beside a position (2,) px, in white with a dark rim; skip a position out of view."""
    if not ((joint >= 0) & (joint < picture.shape[1::-1])).all():
        return
    size = LABEL_SIZE * unit
    (width, height), _ = cv2.getTextSize(text, _FONT, size, 1)
    limit = np.array(picture.shape[1::-1]) - (width + 2, 2)
    offset = LABEL_OFFSET_PX * unit
    at = np.floor(np.clip(joint + np.array((offset, -offset)), (2, height + 2), limit))
    write_outlined(picture, text, at, size, (4.0 * unit, 1.4 * unit))


def _paint_junctions(canvas: Canvas, detection: Detection, backdrop: Backdrop, unit: float) -> None:
    """Mark each junction with a white diamond."""
    if not detection.junctions:
        return
    corners = np.array(((-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)))
    for point in backdrop.projection.project(np.array([junction.position for junction in detection.junctions])):
        if np.isfinite(point).all():
            canvas.polygon(point + 10.0 * unit * corners, DARK, 0.85)
            canvas.polygon(point + 8.0 * unit * corners, LIGHT, 1.0)


def caption_lines(detection: Detection) -> list[str]:
    """Return a line of text for each chain, doubtful ones last, such as "1.204 m   r 5.0 mm   12% occluded   5% depth filled".

    The line gives length and radius, the share of the segments that is occluded, the share that other frames filled in (which is
    part of the occluded share), and the share that is seen but whose depth was filled in. Lengths are in px in 2-D. A share of 0
    is left out. A doubtful chain has "doubtful (confidence 0.12)" at the end.
    """
    return [_line(chain, detection.mode == "3d", style.doubt) for chain, style, _ in all_chains(detection)]


def _line(chain: Chain, in_metres: bool, doubt: str) -> str:
    if in_metres:
        text = f"{chain.length:.3f} m   r {chain.radius * 1000:.1f} mm"
    else:
        text = f"{chain.length:.0f} px   r {chain.radius:.1f} px"
    kinds = segment_kinds(chain)
    shares = (
        (float(chain.occluded.mean()), "occluded"),
        (float((kinds == FROM_TIME).mean()), "from other frames"),
        (float((kinds == DEPTH_FILLED).mean()), "depth filled"),
    )
    return "".join([text, *(f"   {max(share, 0.01):.0%} {name}" for share, name in shares if share), f"   {doubt}" * bool(doubt)])


def _caption(picture: Array, drawn: Canvas, detection: Detection) -> None:
    """Draw a panel that describes the chains, in the corner where it covers the least of them."""
    lines = caption_lines(detection) or ["nothing found"]
    if len(lines) > 1:
        lines = [f"{number or '-'}   {line}" for (_, _, number), line in zip(all_chains(detection), lines, strict=True)]
    head = [tree_text(len(detection.objects), len(detection.chains), len(detection.junctions))] if detection.junctions else []
    if len(lines) > _MAX_CAPTION_LINES:
        lines = [*lines[: _MAX_CAPTION_LINES - 1], f"and {len(lines) - _MAX_CAPTION_LINES + 1} more"]
    lines = [*head, *lines]
    height, width = picture.shape[:2]
    size = max(0.36, 0.42 * float(np.sqrt(height * width)) / UNIT_PX)
    (_, letter_height), _ = cv2.getTextSize("0", _FONT, size, 1)
    text_width = max(cv2.getTextSize(line, _FONT, size, 1)[0][0] for line in lines)
    pad, row = letter_height, round(2.1 * letter_height)
    panel = (text_width + 4 * pad, row * len(lines) + pad)
    if panel[0] > width or panel[1] > height:
        return
    left, top = _free_corner(drawn.layer[:, :, 3], panel, margin=pad)
    covered = picture[top : top + panel[1] + 1, left : left + panel[0] + 1]
    canvas = Canvas(*covered.shape[:2])
    canvas.box((0, 0), panel, DARK, 0.72)
    covered[:] = canvas.blend_over(covered)
    colors = [style.color for _, style, _ in all_chains(detection)]
    thickness = max(1, round(size * 1.3))
    for i, line in enumerate(lines):
        base = top + pad // 2 + row * i + (row + letter_height) // 2
        text_at = left + pad
        if 0 <= i - len(head) < len(colors) and not line.startswith("and "):
            cv2.rectangle(picture, (left + pad, base - letter_height), (left + 2 * pad, base), colors[i - len(head)], -1)
            text_at += 2 * pad
        cv2.putText(picture, line, (text_at, base), _FONT, size, LIGHT, thickness, cv2.LINE_AA)


def _free_corner(drawn: Array, panel: tuple[int, int], margin: int) -> tuple[int, int]:
    """Return (left, top) px of a panel in the corner with the fewest drawn pixels; the top left wins ties.

    Parameters
    ----------
    drawn
        (H, W), above 0 where something is drawn.
    panel
        (width, height) px.
    margin
        distance from the border of the picture, px.
    """
    height, width = drawn.shape
    right, bottom = max(width - panel[0] - margin, 0), max(height - panel[1] - margin, 0)
    margin = min(margin, right, bottom)
    corners = [(margin, margin), (right, margin), (margin, bottom), (right, bottom)]
    return min(corners, key=lambda at: int(np.count_nonzero(drawn[at[1] : at[1] + panel[1], at[0] : at[0] + panel[0]])))

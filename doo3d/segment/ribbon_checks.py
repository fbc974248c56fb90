"""Select objects among the strands traced in an image: long, of constant width and color, with sharp edges, and no shadows."""

from typing import NamedTuple

import cv2
import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from ..geometry.order_statistics import SPREAD_PERCENTILES, finite_percentiles
from ..types import Array, Bools, Floats
from .ribbons import BORDER_PX, TracedStrand

PROFILE_SPACING_PX = 0.5
"""Distance in px between the samples of a profile across a strand."""

CORE_WIDTHS, SIDE_GAP_PX, SIDE_WIDTHS = 0.3, 1.5, 1 / 3
"""Half-width of a strand's core, in widths; distance from the strand's edge to the side region, in px; width of the side region,
in widths (at least 2 px)."""

MIN_EDGE_WIDTHS, MAX_EDGE_WIDTHS, EDGE_SAMPLES = 0.2, 0.95, 9
"""Range of distances from the middle line, in widths, in which the edge of a strand is searched, and the number of samples on
either side along the strand over which its colors are averaged."""

MIN_LENGTH_PX, MIN_LENGTH_WIDTHS = 60.0, 8.0
"""Minimum length of an object, in px and in widths."""

MIN_MEAN_SCORE, MIN_SEEN = 2.2, 0.6
"""Minimum mean score of an object, and minimum fraction of its length at which a ribbon is detected."""

MAX_WIDTH_CHANGE = 3.2
"""Maximum ratio of the outer SPREAD_PERCENTILES of the widths along an object."""

MAX_EDGE_PX = 5.5
"""Maximum width in px of the transition of color at an object's edge; shadows of distant objects have wider edges."""

LIGHT, DARK = (np.arange(256) / 255.0) ** 2.2, 0.01
"""Linear light of each 8-bit value (gamma 2.2), 0 to 1, and the light that is added to avoid logarithms of zero."""

MIN_SHADOW_LIGHT, SHADOW_COLOR_SHARE, SHADOW_COLOR = -2.4, 0.25, 0.08
"""Limits of a shadow: the minimum mean logarithm of the ratio of light in it and beside it, and the maximum range of the
logarithms of red, green and blue: the second times their mean, without sign, plus the third."""

SOFT_EDGE_PX, FAINT_LIGHT = 2.6, -0.25
"""Minimum width in px of the transition at the edge of a shadow, except for faint shadows, whose mean logarithm is above the
second."""

MIN_RANK_SHARE = 0.15
"""Minimum rank (score times length times root of width) of an object, as a fraction of the highest rank."""

OVERLAP_WIDTHS, OVERLAP_PX, MAX_OVERLAP = 1.3, 5.0, 0.5
"""Maximum fraction (third) of a strand within a chosen strand drawn with the first times its width plus the second in px: edges
and highlights of the chosen strand overlap more."""


class CheckedStrand(NamedTuple):
    """A strand and the reason why it is no object.

    Attributes
    ----------
    line
        (P, 2) px, the strand, moved to the middle between its edges if its profile was measured.
    width
        px between its edges.
    fault
        why the strand is no object: "short", "uneven", "border" or "shadow"; "" for an object.
    """

    line: Floats
    width: float
    fault: str


def choose_strands(strands: list[TracedStrand], color: Array, lab: Array) -> tuple[list[CheckedStrand], list[CheckedStrand]]:
    """Return the strands that are objects, the highest rank first, and the rejected shadows and joints.

    Parameters
    ----------
    strands
        the strands traced in the image.
    color
        (H, W, 3) uint8 RGB.
    lab
        (H, W, 3) float32, the same image in CIELAB.
    """
    ranks = np.array([(strand.mean_score - 1) * strand.length * np.sqrt(strand.median_width) for strand in strands])
    covered, least = np.zeros(color.shape[:2], dtype=bool), 0.0
    chosen, shadows = list[CheckedStrand](), list[CheckedStrand]()
    for k in np.argsort(-ranks, kind="stable").tolist():
        if ranks[k] < least:
            break
        entry = _check(strands[k], color, lab)
        column, row = (np.clip(np.rint(entry.line[:, d]).astype(int), 0, covered.shape[1 - d] - 1) for d in (0, 1))
        if entry.fault not in ("", "shadow") or covered[row, column].mean() > MAX_OVERLAP:
            continue
        if entry.fault:
            shadows.append(entry)
            continue
        least = least or MIN_RANK_SHARE * ranks[k]
        chosen.append(entry)
        covered |= draw_strand(entry.line, OVERLAP_WIDTHS * entry.width + OVERLAP_PX, covered.shape)
    return chosen, shadows


def draw_strand(line: Floats, width: float, shape: tuple[int, ...]) -> Bools:
    """Return the pixels (H, W) bool of an image of the given shape within half of `width` px of a line (P, 2) px."""
    mask = np.zeros(shape, np.uint8)
    cv2.polylines(mask, [np.rint(line * 8).astype(np.int32)[:, None]], False, 1, max(1, round(width)), cv2.LINE_8, 3)
    return np.asarray(mask > 0)


def _check(strand: TracedStrand, color: Array, lab: Array) -> CheckedStrand:
    """Measure the profile across a strand in an image (H, W, 3), and find the reason why it is no object."""
    width, seen = strand.median_width, strand.seen
    fault = _fault_without_profile(strand, color.shape)
    if fault:
        return CheckedStrand(strand.points, width, fault)
    normal = np.column_stack((-np.sin(strand.angle), np.cos(strand.angle)))
    offset = np.arange(-1.5 * width - 3, 1.5 * width + 3 + PROFILE_SPACING_PX, PROFILE_SPACING_PX)
    x, y = np.moveaxis(strand.points[:, None] + offset[:, None] * normal[:, None], 2, 0).astype(np.float32)
    profile, values = (cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE) for image in (lab, color))
    side_px = width / 2 + SIDE_GAP_PX + max(2.0, SIDE_WIDTHS * width)
    core, side = np.abs(offset) < CORE_WIDTHS * width, (np.abs(offset) > width / 2 + SIDE_GAP_PX) & (np.abs(offset) < side_px)
    line, between = _centered(strand, profile, offset, normal)
    edge_px = _edge_px(np.median(profile[seen].astype(float), axis=0).astype(np.float32), offset, core, side)
    if _is_shadow(_light_left(values, offset, core, side, seen), edge_px):
        fault = "shadow"
    elif edge_px > MAX_EDGE_PX:
        fault = "uneven"
    return CheckedStrand(line, between, fault)


def _fault_without_profile(strand: TracedStrand, shape: tuple[int, ...]) -> str:
    """Return the reason why a strand in an image of the given shape is no object, by all but its profile; "" for an object."""
    width, seen = strand.median_width, strand.seen
    if strand.length < max(MIN_LENGTH_PX, MIN_LENGTH_WIDTHS * width):
        return "short"
    border = np.min((*strand.points.T, *(np.array((shape[1] - 1, shape[0] - 1))[:, None] - strand.points.T)), axis=0)
    if np.median(border) < width / 2 + BORDER_PX:
        return "border"
    narrow, _, wide = finite_percentiles(strand.width[seen], SPREAD_PERCENTILES)
    is_uneven = strand.mean_score < MIN_MEAN_SCORE or seen.mean() < MIN_SEEN or wide > MAX_WIDTH_CHANGE * narrow
    return "uneven" if is_uneven else ""


def _centered(strand: TracedStrand, profile: Array, offset: Floats, normal: Floats) -> tuple[Floats, float]:
    """Return the strand's points moved to the middle between its edges, (P, 2) px, and the distance between the edges in px.

    profile : (P, F, 3) CIELAB, at F offsets (F,) px along the normals (P, 2).
    """
    width = strand.median_width
    along = cv2.blur(profile, (1, 2 * EDGE_SAMPLES + 1), borderType=cv2.BORDER_REPLICATE)
    change, at = np.linalg.norm(along[:, 2:] - along[:, :-2], axis=2), offset[1:-1]
    edges = []
    for sign in (-1, 1):
        near = (sign * at > MIN_EDGE_WIDTHS * width) & (sign * at < MAX_EDGE_WIDTHS * width)
        edges.append(at[near][np.argmax(change[:, near], axis=1)])
    apart = edges[1] - edges[0]
    between = float(np.median(apart[strand.seen]))
    shift = np.where(np.abs(apart - between) < 0.3 * between, (edges[0] + edges[1]) / 2, 0.0)
    shift = uniform_filter1d(median_filter(shift, 15, mode="nearest"), 7, mode="nearest")
    return strand.points + shift[:, None] * normal, between


def _edge_px(profile: Floats, offset: Floats, core: Bools, side: Bools) -> float:
    """Return the width in px of the color transition at the softer edge of a strand, from its median profile (F, 3)."""
    slope = np.linalg.norm(np.diff(profile, axis=0), axis=1) / PROFILE_SPACING_PX
    inside, outside = (np.median(profile[part].astype(float), axis=0).astype(np.float32) for part in (core, side))
    step = float(np.linalg.norm(inside - outside))
    return step / max(min(float(slope[offset[:-1] < 0].max()), float(slope[offset[:-1] > 0].max())), 1e-3)


def _light_left(values: Array, offset: Floats, core: Bools, side: Bools, seen: Bools) -> Floats:
    """Return the logarithm of the ratio of light on a strand and on its sides: (3,) for red, green and blue.

    values : (P, F, 3) uint8, the colors of its profile.
    """
    before, after, own = (np.median(LIGHT[values[:, part]], axis=1) for part in (side & (offset < 0), side & (offset > 0), core))
    left = np.log((own + DARK) / ((before + after) / 2 + DARK))
    return np.asarray(np.median(left[seen], axis=0))


def _is_shadow(left: Floats, edge_px: float) -> bool:
    """Return whether a strand is a shadow: darker without another hue, and with soft edges or faint."""
    mean = float(left.mean())
    if left.max() >= 0 or mean < MIN_SHADOW_LIGHT or np.ptp(left) > SHADOW_COLOR - SHADOW_COLOR_SHARE * mean:
        return False
    return bool(edge_px > SOFT_EDGE_PX or mean > FAINT_LIGHT)

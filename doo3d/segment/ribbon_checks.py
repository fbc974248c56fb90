"""Which of the strands traced in an image look like an object: long, of one width and color, sharp at both sides, no shadow."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from ..geometry.order_statistics import SPREAD_PERCENTILES, finite_percentiles
from ..types import Array, Bools, Floats
from .ribbons import BORDER_PX, STEP_PX, TracedStrand

PROFILE_SPACING_PX = 0.5
"""px between the samples of a profile across a strand."""

CORE_WIDTHS, SIDE_GAP_PX, SIDE_WIDTHS = 0.3, 1.5, 1 / 3
"""Half of the middle of a strand in widths; px beyond its edge where a side begins, and how wide the side is in widths (2 px at
least)."""

MIN_EDGE_WIDTHS, MAX_EDGE_WIDTHS, EDGE_SAMPLES = 0.2, 0.95, 9
"""Widths from the middle within which the edge of a strand is sought, and samples on either side that it is averaged over."""

MIN_LENGTH_PX, MIN_LENGTH_WIDTHS = 60.0, 8.0
"""Length of a strand at least."""

MIN_MEAN_SCORE, MIN_SEEN = 2.2, 0.6
"""Mean score that a strand has at least, and the share of its length that is seen."""

MAX_WIDTH_CHANGE = 3.2
"""Ratio of the outer SPREAD_PERCENTILES of the widths along an object at most."""

MAX_EDGE_PX = 5.5
"""px over which the color changes at an edge at most; shadows of distant things are softer."""

LIGHT, DARK = (np.arange(256) / 255.0) ** 2.2, 0.01
"""Light of each 8-bit value, and the share of light that is as good as none."""

MIN_SHADOW_LIGHT, SHADOW_COLOR_SHARE, SHADOW_COLOR = -2.4, 0.25, 0.08
"""A shadow leaves this much of the light at least (logarithm), and of red, green and blue the same share, up to that part of the
logarithm plus SHADOW_COLOR."""

SOFT_EDGE_PX, FAINT_LIGHT = 2.6, -0.25
"""px over which light changes at the edge of a shadow at least, unless the shadow is so faint (logarithm of the light left)."""

MIN_RANK_SHARE = 0.15
"""Share of the best strand's rank (score times length times root of width) that another one has at least."""

OVERLAP_WIDTHS, OVERLAP_PX, MAX_OVERLAP = 1.3, 5.0, 0.5
"""Widths plus px round a chosen strand of which another one may have that share: an edge or a highlight has more."""


class Checked(NamedTuple):
    """A strand with what its profile says.

    Attributes
    ----------
    line
        (P, 2) px, the strand, moved to the middle between its edges if its profile was looked at.
    width
        px between its edges.
    rank
        how much it counts.
    fault
        why it is not an object: "short", "uneven", "border" or "shadow"; empty if nothing speaks against it.
    """

    line: Floats
    width: float
    rank: float
    fault: str


def choose_strands(strands: list[TracedStrand], color: Array, lab: Array) -> tuple[list[Checked], list[Checked]]:
    """Return the strands that look like an object, the most likely first, and the shadows and joints left out.

    Parameters
    ----------
    strands
        the strands traced in the image.
    color
        (H, W, 3) uint8 RGB.
    lab
        (H, W, 3) float32, the same in CIELAB.
    """
    ranks = np.array([_rank(strand) for strand in strands])
    covered = np.zeros(color.shape[:2], dtype=bool)
    chosen, shadows = list[Checked](), list[Checked]()
    for k in np.argsort(-ranks, kind="stable").tolist():
        if ranks[k] < MIN_RANK_SHARE * (chosen[0].rank if chosen else 0.0):
            break
        entry = check_strand(strands[k], color, lab, float(ranks[k]))
        column, row = (np.clip(np.rint(entry.line[:, d]).astype(int), 0, covered.shape[1 - d] - 1) for d in (0, 1))
        if entry.fault not in ("", "shadow") or covered[row, column].mean() > MAX_OVERLAP:
            continue
        if entry.fault:
            shadows.append(entry)
            continue
        chosen.append(entry)
        covered |= draw_strand(entry.line, OVERLAP_WIDTHS * entry.width + OVERLAP_PX, covered.shape)
    return chosen, shadows


def draw_strand(line: Floats, width: float, shape: tuple[int, ...]) -> Bools:
    """Return the pixels (H, W) of the given shape within half a width of a line (P, 2) px."""
    mask = np.zeros(shape, np.uint8)
    cv2.polylines(mask, [np.rint(line * 8).astype(np.int32)[:, None]], False, 1, max(1, round(width)), cv2.LINE_8, 3)
    return np.asarray(mask > 0)


def check_strand(strand: TracedStrand, color: Array, lab: Array, rank: float) -> Checked:
    """Measure the profile across a strand, and say why it is not an object.

    Parameters
    ----------
    strand
        the strand.
    color
        (H, W, 3) uint8 RGB.
    lab
        (H, W, 3) float32, the same in CIELAB.
    rank
        how much the strand counts.
    """
    seen = np.isfinite(strand.score)
    width, length = float(np.median(strand.width[seen])), len(strand.points) * STEP_PX
    score = float(np.mean(strand.score[seen]))
    fault = _fault_without_profile(strand, seen, score, width, length, color.shape)
    if fault:
        return Checked(strand.points, width, rank, fault)
    normal = np.column_stack((-np.sin(strand.angle), np.cos(strand.angle)))
    offset = np.arange(-1.5 * width - 3, 1.5 * width + 3 + PROFILE_SPACING_PX, PROFILE_SPACING_PX)
    x, y = np.moveaxis(strand.points[:, None] + offset[:, None] * normal[:, None], 2, 0).astype(np.float32)
    profile = cv2.remap(lab, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    values = cv2.remap(color, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    side_px = width / 2 + SIDE_GAP_PX + max(2.0, SIDE_WIDTHS * width)
    core, side = np.abs(offset) < CORE_WIDTHS * width, (np.abs(offset) > width / 2 + SIDE_GAP_PX) & (np.abs(offset) < side_px)
    line, between = _centered(strand, profile, offset, width, normal, seen)
    edge_px = _edge_px(np.median(profile[seen].astype(float), axis=0).astype(np.float32), offset, core, side)
    if _is_shadow(_light_left(values, offset, core, side, seen), edge_px):
        fault = "shadow"
    elif edge_px > MAX_EDGE_PX:
        fault = "uneven"
    return Checked(line, between, rank, fault)


def _rank(strand: TracedStrand) -> float:
    """Return how much a strand counts: by its mean score, its length and its width."""
    seen = np.isfinite(strand.score)
    score, width = float(np.mean(strand.score[seen])), float(np.median(strand.width[seen]))
    return float((score - 1) * (len(strand.points) * STEP_PX) * np.sqrt(width))


def _fault_without_profile(
    strand: TracedStrand, seen: Bools, score: float, width: float, length: float, shape: tuple[int, ...]
) -> str:
    """Return what speaks against a strand in an image of a shape before its profile is looked at; empty if nothing does."""
    if length < max(MIN_LENGTH_PX, MIN_LENGTH_WIDTHS * width):
        return "short"
    border = np.min((*strand.points.T, *(np.array((shape[1] - 1, shape[0] - 1))[:, None] - strand.points.T)), axis=0)
    if np.median(border) < width / 2 + BORDER_PX:
        return "border"
    narrow, _, wide = finite_percentiles(strand.width[seen], SPREAD_PERCENTILES)
    return "uneven" if score < MIN_MEAN_SCORE or seen.mean() < MIN_SEEN or wide > MAX_WIDTH_CHANGE * narrow else ""


def _centered(
    strand: TracedStrand, profile: Array, offset: Floats, width: float, normal: Floats, seen: Bools
) -> tuple[Floats, float]:
    """Return the strand's points moved to the middle between its edges, (P, 2) px, and the distance of the edges."""
    along = cv2.blur(profile, (1, 2 * EDGE_SAMPLES + 1), borderType=cv2.BORDER_REPLICATE)
    change, at = np.linalg.norm(along[:, 2:] - along[:, :-2], axis=2), offset[1:-1]
    edges = []
    for sign in (-1, 1):
        near = (sign * at > MIN_EDGE_WIDTHS * width) & (sign * at < MAX_EDGE_WIDTHS * width)
        edges.append(at[near][np.argmax(change[:, near], axis=1)])
    apart = edges[1] - edges[0]
    between = float(np.median(apart[seen]))
    shift = np.where(np.abs(apart - between) < 0.3 * between, (edges[0] + edges[1]) / 2, 0.0)
    shift = uniform_filter1d(median_filter(shift, 15, mode="nearest"), 7, mode="nearest")
    return strand.points + shift[:, None] * normal, between


def _edge_px(profile: Floats, offset: Floats, core: Bools, side: Bools) -> float:
    """Return over how many px the color changes from a strand to its softer side, from its profile (F, 3)."""
    slope = np.linalg.norm(np.diff(profile, axis=0), axis=1) / PROFILE_SPACING_PX
    inside, outside = (np.median(profile[part].astype(float), axis=0).astype(np.float32) for part in (core, side))
    step = float(np.linalg.norm(inside - outside))
    return step / max(min(float(slope[offset[:-1] < 0].max()), float(slope[offset[:-1] > 0].max())), 1e-3)


def _light_left(values: Array, offset: Floats, core: Bools, side: Bools, seen: Bools) -> Floats:
    """Return the logarithm of the light on a strand over that on its sides: (3,) for red, green and blue.

    values : (P, F, 3) uint8, the colors of its profile.
    """
    before, after, own = (np.median(LIGHT[values[:, part]], axis=1) for part in (side & (offset < 0), side & (offset > 0), core))
    left = np.log((own + DARK) / ((before + after) / 2 + DARK))
    return np.asarray(np.median(left[seen], axis=0))


def _is_shadow(left: Floats, edge_px: float) -> bool:
    """Tell whether a strand is a shadow: darker without another color, and soft or faint."""
    mean = float(left.mean())
    if left.max() >= 0 or mean < MIN_SHADOW_LIGHT or np.ptp(left) > SHADOW_COLOR - SHADOW_COLOR_SHARE * mean:
        return False
    return bool(edge_px > SOFT_EDGE_PX or mean > FAINT_LIGHT)

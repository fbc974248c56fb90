"""How little a chain looks like a cable by itself, where nobody said what the object is.

A segmentation that looks for strands by their shape alone also takes edges of boxes and tables, fingers, tools and shadows for
strands. They differ from a cable in what is measured here: they are short for their width, their width changes, they do not rise
on both sides from what lies beside them, or they lie between two surfaces of different colors.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np

from ...geometry.noise import COLOR_NOISE, MAD_TO_DEVIATION
from ...geometry.polyline import unit
from ...types import Array, Bools, Chain, Floats, Foreground, Ints

CABLE_WIDTHS = 40.0
"""Widths of length from which on a chain is as long as a cable's: 95 % of the right chains in the rendered scenes are longer, and
half of the others are shorter than a quarter of it."""

UNEVEN_PERCENTILES, MAX_UNEVEN = (15.0, 85.0), 0.5
"""Percentiles of the radii along a chain whose difference tells how uneven it is, in medians of the radius, and the most that
counts."""

CORE_RADII = (-0.4, 0.0, 0.4)
"""Radii to the side of the axis at which the depth of the strand is taken, away from its silhouette."""

SIDE_RADII, SIDE_MARGIN_PX = (1.6, 2.2, 2.8, 3.4), 2.0
"""Radii to the side at which the depth beside the strand is taken, and px more, since a stereo camera's foreground is wider."""

FLAT_RISE_RADII = 0.4
"""Radii by which the strand is nearer than both sides at least. A cable on a table rises by two, and is seen at 0.65 of its
height at worst; a flat mark, or the edge of a step, by none on one side at least."""

FLAT_WINDOW_SAMPLES, MAX_RISE_NOISE_RADII = 16, 1.0
"""Samples, each half a radius long, over whose median the rise is taken, and the standard deviation of these medians in radii
above which depth does not tell a flat strand from one that rises: a cable on a table rises by 1.3 to 2 radii."""

MIN_FLAT_REACH_PX = 2.0
"""Radius in the view, px, below which depth does not show whether a strand rises: the windows of a stereo camera are wider."""

MAX_EDGE = 2.0
"""Differences of the colors on both sides, over the contrast of the strand, that count at most."""


class Looks(NamedTuple):
    """How little a chain looks like a cable; 0 for one that does.

    Attributes
    ----------
    stubby
        logarithm of how many times as long a cable of its width is at least.
    uneven
        spread of its radius where it is seen, in medians of the radius.
    flat
        1 if it does not rise from both sides, 0 if at least half of it does, in between linear; 0 without depth.
    edge
        difference of the colors on its two sides over that of its own color to the nearer of them, median over its samples, at
        most 2: a strand lies on one surface, the edge of a box is between two. 0 without color.
    """

    stubby: float = 0.0
    uneven: float = 0.0
    flat: float = 0.0
    edge: float = 0.0


def looks_of(chain: Chain, length: float, view: Floats, reach: Floats, foreground: Foreground) -> Looks:
    """Measure how little a chain looks like a cable.

    Parameters
    ----------
    chain
        the chain, m (px in 2-D).
    length
        length of the object that it is, or is a part of, m (px in 2-D).
    view, reach
        (S, 2) and (S,), position and radius in the view of samples along the chain, px with an image.
    foreground
        mask, depth and color of the frame.
    """
    slender = length / (2 * chain.radius) if chain.radius > 0 else CABLE_WIDTHS
    stubby = max(0.0, math.log(CABLE_WIDTHS / max(slender, 1e-3)))
    mask = foreground.mask
    if mask is None or len(view) < 2:
        return Looks(stubby, _uneven(chain))
    across = tangents(view)[:, ::-1] * (-1, 1)
    flat = 0.0 if foreground.depth is None else _flat(view, across, reach, chain.radius, foreground.depth, mask)
    edge = 0.0 if foreground.color is None else _edge(view, across, reach, foreground.color, mask)
    return Looks(stubby, _uneven(chain), flat, edge)


def _uneven(chain: Chain) -> float:
    """Return the spread of a chain's radius where it is seen, in medians of the radius."""
    seen = ~chain.occluded
    at_seen = np.concatenate((seen[:1], seen[1:] & seen[:-1], seen[-1:]))
    radii = chain.radii[at_seen] if at_seen.any() else chain.radii
    low, high = np.percentile(radii, UNEVEN_PERCENTILES)
    middle = float(np.median(radii))
    return min(float(high - low) / middle, MAX_UNEVEN) if middle > 0 else 0.0


def tangents(view: Floats) -> Floats:
    """Return the unit vectors (S, 2) along a strand at its samples (S, 2) in the view; 0 for a single one."""
    return unit(np.gradient(view, axis=0)) if len(view) > 1 else np.zeros((len(view), 2))


def _flat(view: Floats, across: Floats, reach: Floats, radius: float, depth: Array, mask: Array) -> float:
    """Return by how much more than half of a strand does not rise from both sides, 0 to 1.

    The rise is the median over windows of samples with readings on the strand and on both sides. 0 for strands that depth does
    not resolve: too few pixels wide, or with more noise than radius.
    """
    if np.median(reach) < MIN_FLAT_REACH_PX:
        return 0.0
    core = _nearest_median(depth, view, across, reach[:, None] * CORE_RADII, None)
    beside = reach[:, None] * SIDE_RADII + SIDE_MARGIN_PX
    left, right = (_nearest_median(depth, view, across, sign * beside, mask) for sign in (-1, 1))
    rise = np.minimum(left, right) - core
    rise = rise[np.isfinite(rise)]
    if not len(rise):
        return 0.0
    parts = np.array_split(rise, max(1, len(rise) // FLAT_WINDOW_SAMPLES))
    of_window = np.array([np.median(part) for part in parts])
    noise = MAD_TO_DEVIATION * float(np.median(np.abs(of_window - np.median(of_window))))
    share = float((of_window < FLAT_RISE_RADII * radius).mean())
    return max(0.0, 2 * share - 1) if noise < MAX_RISE_NOISE_RADII * radius else 0.0


def _edge(view: Floats, across: Floats, reach: Floats, color: Array, mask: Array) -> float:
    """Return the difference of the colors on both sides over the contrast of the strand, median over the samples; at most 2."""
    beside = reach[:, None] * SIDE_RADII[:2] + SIDE_MARGIN_PX
    core = _mean_color(color, view, across, reach[:, None] * CORE_RADII, None)
    left, right = (_mean_color(color, view, across, sign * beside, mask) for sign in (-1, 1))
    contrast = np.minimum(np.linalg.norm(core - left, axis=1), np.linalg.norm(core - right, axis=1))
    ratio = np.linalg.norm(left - right, axis=1) / (contrast + COLOR_NOISE)
    ratio = ratio[np.isfinite(ratio)]
    return min(float(np.median(ratio)), MAX_EDGE) if len(ratio) else 0.0


def _mean_color(color: Array, view: Floats, across: Floats, offsets: Floats, mask: Array | None) -> Floats:
    """Return the mean 8-bit Lab color (S, 3) at offsets (S, K) px across each sample, outside a given mask; NaN if none."""
    u, v, inside = _pixels(view, across, offsets, color.shape)
    if mask is not None:
        inside &= ~mask[v, u]
    lab = cv2.cvtColor(np.ascontiguousarray(color[v, u]), cv2.COLOR_RGB2LAB).astype(float)
    count = inside.sum(axis=1)[:, None]
    total = (lab * inside[..., None]).sum(axis=1)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))


def _pixels(view: Floats, across: Floats, offsets: Floats, shape: tuple[int, ...]) -> tuple[Ints, Ints, Bools]:
    """Return column and row (S, K) at offsets (S, K) px across each sample, and whether they are in an image of a shape."""
    u, v = np.rint(view[:, None] + offsets[..., None] * across[:, None]).astype(int).transpose(2, 0, 1)
    inside = (u >= 0) & (v >= 0) & (u < shape[1]) & (v < shape[0])
    return np.where(inside, u, 0), np.where(inside, v, 0), np.asarray(inside)


def _nearest_median(depth: Array, view: Floats, across: Floats, offsets: Floats, mask: Array | None) -> Floats:
    """Return the median reading (S,) m at offsets (S, K) px across each sample, outside the mask if one is given; NaN if none."""
    u, v, inside = _pixels(view, across, offsets, depth.shape)
    readings = depth[v, u].astype(float)
    measured = inside & (readings > 0)
    if mask is not None:
        measured &= ~mask[v, u]
    ordered = np.sort(np.where(measured, readings, np.inf), axis=1)
    count = measured.sum(axis=1)
    middle = np.take_along_axis(ordered, np.maximum(count - 1, 0)[:, None] // 2, axis=1)[:, 0]
    return np.asarray(np.where(count > 0, middle, np.nan))

"""How little a chain looks like a cable by itself, where nobody said what the object is.

A segmentation that looks for strands by their shape alone also takes edges of boxes and tables, fingers, tools and shadows for
strands. They differ from a cable in what is measured here: they are short for their width, their width changes, they do not rise
on both sides from what lies beside them, or they lie between two surfaces of different colors.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...geometry.noise import COLOR_NOISE, MAD_TO_DEVIATION
from ...geometry.polyline import unit
from ...geometry.radii import CORE_OFFSETS
from ...kernels import percentiles, strand_sides
from ...types import Chain, Floats, Foreground

CABLE_WIDTHS = 40.0
"""Widths of length from which on a chain is as long as a cable's: 95 % of the right chains in the rendered scenes are longer, and
half of the others are shorter than a quarter of it."""

UNEVEN_PERCENTILES, MAX_UNEVEN = np.array((15.0, 50.0, 85.0)), 0.5
"""Percentiles of the radii along a chain: the difference of the outer two over the median tells how uneven it is. And the most
that counts."""

SIDE_RADII, SIDE_MARGIN_PX = np.array((1.6, 2.2, 2.8, 3.4)), 2.0
"""Radii to the side at which the depth beside the strand is taken, the color at the first two, and px more, since a stereo
camera's foreground is wider."""

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


SIDE_LIMITS = np.array(
    (
        *(SIDE_MARGIN_PX, MIN_FLAT_REACH_PX, FLAT_WINDOW_SAMPLES, FLAT_RISE_RADII),
        *(MAX_RISE_NOISE_RADII, MAD_TO_DEVIATION, COLOR_NOISE, MAX_EDGE),
    )
)
"""The numbers above in the order in which the kernel takes them."""


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
    across = unit(np.gradient(view, axis=0))[:, ::-1] * (-1, 1)
    depth = np.zeros((0, 0), np.float32) if foreground.depth is None else foreground.depth
    color = np.zeros((0, 0, 3), np.uint8) if foreground.color is None else np.ascontiguousarray(foreground.color)
    flat, edge = strand_sides(
        view, across, reach, chain.radius, depth, color, mask, CORE_OFFSETS, SIDE_RADII, SIDE_RADII[:2], SIDE_LIMITS
    )
    return Looks(stubby, _uneven(chain), flat, edge)


def _uneven(chain: Chain) -> float:
    """Return the spread of a chain's radius where it is seen, in medians of the radius."""
    seen = ~chain.occluded
    at_seen = np.concatenate((seen[:1], seen[1:] & seen[:-1], seen[-1:]))
    radii = chain.radii[at_seen] if at_seen.any() else chain.radii
    low, middle, high = percentiles(radii, UNEVEN_PERCENTILES).tolist()
    return min((high - low) / middle, MAX_UNEVEN) if middle > 0 else 0.0

"""How little a chain looks like a cable by itself.

A segmentation that looks for strands by their shape alone also takes edges of boxes and tables, fingers, tools and shadows for
strands. They differ from a cable in what is measured here: they are short for their width, their width changes, they do not rise
on both sides from what lies beside them, or hardly differ from it in color. In a photograph a network says how probable each
pixel is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from scipy.special import logit

from ..geometry.order_statistics import SPREAD_PERCENTILES, finite_percentiles
from ..geometry.polyline import unit
from ..geometry.radii import CORE_OFFSETS
from ..kernels import strand_sides
from ..types import Array, Chain, Floats, Foreground

CABLE_WIDTHS = 350.0
"""Widths of length from which on a chain cannot look more like a cable: 5 m of one that is 14 mm wide."""

MAX_UNEVEN = 0.5
"""Spread of the radii along a chain, in medians, that counts at most."""

SIDE_RADII = np.array((1.6, 2.2, 2.8, 3.4))
"""Radii to the side at which the depth beside the strand is taken, the color at the first two."""

CLEAR_CONTRAST, MIN_CONTRAST = 40.0, 2.0
"""Difference in 8-bit CIELAB between a strand and its more similar side from which on it stands out clearly, and the least that
counts: half of the right chains in photographs have about as much, half of the clutter a third of it."""

SURE_ODDS, DOUBTFUL_ODDS, CLEAR_ODDS = logit((0.95, 0.5, 0.995)).tolist()
"""Logarithms of the odds of pixels. Of the mean over an axis: above which a network is sure, and below which it cannot doubt
more, so that a network alone leaves out no strand that has nothing else against it. Of one pixel: beyond which more says nothing.
Chosen on rendered scenes without a cable and on photographs."""


class Looks(NamedTuple):
    """How little a chain looks like a cable; 0 for one that does.

    Attributes
    ----------
    stubby
        logarithm of how many times as long a cable of its width is at least.
    uneven
        spread of its radius where it is seen, in medians of the radius.
    flat
        1 if it does not rise from both sides, 0 if at least half of it does, in between linear; 0 without depth, and where the
        object is given.
    faint
        logarithm of CLEAR_CONTRAST over the contrast of its color with the more similar side, which 80 % of its samples exceed.
        0 with depth, which shows a strand of any color, and where the object is given.
    doubted
        by how much the logarithm of the odds of the pixels on its axis, by a network and the rules, is below SURE_ODDS, mean over
        the axis, down to DOUBTFUL_ODDS; 0 without a network.
    """

    stubby: float
    uneven: float
    flat: float = 0
    faint: float = 0
    doubted: float = 0


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
    if foreground.is_told or mask is None or len(view) < 2:
        return Looks(stubby, _uneven(chain))
    across = unit(np.gradient(view, axis=0))[:, ::-1] * (-1, 1)
    depth = np.zeros((0, 0), np.float32) if foreground.depth is None else foreground.depth
    color = foreground.color if foreground.depth is None and foreground.color is not None else np.zeros((0, 0, 3), np.uint8)
    images = depth, np.ascontiguousarray(color), mask
    flat, contrast = strand_sides(view, across, reach, chain.radius, *images, CORE_OFFSETS, SIDE_RADII, SIDE_RADII[:2])
    faint = math.log(CLEAR_CONTRAST / min(max(contrast, MIN_CONTRAST), CLEAR_CONTRAST))
    doubted = 0.0 if foreground.probability is None else _doubted(view, foreground.probability)
    return Looks(stubby, _uneven(chain), flat, faint, doubted)


def _doubted(view: Floats, probability: Array) -> float:
    """Return how far the mean log odds of the pixels along an axis (S, 2) px are below those of a pixel that is sure."""
    at = view.astype(np.float32)[None]
    read = cv2.remap(probability, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    odds = np.asarray(logit(read.astype(float))).clip(-CLEAR_ODDS, CLEAR_ODDS)
    return float(SURE_ODDS - odds.mean().clip(DOUBTFUL_ODDS, SURE_ODDS))


def _uneven(chain: Chain) -> float:
    """Return the spread of a chain's radius where it is seen, in medians of the radius."""
    seen = ~chain.occluded
    at_seen = np.concatenate((seen[:1], seen[1:] & seen[:-1], seen[-1:]))
    radii = chain.radii[at_seen] if at_seen.any() else chain.radii
    low, middle, high = finite_percentiles(radii, SPREAD_PERCENTILES).tolist()
    return min((high - low) / middle, MAX_UNEVEN) if middle > 0 else 0.0

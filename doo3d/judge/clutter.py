"""Shape and color features that separate cables from clutter, for automatic segmentation.

A segmentation that searches for strands by their shape alone also selects edges of boxes and tables, fingers, tools and shadows.
They are short for their width, their width changes, they do not rise above both sides, or their color hardly differs from that
beside them. In a photograph a network gives the probability of each pixel.
"""

import math
from typing import NamedTuple

import numpy as np

from ..geometry.order_statistics import SPREAD_PERCENTILES, finite_percentiles
from ..geometry.polyline import unit
from ..scene.scene import Scene
from ..types import Chain, Floats

CABLE_WIDTHS = 350.0
"""Length of a chain in widths from which `stubby` is 0: 5 m of a cable 14 mm wide."""

MAX_UNEVEN = 0.5
"""Upper limit of `uneven`, the spread of the radii along a chain over their median."""

CLEAR_CONTRAST, MIN_CONTRAST = 40.0, 2.0
"""Difference in 8-bit CIELAB between a strand and its more similar side from which on it stands out clearly, and the least that
counts: half of the right chains in photographs have about as much, half of the clutter a third of it."""


class ClutterFeatures(NamedTuple):
    """Features of a chain that clutter has and cables lack; 0 for a cable.

    Attributes
    ----------
    stubby
        log of CABLE_WIDTHS over the length of the object in widths, at least 0.
    uneven
        spread of its radius over the median radius, where it is seen.
    flat
        1 if it does not rise from both sides, 0 if at least half of it does, in between linear; 0 without depth, and where the
        object is given.
    faint
        logarithm of CLEAR_CONTRAST over the contrast of its color with the more similar side, which 80 % of its samples exceed.
        0 with depth, which shows a strand of any color, and where the object is given.
    network_doubt
        by how much the logarithm of the odds of the pixels on its axis, by a network and the rules, is below SURE_ODDS, mean over
        the axis, down to DOUBTFUL_ODDS; 0 without a network.
    """

    stubby: float
    uneven: float
    flat: float = 0
    faint: float = 0
    network_doubt: float = 0


def clutter_features(chain: Chain, length: float, view: Floats, reach: Floats, scene: Scene) -> ClutterFeatures:
    """Measure the features that separate a chain from clutter.

    Parameters
    ----------
    chain
        the chain, m (px in 2-D).
    length
        length of the object that it is, or is a part of, m (px in 2-D).
    view, reach
        (S, 2) and (S,), position and radius in the view of samples along the chain, px with an image.
    scene
        what was captured.
    """
    slender = length / (2 * chain.radius) if chain.radius > 0 else CABLE_WIDTHS
    stubby = max(0.0, math.log(CABLE_WIDTHS / max(slender, 1e-3)))
    if scene.object_given or len(view) < 2:
        return ClutterFeatures(stubby, _uneven(chain))
    across = unit(np.gradient(view, axis=0))[:, ::-1] * (-1, 1)
    sides = scene.strand_sides(view, across, reach, chain.radius)
    faint = math.log(CLEAR_CONTRAST / min(max(sides.contrast, MIN_CONTRAST), CLEAR_CONTRAST))
    return ClutterFeatures(stubby, _uneven(chain), sides.flat, faint, sides.doubt)


def _uneven(chain: Chain) -> float:
    """Return the spread of a chain's radius where it is seen, in medians of the radius."""
    seen = ~chain.occluded
    at_seen = np.concatenate((seen[:1], seen[1:] & seen[:-1], seen[-1:]))
    radii = chain.radii[at_seen] if at_seen.any() else chain.radii
    low, middle, high = finite_percentiles(radii, SPREAD_PERCENTILES).tolist()
    return min((high - low) / middle, MAX_UNEVEN) if middle > 0 else 0.0

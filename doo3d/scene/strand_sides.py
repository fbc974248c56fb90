"""How a strand stands out from what lies beside it, and what the network says of its pixels."""

import cv2
import numpy as np
from scipy.special import logit

from ..geometry.radii import CORE_OFFSETS
from ..types import Array, Floats

SIDE_RADII = np.array((1.6, 2.2, 2.8, 3.4))
"""Radii to the side at which the depth beside the strand is taken, the color at the first two."""

SIDES = CORE_OFFSETS, SIDE_RADII, SIDE_RADII[:2]
"""Radii from the axis at which the strand itself is looked at, and the depth and the color of a side."""

SURE_ODDS, DOUBTFUL_ODDS, CLEAR_ODDS = logit((0.95, 0.5, 0.995)).tolist()
"""Logarithms of the odds of pixels. Of the mean over an axis: above which a network is sure, and below which it cannot doubt
more, so that a network alone leaves out no strand that has nothing else against it. Of one pixel: beyond which more says nothing.
Chosen on rendered scenes without a cable and on photographs."""


def doubt_of(view: Floats, probability: Array) -> float:
    """Return how far the mean log-odds of the pixels along an axis are below those of a certain strand, nat; 0 without a network.

    view : (S, 2) px. probability : (H, W) float32, of a pixel to belong to a thin object; (0, 0) without a network.
    """
    if not probability.size:
        return 0.0
    at = view.astype(np.float32)[None]
    read = cv2.remap(probability, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    odds = np.asarray(logit(read.astype(float))).clip(-CLEAR_ODDS, CLEAR_ODDS)
    return float(SURE_ODDS - odds.mean().clip(DOUBTFUL_ODDS, SURE_ODDS))

"""What a scene answers about the strands in its image."""

from typing import NamedTuple

import numpy as np

from ..geometry.curves import Curves
from ..types import Floats


class MaskLines(NamedTuple):
    """The middle lines of the strands in a mask, from one place where strands meet to the next, px (u, v)."""

    lines: Curves
    radius: float
    intrinsics: Floats


NO_LINES = MaskLines(Curves.of([]), 0.0, np.zeros(0))


class ColorSides(NamedTuple):
    """How a strand stands out from what lies beside it.

    Attributes
    ----------
    flat
        1 if it does not rise from both sides, 0 if at least half of it does, in between linear; 0 where depth is unknown.
    contrast
        difference in 8-bit CIELAB to the more similar side, which 80 % of its samples exceed; infinite where it is not asked.
    doubt
        how far the mean log-odds of the pixels on its axis, by the network, lie below those of a certain strand, nat.
    """

    flat: float = 0.0
    contrast: float = np.inf
    doubt: float = 0.0

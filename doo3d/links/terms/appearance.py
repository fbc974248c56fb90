"""The colors that the strands show at two ends."""

import math

from ...scene.scene import Scene
from ...types import Floats
from ..ends import Ends


def appearance(ends: Ends, scene: Scene) -> Floats | None:
    """Return how much less likely each pair of ends shows one color, (E, E) cost units; None where no colors were distinguished.

    A nat costs as much as a turn by a radian.
    """
    window = math.ceil(ends.window / ends.segment_length) + 1
    unlike = scene.strand_colors(ends.chains, window)
    return ends.config.angle_weights[0] * unlike if unlike.size else None

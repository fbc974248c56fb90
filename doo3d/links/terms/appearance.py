"""The colors that the strands show at two ends."""

import numpy as np

from ...scene.scene import Scene
from ...types import Floats
from ..ends import Ends


def appearance(ends: Ends, scene: Scene) -> Floats | None:
    """Return how much less likely each pair of ends shows one color, (E, E) cost units; None where no colors were distinguished.

    A nat costs as much as a turn by a radian.
    """
    if len(scene.each_layer) == 1:
        return None
    layer = np.repeat(scene.layer_of(ends.chains), 2)
    return np.where(layer == layer[:, None], 0.0, 1e6)

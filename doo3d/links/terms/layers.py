"""The layers by color in which two ends lie."""

import numpy as np

from ...scene.scene import Scene
from ...types import Floats
from ..ends import Ends


def layers(ends: Ends, scene: Scene) -> Floats | None:
    """Return an infinite cost for each pair of ends in different layers, (E, E) cost units; None where there is one layer."""
    if len(scene.each_layer) == 1:
        return None
    layer = np.repeat(scene.layer_of(ends.chains), 2)
    return np.where(layer == layer[:, None], 0.0, np.inf)

"""Extend the mask of an image along strands that go on beyond it.

A segmentation misses stretches of a strand in another light, in a shadow, or before a background of similar color. Each free end
of a chain is followed in steps of half a radius. The strand is taken to continue where the colors across it match its colors so
far and the background on both sides has other colors. The path found is added to the mask, and the stages are run again.
"""

import cv2
import numpy as np

from ..geometry.noise import COLOR_NOISE
from ..geometry.radii import STEP_RADII
from ..kernels import follow_strand
from ..scene.image import ImageScene
from ..scene.scene import Scene
from ..types import Bools, Chain
from ..types.stopwatch import timed

MIN_EXTENSION_RADII = 2.0
"""Radii; shorter extensions are not worth running the stages again, and end in the mask that they begin in."""


@timed("extend_mask")
def extend_mask(chains: list[Chain], scene: Scene) -> Bools | None:
    """Extend the mask of an image along strands that continue beyond it (2-D only).

    Parameters
    ----------
    chains
        the chains found in the mask, px, with radii. Their free ends are followed, except at the border of the image.
    scene
        what was captured, with the settings: an image, whose mask and colors are used.

    Returns
    -------
    (H, W) bool, the mask with the strands' continuations added, each as wide as its strand. Continuations shorter than
    MIN_EXTENSION_RADII (2) radii are not added. None if nothing was added, if `config.max_length` is 0 (the default), without a
    color image, and in 3-D.
    """
    max_length = scene.config.extend_mask.max_length
    if not (max_length and isinstance(scene, ImageScene) and scene.color.size):
        return None
    mask, color = scene.whole.mask, scene.color
    extended, middle = None, (np.array(mask.shape[::-1]) - 1) / 2
    limits = {"step": STEP_RADII, "min_extension": MIN_EXTENSION_RADII, "noise": COLOR_NOISE}
    for chain in chains:
        radius = float(np.median(chain.radii))
        for joints in (chain.joints, chain.joints[::-1]):
            is_inside = (np.abs(joints[-1] - middle) <= middle - radius * (1 + STEP_RADII)).all()
            if chain.closed or not radius > 0 or not is_inside:
                continue
            line = np.ascontiguousarray(joints)
            path = follow_strand(color, mask, line, radius, max_length, **limits)
            if np.linalg.norm(path[-1] - path[0]) > MIN_EXTENSION_RADII * radius:
                extended = mask.astype(np.uint8) if extended is None else extended
                cv2.polylines(extended, [np.rint(path).astype(np.int32)], False, 1, max(1, round(2 * radius)))
    return None if extended is None else extended > 0

"""What the rules select in a frame, judged by a network: noise of depth is no strand, and what depth loses the image shows."""

from __future__ import annotations

import cv2
import numpy as np

from ..scene.surround import learn_surround, to_lab
from ..types import Array, Bools, Floats, Frame, Ints
from .color_strands import FLANK_DIAMOND_PX, GROW_DEVIATIONS, MIN_SEED_SHARE, MIN_SHADOW_LIGHT, MIN_SIDE_PX
from .mask_parts import Parts, drawn
from .methods.selected import Selected
from .thin_lines import narrow_parts

BESIDE_PX = FLANK_DIAMOND_PX
"""px beside what is kept within which nothing is added: the network, which sees a smaller image, blurs edges and fills gaps
between strands. Of 216 frames of a stereo camera 166 are right, with 10 px 163."""


MIN_STAND_OFF = 5.0
"""Diameters off the plane from which a strand hangs in the air: the noise of depth and what lies on others are nearer."""


def judged_mask(rules: Selected, found: Bools, color: Array) -> Bools:
    """Return what is a strand in a frame by the rules and by a network.

    Of what the rules select, the parts are kept that hold a strand told by its color, or of which the network finds the share
    that a band of color needs (MIN_SEED_SHARE); all of them if neither knows any. Of 99 % of the parts that are noise of a stereo
    camera the network finds nothing. What it alone finds is added, but for what lies beside that, for bands that the rules left
    out as flat, and for shadows, whose depth is the surface's.

    Parameters
    ----------
    rules
        what the rules select in the frame, with the pixels of strands told by color, and the bands left out.
    found
        (H, W) bool, the pixels that the network takes for an object after the votes of the rules.
    color
        (H, W, 3) uint8 RGB.

    Returns
    -------
    (H, W) bool.
    """
    parts = Parts.of(rules.mask, rules.told)
    kept = parts.holds | (parts.shares(found) >= MIN_SEED_SHARE)
    selected = drawn(parts.pixels_of(np.flatnonzero(kept)), found.shape)
    beside = cv2.dilate(selected.view(np.uint8), np.ones((2 * BESIDE_PX + 1,) * 2, np.uint8)).view(bool)
    others = found & ~beside
    for band in rules.left_out:
        others.ravel()[band] = False
    added = Parts.of(others, np.zeros(0, dtype=int))
    if not len(added.pixels) or min(color.shape[:2]) < MIN_SIDE_PX:
        return selected if kept.any() else rules.mask
    differs = np.zeros_like(found)
    differs.ravel()[added.pixels] = _differ(np.ascontiguousarray(color), rules.mask, added.pixels)
    selected |= drawn(added.pixels_of(np.flatnonzero(added.shares(differs) >= 0.5)), found.shape)
    return selected if selected.any() else rules.mask


def set_apart(rules: Selected, frame: Frame, width: float) -> Bools:
    """Return the pixels (H, W) bool of bands of one width that hang far off the plane: color and depth show them.

    Parameters
    ----------
    rules
        what the rules select in the frame, with the plane and the bands that color tells from the surface.
    frame
        the frame.
    width
        px, above which a band is broad: a gripper or a hand, at which a strand is cut off.
    """
    apart = np.zeros(frame.depth.shape, dtype=bool)
    if rules.bands is None or rules.plane is None:
        return apart
    parts = narrow_parts(rules.bands, frame.depth.shape, width)
    candidates = np.flatnonzero(parts.strands & (parts.shares(rules.bands.raised) >= 0.5))
    for part in candidates.tolist():
        pixels = parts.pixels_of(np.array([part]))
        raised = pixels[rules.bands.raised.ravel()[pixels]]
        depth = frame.depth.ravel()[raised]
        points = frame.camera.unproject(np.column_stack((raised % frame.camera.width, raised // frame.camera.width)), depth)
        height = np.median(np.abs(points @ rules.plane.normal - rules.plane.height))
        if height >= MIN_STAND_OFF * 2 * parts.widths[part, 0] * np.median(depth) / frame.camera.fx:
            apart.ravel()[pixels] = True
    return apart


def _differ(color: Array, raised: Bools, pixels: Ints) -> Bools:
    """Tell which pixels (N,), row-major indices, have another color than the surface around them and are no shadow.

    color : (H, W, 3) uint8 RGB. raised : (H, W) bool, what is not of the surface.
    """
    around, deviation, _ = learn_surround(color, raised, GROW_DEVIATIONS)
    row, column = np.divmod(pixels, color.shape[1])
    surface = around[row * around.shape[0] // color.shape[0], column * around.shape[1] // color.shape[1]]
    own = to_lab(color.reshape(-1, 3)[pixels][None])[0]
    contrast: Floats = ((own - surface) / deviation) ** 2
    hue = contrast[:, 1:].sum(axis=1)
    is_shadow = (own[:, 0] < surface[:, 0]) & (hue < GROW_DEVIATIONS**2) & (own[:, 0] > MIN_SHADOW_LIGHT * surface[:, 0])
    return np.asarray((hue + contrast[:, 0] > GROW_DEVIATIONS**2) & ~is_shadow)

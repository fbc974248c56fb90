"""Filter the mask that the rules found in a frame with the network, and add strands that only the network found."""

import cv2
import numpy as np

from ..scene.surround import learn_surround, to_lab
from ..types import Array, Bools, Floats, Frame, Ints
from .color_strands import FLANK_DIAMOND_PX, GROW_DEVIATIONS, MIN_SEED_SHARE, MIN_SHADOW_LIGHT, MIN_SIDE_PX
from .mask_parts import Parts, drawn
from .methods.result import MethodResult
from .thin_lines import narrow_parts

BESIDE_PX = FLANK_DIAMOND_PX
"""Distance in px from the kept parts within which no pixel of the network is added: the network examines a smaller image, blurs
edges and fills gaps between strands. Of 216 frames of a stereo camera, 166 are right; with 10 px, 163."""

MIN_STAND_OFF = 5.0
"""Minimum distance of a hanging strand from the plane, in diameters of the strand: depth noise and strands that lie on others are
nearer."""


def judged_mask(rules: MethodResult, found: Bools, color: Array) -> Bools:
    """Return the strands of a frame, from the mask of the rules and the mask of the network.

    A part of the rules' mask is kept if it contains a strand detected by its color, or if the network found at least the fraction
    MIN_SEED_SHARE of it. If no part is kept or added, all parts are. In 99 % of the parts that are noise of a stereo camera, the
    network finds nothing. Parts that only the network found are added, except beside the kept parts, in bands that the rules
    rejected as flat, and in shadows, which have the depth of the surface.

    Parameters
    ----------
    rules
        the result of the rules for the frame.
    found
        (H, W) bool, the object pixels by the network after the votes of the rules.
    color
        (H, W, 3) uint8 RGB.

    Returns
    -------
    (H, W) bool.
    """
    parts = Parts.of(rules.mask, rules.by_color)
    kept = parts.holds | (parts.shares(found) >= MIN_SEED_SHARE)
    selected = drawn(parts.pixels_of(np.flatnonzero(kept)), found.shape)
    beside = cv2.dilate(selected.view(np.uint8), np.ones((2 * BESIDE_PX + 1,) * 2, np.uint8)).view(bool)
    others = found & ~beside
    for band in rules.rejected:
        others.ravel()[band] = False
    added = Parts.of(others)
    if len(added.pixels) and min(color.shape[:2]) >= MIN_SIDE_PX:
        differs = np.zeros_like(found)
        differs.ravel()[added.pixels] = _differ(np.ascontiguousarray(color), rules.mask, added.pixels)
        selected |= drawn(added.pixels_of(np.flatnonzero(added.shares(differs) >= 0.5)), found.shape)
    return selected if selected.any() else rules.mask


def set_apart(rules: MethodResult, frame: Frame, width: float) -> Bools:
    """Return the pixels (H, W) bool of color bands of constant width that hang far from the plane: certain strands.

    Parameters
    ----------
    rules
        the result of the rules for the frame, with the plane and the color bands.
    frame
        the frame.
    width
        px, maximum width of a strand; at a wider place, such as a gripper or a hand, the strand is cut off.
    """
    apart = np.zeros(frame.depth.shape, dtype=bool)
    bands, plane = rules.bands, rules.plane
    if plane is None or not len(bands.parts.pixels):
        return apart
    parts = narrow_parts(bands, apart.shape, width)
    for part in np.flatnonzero(parts.strands & (parts.shares(bands.raised) >= 0.5)).tolist():
        pixels = parts.pixels_of(np.array([part]))
        raised = pixels[bands.raised.ravel()[pixels]]
        depth = frame.depth.ravel()[raised]
        points = frame.camera.unproject(np.column_stack(np.divmod(raised, frame.camera.width)[::-1]), depth)
        height = np.median(np.abs(points @ plane.normal - plane.height))
        if height >= MIN_STAND_OFF * 2 * parts.widths[part, 0] * np.median(depth) / frame.camera.fx:
            apart.ravel()[pixels] = True
    return apart


def _differ(color: Array, raised: Bools, pixels: Ints) -> Bools:
    """Return which pixels (N,), row-major indices, differ in color from the surface around them and are no shadow, (N,) bool.

    color : (H, W, 3) uint8 RGB. raised : (H, W) bool, the pixels that do not belong to the surface.
    """
    around, deviation, _ = learn_surround(color, raised, GROW_DEVIATIONS)
    row, column = np.divmod(pixels, color.shape[1])
    surface = around[row * around.shape[0] // color.shape[0], column * around.shape[1] // color.shape[1]]
    own = to_lab(color.reshape(-1, 3)[pixels][None])[0]
    contrast: Floats = ((own - surface) / deviation) ** 2
    hue = contrast[:, 1:].sum(axis=1)
    is_shadow = (own[:, 0] < surface[:, 0]) & (hue < GROW_DEVIATIONS**2) & (own[:, 0] > MIN_SHADOW_LIGHT * surface[:, 0])
    return np.asarray((hue + contrast[:, 0] > GROW_DEVIATIONS**2) & ~is_shadow)

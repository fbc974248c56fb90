"""The pixels in the middle of the strands of a mask, whose points become voxels."""

import math

import cv2
import numpy as np

from ..geometry.noise import DEVIATIONS, MAD_TO_DEVIATION
from ..geometry.radii import STEP_RADII
from ..scene.frame import FrameScene
from ..scene.frame_facts import FrameFacts
from ..types import Array, Bools, Floats, Ints


def core_points(scene: FrameScene) -> Floats:
    """Return the filtered points (K, 3) m of a frame in the core of a strand.

    Where strands run side by side, only the pixels in the middle of each are used.
    """
    config, radius_px = scene.config.voxelize, scene.radius / scene.spacing
    if not config.core_fraction:
        return scene.filtered
    facts, pixels = scene.facts, np.ascontiguousarray(scene.pixels)
    if config.split_at_depth_step:
        facts = FrameFacts(scene.mask & ~occluding_edge_pixels(scene, config.split_at_depth_step * scene.radius, radius_px))
    in_core = facts.core_pixels(pixels, max(1, math.ceil(radius_px)), config.core_fraction, config.core_margin_px)
    if scene.side_by_side.size:
        beside = scene.side_by_side[pixels[:, 1], pixels[:, 0]]
        in_core = np.where(beside, middle_pixels(facts, pixels, STEP_RADII / 2 * radius_px), in_core)
    return scene.filtered[in_core]


def middle_pixels(facts: FrameFacts, pixels: Ints, reach: float) -> Bools:
    """Return which pixels (N, 2) int64 (u, v) lie on the skeleton of a mask, or nearer to it than `reach` px: (N,) bool.

    facts : the mask, thinned after Zhang and Suen.
    """
    return facts.middle_pixels(np.ascontiguousarray(pixels), max(reach, 1.0))


def occluding_edge_pixels(scene: FrameScene, min_step: float, radius: float) -> Bools:
    """Find the pixels of a mask at which a strand disappears beneath a nearer one, by the step in depth there.

    A pixel is marked if the nearest surface within about half a radius of it is nearer to the camera than the pixel itself, by
    more than the sum of `min_step`, three standard deviations of the depth noise, and the change of depth on either side of the
    step. That change is not counted as a step, since a strand that runs away from the camera slopes all along; on the nearer side
    it is continued in inverse depth, in which a straight strand has one slope.

    Parameters
    ----------
    scene
        the frame.
    min_step
        m, least step in depth.
    radius
        px, radius of the object.

    Returns
    -------
    (H, W) bool in the size of the mask, True for the marked pixels; all False without points.
    """
    at_edge = np.zeros(scene.mask.shape, dtype=bool)
    if not len(scene.pixels):
        return at_edge
    box = scene.facts.slices
    u, v = scene.pixels[:, 0] - box[1].start, scene.pixels[:, 1] - box[0].start
    depth = np.full(scene.mask[box].shape, np.inf, dtype=np.float32)
    depth[v, u] = scene.filtered[:, 2]
    window = max(1, math.ceil(radius / 2))
    own = depth[v, u]
    nearest = _local_minimum(depth, window)[v, u]
    nearest_wide = _local_minimum(depth, 2 * window)[v, u]
    farthest = -_local_minimum(np.where(np.isfinite(depth), -depth, depth), window)[v, u]
    noise = MAD_TO_DEVIATION * float(np.median(np.abs(scene.points[:, 2] - scene.filtered[:, 2])))
    beyond = 1 / np.maximum(2 / nearest - 1 / nearest_wide, 1 / own)
    slope = np.maximum(farthest - own, beyond - nearest)
    at_edge[scene.pixels[:, 1], scene.pixels[:, 0]] = own - nearest > min_step + DEVIATIONS * noise + slope
    return at_edge


def _local_minimum(values: Array, window: int) -> Array:
    """Return the least of the values (H, W) float32 within `window` px of each pixel."""
    return np.asarray(cv2.erode(values, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * window + 1, 2 * window + 1))))

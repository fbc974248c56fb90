"""Read the depth along the chains of a frame as the sensor measured it.

A single frame has to decide which readings belong to the strand, and fails where most belong to the background. A sequence
decides better, since right readings agree with other frames: so a frame with torn depth passes all of its readings on.
"""

import numpy as np
from scipy.ndimage import maximum_filter1d

from ..geometry.polyline import arc_length, resample, unit
from ..geometry.radii import ACROSS_RADII
from ..scene.depth_support import SURFACE_RADII
from ..scene.frame import FrameScene
from ..scene.scene import Scene
from ..scene.surface_beside import BESIDE_PX
from ..types import Array, Bools, Chain, Floats

NODES, PER_NODE = 40, 6
"""Number of places along an object at which depth is smoothed, about one per wavelength of a stereo camera's depth waves; and
readings at each place: 240 in all, about 2 for each of 100 segments."""

NEARER_SHARE, BEHIND_SHARE = 0.35, 0.75
"""Quantiles of depth, from the nearest reading on: across the strand, where wrong readings are mostly behind it; and next to
it for the background, where a stereo camera measures the strand, too."""

TORN_SHARE = 0.1
"""Fraction of segments that are visible without measured depth above which the depth of a chain is torn: the rest may be
wrong, too."""


def torn_share(chain: Chain) -> float:
    """Return the fraction of the segments of a chain that are visible without depth."""
    return np.count_nonzero(chain.depth_filled & ~chain.occluded) / len(chain.occluded)


def readings_along(chain: Chain, scene: Scene, tips: tuple[bool, bool]) -> Array | None:
    """Return the inverse range along an open chain and of the background next to it.

    The places are evenly spaced in the image. A stereo camera measures an occluder up to 14 px beyond its edges: such readings
    are left out.

    Parameters
    ----------
    chain
        the chain, in the camera frame.
    scene
        what was captured.
    tips
        whether the first and the last end are tips of the object; other ends are hidden.

    Returns
    -------
    (2, NODES, PER_NODE) float32 1/m, of the axis and of the background; NaN without a reading. None if no
    camera saw the chain, or its depth is not torn.
    """
    if not isinstance(scene, FrameScene) or chain.closed or torn_share(chain) <= TORN_SHARE:
        return None
    camera, depth, mask = scene.camera, scene.depth, scene.mask
    rays = unit(chain.joints)
    turned = arc_length(rays)
    nodes = (np.arange(NODES * PER_NODE) + 0.5) / PER_NODE - 0.5
    at = np.clip(nodes / (NODES - 1), 0, 1) * turned[-1]
    line = resample(rays, at)
    pixels = camera.project(line)
    along = np.gradient(camera.project(resample(rays, np.linspace(0.0, turned[-1], len(at)))), axis=0)
    across = unit(along)[:, ::-1] * (-1.0, 1.0)
    half_width = chain.radius * camera.fx / float(np.median(chain.joints[:, 2]))
    own = _read_image(pixels, across, ACROSS_RADII * half_width, depth, mask, True, NEARER_SHARE)
    beyond = half_width + BESIDE_PX
    beside = _read_image(pixels, across, np.concatenate((-beyond, beyond)), depth, mask, False, BEHIND_SHARE)
    segment = np.clip(turned.searchsorted(at) - 1, 0, len(chain.occluded) - 1)
    own[_beside_hidden(chain.occluded[segment], tips, arc_length(pixels)[-1])] = np.nan
    stretch = np.linalg.norm(line, axis=1) / line[:, 2]
    inverse = np.stack((1 / (own * stretch + SURFACE_RADII * chain.radius), 1 / (beside * stretch)))
    return inverse.reshape(2, NODES, PER_NODE).astype(np.float32)


def _read_image(
    pixels: Floats, across: Floats, offsets: Floats, depth: Array, mask: Bools, on_object: bool, share: float
) -> Floats:
    """Return a quantile of the depth readings across a line in the image, (N,) m.

    Parameters
    ----------
    pixels, across
        (N, 2) px, places on the line, and unit directions across it.
    offsets
        (K,) px, distances across the line at which depth is read.
    depth, mask
        (H, W) m and bool, the depth image and the pixels of the object.
    on_object
        True to read pixels of the mask, False for the others.
    share
        the quantile, 0 to 1, from the nearest reading on; NaN where there is no reading.
    """
    height, width = depth.shape
    u, v = np.moveaxis(np.rint(pixels[:, None] + across[:, None] * offsets[:, None]).astype(np.int64), 2, 0)
    inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    u, v = u.clip(0, width - 1), v.clip(0, height - 1)
    read = depth[v, u]
    ordered = np.sort(np.where(inside & (mask[v, u] == on_object) & (read > 0), read, np.nan), axis=1)
    count = np.isfinite(ordered).sum(axis=1)
    return np.asarray(ordered[np.arange(len(u)), (share * np.maximum(count - 1, 0)).astype(np.int64)])


def _beside_hidden(hidden: Bools, tips: tuple[bool, bool], length: float) -> Bools:
    """Return which of N places are hidden, or near enough to measure the occluder.

    Parameters
    ----------
    hidden
        (N,) bool, along the chain.
    tips
        whether the ends are tips; beyond any other end, the object is hidden.
    length
        px, of the chain in the image.
    """
    reach = int(np.ceil(BESIDE_PX[-1] / max(length, 1.0) * len(hidden)))
    flags = np.concatenate(([not tips[0]], hidden, [not tips[1]])).astype(np.uint8)
    return np.asarray(maximum_filter1d(flags, 2 * reach + 1, mode="constant")[1:-1] > 0)

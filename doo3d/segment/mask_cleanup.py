"""Remove regions that are no strands from a mask: wide regions, such as a gripper, and plugs at the ends of strands.

A plug is thin enough to be segmented as a strand, and the strand leads straight into it. It differs from the strand in both width
and color. A difference in one of them is no plug: a knot, an eye splice and strands side by side are wide, and strands change
their color in shadows and at stripes. The steps are:

1. Follow the skeleton of the mask inwards from each free end. Strands that meet have no free end there, so that crossings,
   sleeves and ties along a strand are kept.
2. If the end is much wider than the rest of the strand and of another color, the plug extends as far as that color.
3. Remove the pixels of the mask that are nearest to that part of the skeleton.
"""

import cv2
import numpy as np
from scipy.ndimage import median_filter

from ..config import SegmentConfig
from ..geometry.mask import half_widths, ridge_radius
from ..geometry.noise import COLOR_NOISE, DEVIATIONS, MAD_TO_DEVIATION
from ..geometry.radii import CORE_OFFSETS
from ..kernels import nearest
from ..scene.frame_facts import FrameFacts
from ..types import Array, Floats
from .wide_stretches import strand_radius

WIDE_REGION_MARGIN = 1.5
"""Distance from the core of a wide region within which pixels belong to the region, in maximum half-widths of a strand."""

MIN_PLUG_RATIO = 1.3
"""Minimum ratio of the half-widths of a plug and its strand in the mask. Plugs and boots twice as wide as the strand have 1.3 to
2.1, since the rules lose their edges. A strand of another color has it over a pixel or two, but not over its half-width."""

MAX_PLUG_RADII = 4.0
"""Half-width of the widest plug in radii; the corners of a plug are no branches of the skeleton."""

MIN_STRAND_RADII = 15.0
"""Minimum length of a strand with its plug, in radii of the mask's strands: specks change width and color, too."""


def remove_wide_regions(facts: FrameFacts, config: SegmentConfig, focal: float = 1) -> FrameFacts:
    """Return the facts of a mask without regions that are wide in every direction, such as a gripper.

    A region is wide if its width exceeds `config.max_width`, or `config.max_width_ratio` times the median width of the mask.

    Parameters
    ----------
    facts
        the mask, with the depth; without depth, widths are in px.
    config
        section `segment` of the settings.
    focal
        focal length in px; not used without depth.

    Returns
    -------
    The facts of the remaining mask; `facts` itself if no region is wide.
    """
    if not facts.count:
        return facts
    box = facts.slices
    part = facts.mask[box]
    scale = facts.depth[box] / focal if facts.depth.size else np.ones(part.shape)
    distance = cv2.distanceTransform(np.pad(part, 1).astype(np.uint8), cv2.DIST_L2, 3)[1:-1, 1:-1]
    usual = ridge_radius(distance, scale)
    limit = min(config.max_width / 2, config.max_width_ratio * usual) if usual else config.max_width / 2
    core = distance * scale > limit
    if not core.any():
        return facts
    pixel = float(np.median(scale[core]))
    margin = WIDE_REGION_MARGIN * limit / pixel
    result = np.zeros_like(facts.mask)
    result[box] = part & (cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, 3) > margin)
    return FrameFacts(result, facts.depth)


def remove_plugs(facts: FrameFacts, color: Array) -> FrameFacts:
    """Return the facts of a mask without the plugs at the ends of its strands; `facts` itself if there are none.

    Parameters
    ----------
    facts
        the mask.
    color
        (H, W, 3) uint8 RGB, the image that was segmented.
    """
    radius = strand_radius(facts.axis[2])
    if not radius:
        return facts
    lines = facts.strand_lines(MAX_PLUG_RADII / 2 * radius)
    _, place, count = np.unique(np.rint(lines.points[lines.tips]), axis=0, return_inverse=True, return_counts=True)
    is_free = (count[place] == 1) & np.repeat(~lines.closed & (lines.lengths > MIN_STRAND_RADII * radius), 2)
    if not is_free.any():
        return facts
    inside, origin = half_widths(facts.mask)
    u, v = np.rint(lines.points - origin).astype(int).T
    half_width = inside[v, u]
    across = CORE_OFFSETS[:, None, None] * half_width[:, None] * lines.tangents[:, ::-1] * (-1, 1)
    colors = _colors_at(color, lines.points + across, radius)
    is_plug = np.zeros(len(u), dtype=bool)
    for end in np.flatnonzero(is_free).tolist():
        part = np.arange(*lines.bounds[end // 2 : end // 2 + 2])[:: 1 - 2 * (end % 2)]
        is_plug[part[: _plug_length(half_width[part], colors[:, part])]] = True
    if not is_plug.any():
        return facts
    pixels = facts.pixels
    reach = 2 * float(half_width[is_plug].max())
    near = ~np.isinf(nearest(pixels.astype(float), lines.points[is_plug], reach)[0])
    around = pixels[near]
    removed = around[is_plug[nearest(around.astype(float), lines.points, reach)[1]]]
    mask = facts.mask.copy()
    mask[removed[:, 1], removed[:, 0]] = False
    return FrameFacts(mask, facts.depth)


def _plug_length(half_width: Floats, colors: Floats) -> int:
    """Return the number of points at the start of a line that lie in a plug; 0 if it has none.

    half_width : (P,) px, of the mask at each point. colors : (C, P, 3) 8-bit CIELAB, C colors across the mask at each point.
    """
    usual = float(np.median(half_width))
    wide = half_width > MIN_PLUG_RATIO * usual
    first = int(wide.argmax())
    last = first + int(wide[first:].argmin())
    boot = round(MAX_PLUG_RADII * usual)
    if last - first < usual or first > boot:
        return 0
    difference = colors - np.median(colors[:, last:], axis=(0, 1))
    spread = np.maximum(MAD_TO_DEVIATION * np.median(np.abs(difference[:, last:]), axis=(0, 1)), COLOR_NOISE)
    apart = np.linalg.norm(difference / spread, axis=2).min(axis=0)
    of_plug, middle = float(np.median(apart[first:last])), (first + last) // 2
    unlike = median_filter(apart > of_plug / 2, 2 * round(usual) + 1)
    if of_plug < DEVIATIONS or not unlike[middle]:
        return 0
    return min(middle + int(unlike[middle:].argmin()), last + boot)


def _colors_at(color: Array, positions: Floats, radius: float) -> Floats:
    """Return the mean colors (C, P, 3) in 8-bit CIELAB around positions (C, P, 2) px, over the width of a strand's core."""
    side = 2 * round(CORE_OFFSETS.max() * radius) + 1
    u, v = np.moveaxis(np.rint(positions).astype(int).clip(0, np.array(color.shape[1::-1]) - 1), 2, 0)
    return np.asarray(cv2.cvtColor(cv2.blur(color, (side, side))[v, u], cv2.COLOR_RGB2LAB).astype(float))

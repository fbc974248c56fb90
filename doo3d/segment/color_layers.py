"""Sort the pixels of a mask into layers by color, where cables of several colors run side by side.

Keipour et al. (RA-L 2022, section III-A) segment cables of different colors apart. The steps are:

1. Take the hue of each colored pixel, and the lightness of each gray one; shading changes a cable's lightness and its chroma, but
   hardly its hue. The colors of the cables are the modes of their histograms. Pixels at the edge of the mask that look like the
   background are left out.
2. Give each pixel its color, drop narrow and short areas (highlights, ties), and fill them from the nearest pixel that is left.
3. Keep the layers if two of them share a long border along which the lightness has a valley, as between two round strands. Along
   the border of the two colors of one cable, such as an earth wire, it has none; strands that only cross share no long border.
"""

import math
from itertools import combinations

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter, gaussian_filter1d

from ..geometry.mask import grown_box
from ..scene.frame_facts import FrameFacts
from ..scene.masked import NO_NUMBERS
from ..types import Array, Bools, Floats, Ints
from .mask_parts import long_parts
from .wide_stretches import COARSE_RADIUS_PX

HUE_BINS, GRAY_BINS, SMOOTHING = 72, 32, 1.2
"""Bins of the histograms of hues and of the lightness of gray pixels, and the standard deviation in bins of the Gaussian that
smooths them: 6 degrees, the change of a hue by shading; by 7.5, red, orange and yellow would be one color."""

MAX_SADDLE = 0.4
"""Maximum height of the saddle between two colors, as a fraction of the lower mode; above it, they are shades of one color."""

WIDE = 1.2
"""Half-width in radii of the mask where strands may lie side by side."""

MIN_SATURATION = 0.12
"""Least chroma over luma of a pixel with a hue; those of white, gray and black cables, highlights and ties have less."""

MIN_LUMA = 32.0
"""Least luma by which chroma is divided: in darker pixels its noise would be larger than the colors of gray cables."""

EDGE_RADII = 0.5
"""Radii from the edge of a mask within which pixels may be background: masks of networks are so loose."""

OPENING_RADII, THIN_RADII = 0.2, 0.5
"""Radii of the discs that fit into the seen part of a strand everywhere, and somewhere: beneath others it is narrow, but not all
along."""

PART_RADII, TIE_WIDTHS = 3.0, 1.5
"""Length of the shortest part of a layer in radii, and in widths of the mask there: ties are as long as the bundle is wide."""

BORDER_RADII = 12.0
"""Radii of the shortest border between strands side by side; strands that cross at over 10 degrees share a shorter one."""

VALLEY_RADII, MIN_VALLEY = 0.7, 8.0
"""Half-width in radii of a valley between two strands, and its least depth, of 255: 14 to 58 in photographs of bundles, 0 to 2
along an earth wire."""

CHROMA_CELLS, MAX_CHROMA = 40, 1.25
"""Cells along each side of the histogram of chroma, and the largest chroma in it."""


def color_layers(facts: FrameFacts, color: Array, radius: float) -> Array:
    """Return the layer of each pixel of a mask, from 1, 0 outside, (H, W) uint8; (0, 0) unless cables of several colors touch.

    facts : the mask. color : (H, W, 3) uint8 RGB. radius : px, usual half-width of one strand.
    """
    wide, least = facts.axis[2] > WIDE * radius, BORDER_RADII * radius / 2
    if not radius or np.count_nonzero(wide) < least:
        return NO_NUMBERS
    if (step := int(radius / COARSE_RADIUS_PX)) > 1:  # most images have no layers, and a few pixels say so
        coarse = FrameFacts(np.ascontiguousarray(facts.mask[::step, ::step]))
        if not color_layers(coarse, color[::step, ::step], radius / step).size:
            return NO_NUMBERS
    box = grown_box(facts.slices, math.ceil(4 * radius), facts.mask.shape)
    mask = facts.mask[box]
    image = cv2.cvtColor(cv2.GaussianBlur(np.ascontiguousarray(color[box]), (5, 5), 1.0), cv2.COLOR_RGB2YCrCb)
    distance = cv2.distanceTransform(mask.view(np.uint8), cv2.DIST_L2, 5)
    away = 2 * cv2.distanceTransform((~mask[::2, ::2]).view(np.uint8), cv2.DIST_L2, 5)
    chroma, beside = _chroma(image[mask]), _chroma(image[::2, ::2][(away > radius / 2 + 1) & (away <= 3 * radius)])
    known = (distance[mask] > EDGE_RADII * radius) | _is_own(chroma, beside)
    shade, weight = _shades(chroma, image[..., 0][mask])
    number = _modes(np.bincount(shade[known], weight[known], HUE_BINS + GRAY_BINS).astype(float))
    seen, labels = np.zeros(mask.shape, np.uint8), np.zeros(mask.shape, np.uint8)
    seen[mask] = np.where(known, number[shade], 0)
    reach = np.ones((2 * math.ceil(facts.axis[2].max()) + 1,) * 2, np.uint8)
    mixed = cv2.dilate(seen, reach) > cv2.erode(np.where(seen > 0, seen, np.uint8(255)), reach)
    rows, columns = (at[wide] - side.start for at, side in zip(facts.axis[:2], box, strict=True))
    if np.count_nonzero(mixed[rows, columns]) < least:  # each wide stretch is of one color
        return NO_NUMBERS
    for k in range(1, int(number.max()) + 1):
        opened = cv2.morphologyEx((seen == k).view(np.uint8), cv2.MORPH_OPEN, _disc(OPENING_RADII * radius))
        if cv2.erode(opened, _disc(THIN_RADII * radius)).any():  # no gap between the turns of a coil
            labels[long_parts(opened > 0, PART_RADII * radius, TIE_WIDTHS * 2 * distance)] = k
    used, labels = np.unique(labels[labels > 0]), _spread(labels, mask)
    if not _are_cables(labels, used, image[..., 0], radius):
        return NO_NUMBERS
    layers = np.zeros(facts.mask.shape, np.uint8)
    layers[box] = np.where(labels > 0, np.searchsorted(used, labels) + 1, 0)
    return layers


def _disc(px: float) -> Array:
    """Return a disc for the operations of mathematical morphology; px : its radius, at least 1."""
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * max(1, round(px)) + 1,) * 2))


def _chroma(pixels: Array) -> Floats:
    """Return the chroma of N pixels over their luma, which shading does not change, (N, 2); pixels : (N, 3) uint8 YCrCb."""
    return np.asarray((pixels[:, 1:] - np.float32(128)) / np.maximum(pixels[:, :1], MIN_LUMA))


def _shades(chroma: Floats, luma: Array) -> tuple[Ints, Floats]:
    """Return the bin of each pixel (N,): of its hue or, for a gray one, of its lightness; and its weight in the histogram."""
    saturation = np.hypot(chroma[:, 0], chroma[:, 1])
    hue = (np.arctan2(chroma[:, 0], chroma[:, 1]) / (2 * np.pi) % 1 * HUE_BINS).astype(np.int64) % HUE_BINS
    is_gray = saturation < MIN_SATURATION
    return np.where(is_gray, HUE_BINS + luma.astype(np.int64) * GRAY_BINS // 256, hue), np.where(is_gray, 1.0, saturation)


def _is_own(chroma: Floats, beside: Floats) -> Bools:
    """Return which pixels (N,) of a mask have a chroma that is commoner in the mask than beside it; beside : (M, 2)."""
    scaled = (np.clip((each / MAX_CHROMA + 1) / 2 * CHROMA_CELLS, 0, CHROMA_CELLS - 1) for each in (chroma, beside))
    cells = [each.astype(np.int64) @ (CHROMA_CELLS, 1) for each in scaled]
    shares = (np.bincount(cell, minlength=CHROMA_CELLS**2).reshape(CHROMA_CELLS, -1) / max(len(cell), 1) for cell in cells)
    inside, outside = (gaussian_filter(share, 1.0).ravel() for share in shares)
    return np.asarray((inside > outside)[cells[0]])


def _modes(counts: Floats) -> Ints:
    """Return the number of the color of each bin, from 1; 0 for bins of no color. counts : of all hues, then of all grays."""
    hues = hue_modes(counts[:HUE_BINS])
    grays = hue_modes(np.pad(counts[HUE_BINS:], GRAY_BINS))[GRAY_BINS : 2 * GRAY_BINS]
    return np.concatenate((hues, np.where(grays > 0, grays + hues.max(), 0)))


def hue_modes(counts: Floats) -> Ints:
    """Return the number of the mode, from 1, of each bin of a histogram of hues (B,); 0 for an empty histogram.

    Modes are merged across the highest saddle until all saddles are low. The last bin is beside the first.
    """
    height = gaussian_filter1d(counts, SMOOTHING, mode="wrap")
    cuts = np.flatnonzero((height < np.roll(height, 1)) & (height <= np.roll(height, -1)))
    while len(cuts) > 1:
        peak = np.maximum.reduceat(np.roll(height, -cuts[0]), cuts - cuts[0])
        saddle = height[cuts] / np.minimum(peak, np.roll(peak, 1))
        if saddle.max() <= MAX_SADDLE:
            break
        cuts = np.delete(cuts, saddle.argmax())
    number = np.searchsorted(cuts, np.arange(len(counts)), side="right")
    return np.asarray(np.where(number == 0, max(len(cuts), 1), number) * height.any())


def _spread(labels: Array, mask: Bools) -> Array:
    """Return the label (h, w) uint8 of each pixel of a mask: that of the nearest pixel with a label."""
    _, nearest = cv2.distanceTransformWithLabels((labels == 0).view(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    of_pixel = np.zeros(int(nearest.max()) + 1, np.uint8)
    of_pixel[nearest[labels > 0]] = labels[labels > 0]
    return np.where(mask, of_pixel[nearest], np.uint8(0))


def _are_cables(labels: Array, used: Ints, luma: Array, radius: float) -> bool:
    """Return whether two of the colors used lie side by side with a valley between them, and are not the colors of one cable.

    labels, luma : (h, w) uint8. radius : px.
    """
    valley = cv2.dilate(cv2.morphologyEx(luma, cv2.MORPH_BLACKHAT, _disc(VALLEY_RADII * radius)), np.ones((3, 3), np.uint8))
    grown = [cv2.dilate((labels == k).view(np.uint8), np.ones((3, 3), np.uint8)) > 0 for k in used]
    borders = (long_parts(one & other, BORDER_RADII * radius) for one, other in combinations(grown, 2))
    return any(border.any() and np.median(valley[border]) >= MIN_VALLEY for border in borders)

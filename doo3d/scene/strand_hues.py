"""Assign the pixels of a mask to strands by their hue, where cables of several colors touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter1d

from ..geometry.noise import SAMPLES
from ..types import Array, Bools, Floats, Ints

HUE_BINS, HUE_SMOOTHING = 72, 1.5
"""Number of bins of the histogram of hues, and the standard deviation in bins of the Gaussian that smooths it: 7.5 degrees, the
change of a hue by shading."""

MIN_CHROMA = 8.0
"""Minimum chroma, the length of (Cr, Cb) in 8-bit YCrCb, of a pixel with a hue; highlights, ties and black cables have less."""

MIDDLE = 128
"""Cr and Cb of gray in 8 bits."""

MAX_SADDLE = 0.4
"""Maximum height of the saddle between two colors, as a fraction of the lower mode; above it, they are shades of one color."""

MIN_VOTES = 0.05
"""Number of joints added to the votes for each color at the end of a line: the noise of the colors."""

OPENING_RADII = 0.2
"""Radius, in radii of a strand, of a disc that must fit into the pixels of a hue; narrower areas are background at the mask's
edge."""


@dataclass(frozen=True)
class StrandHues:
    """The hues of the strands of an object.

    Shading, shadows and highlights change the lightness and the chroma of a strand, but hardly its hue. Colors are the modes of
    the histogram of the hues in the mask, weighted by chroma. Two modes are two colors if the saddle between them is low.

    Attributes
    ----------
    color_of
        (HUE_BINS,) int, number of the color of each hue, from 1.
    count
        number of colors; 0 for an object without hues.
    """

    color_of: Ints
    count: int

    @classmethod
    def learn(cls, color: Array, pixels: Ints) -> StrandHues:
        """Learn the hues of an object from a sample of its pixels.

        Parameters
        ----------
        color
            (H, W, 3) uint8 RGB.
        pixels
            (N, 2) int64 (u, v), the pixels of the object.
        """
        some = pixels[:: max(1, len(pixels) // SAMPLES)]
        hue, chroma = _hues(np.ascontiguousarray(color[some[:, 1], some[:, 0]][None]))
        weight = chroma * (chroma > MIN_CHROMA)
        color_of = hue_modes(np.asarray(np.bincount(hue[0], weight[0], HUE_BINS), dtype=float))
        return cls(color_of, int(color_of.max()))

    def label(self, color: Array, mask: Bools, axis: tuple[Ints, Ints], radius: float, length: float, wide: Bools) -> Ints:
        """Return the number of the color (h, w) uint8 of the strand at each pixel of a mask, from 1; 0 outside.

        A pixel without hue, or where no disc fits into the pixels of its color, gets the color of the nearest other pixel. A
        color that nowhere fills the width of the mask over `length` belongs to a cable of several colors, and is ignored.

        Parameters
        ----------
        color
            (h, w, 3) uint8 RGB.
        mask
            (h, w) bool.
        axis
            rows and columns (K,) int64 of the pixels of the mask's medial axis.
        radius
            px, usual half-width of one strand.
        length
            px, minimum length over which a strand's color fills the width of the mask; that of a stripe along a cable never does.
        """
        hue, chroma = _hues(cv2.GaussianBlur(color, (5, 5), 1.0)[mask][None])
        seen = np.zeros(mask.shape, np.uint8)
        seen[mask] = np.where(chroma > MIN_CHROMA, self.color_of[hue], 0)[0]
        side = 2 * max(1, round(OPENING_RADII * radius)) + 1
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
        opened = [cv2.morphologyEx((seen == k).view(np.uint8), cv2.MORPH_OPEN, disc) for k in range(1, self.count + 1)]
        labels = np.zeros(mask.shape, np.uint8)
        around = np.ones((2 * round(radius) + 1,) * 2, np.uint8)
        beside = [cv2.dilate(own, around)[axis] for own in opened]
        for k, own in enumerate(opened):
            others = np.max(beside[:k] + beside[k + 1 :], axis=0)
            if np.count_nonzero((beside[k] > 0) & wide | (own[axis] > others)) >= length:
                labels[own > 0] = k + 1
        if labels.max() == labels[labels > 0].min(initial=255):
            return np.where(mask, labels.max(), np.uint8(0))
        _, nearest = cv2.distanceTransformWithLabels((labels == 0).view(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
        of_pixel = np.zeros(int(nearest.max()) + 1, np.uint8)
        of_pixel[nearest[labels > 0]] = labels[labels > 0]
        return np.where(mask, of_pixel[nearest], np.uint8(0))


def hue_modes(counts: Array) -> Ints:
    """Return the number of the mode, from 1, of each bin of a histogram of hues (HUE_BINS,); 0 for an empty histogram.

    Modes are merged across the highest saddle until all saddles are low.
    """
    height = gaussian_filter1d(counts, HUE_SMOOTHING, mode="wrap")
    if not height.any():
        return np.zeros(HUE_BINS, dtype=int)
    cuts = np.flatnonzero((height < np.roll(height, 1)) & (height <= np.roll(height, -1)))
    while len(cuts) > 1:
        peak = np.maximum.reduceat(np.roll(height, -cuts[0]), cuts - cuts[0])
        saddle = height[cuts] / np.minimum(peak, np.roll(peak, 1))
        if saddle.max() <= MAX_SADDLE:
            break
        cuts = np.delete(cuts, saddle.argmax())
    number = np.searchsorted(cuts, np.arange(HUE_BINS), side="right")
    return np.where(number == 0, max(len(cuts), 1), number)


def unlike_ends(labels: Array, lines: Sequence[Floats], window: int) -> Floats:
    """Return minus the log-probability that two ends have the same color, for each pair of the E ends of E / 2 lines.

    The colors at the joints nearest to an end are votes, with MIN_VOTES added for each color.

    Parameters
    ----------
    labels
        (H, W) uint8, number of the color of the strand at each pixel, from 1; 0 = no color.
    lines
        the joints of each line, (N + 1, 2) px.
    window
        number of joints at each end whose colors are votes.

    Returns
    -------
    (E, E) nat, symmetric, 0 or more.
    """
    votes = np.full((2 * len(lines), int(labels.max(initial=0)) + 1), MIN_VOTES)
    limit = np.array(labels.shape[::-1]) - 1
    for i, line in enumerate(lines):
        for side, joints in enumerate((line[:window], line[-window:])):
            u, v = np.clip(np.rint(joints).astype(np.int64), 0, limit).T
            np.add.at(votes[2 * i + side], labels[v, u], 1.0)
    share = votes[:, 1:] / votes[:, 1:].sum(axis=1, keepdims=True)
    return np.asarray(np.maximum(-np.log(share @ share.T), 0))


def _hues(color: Array) -> tuple[Ints, Floats]:
    """Return the bin of the hue and the chroma, both (h, w), of an image (h, w, 3) uint8 RGB."""
    cr, cb = np.moveaxis(cv2.cvtColor(color, cv2.COLOR_RGB2YCrCb)[:, :, 1:].astype(np.float32) - MIDDLE, 2, 0)
    angle = np.arctan2(cr, cb) / (2 * np.pi) % 1
    return (angle * HUE_BINS).astype(np.int64) % HUE_BINS, np.hypot(cr, cb)

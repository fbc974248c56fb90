"""Tell by its hue which strand shows at each pixel of a mask, where cables of several colors touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter1d

from ..geometry.noise import SAMPLES
from ..types import Array, Bools, Floats, Ints

HUE_BINS, HUE_SMOOTHING = 72, 1.5
"""Bins of the histogram of hues, and the standard deviation in bins by which it is smoothed, 7.5 degrees: shading turns a hue so
far."""

MIN_CHROMA = 8.0
"""Length of (Cr, Cb) in 8-bit YCrCb below which a pixel has no hue: highlights, ties, black cables."""

MIDDLE = 128
"""Value of Cr and Cb of gray."""

MAX_SADDLE = 0.4
"""Height of the saddle between two hues over that of the lower: at more, they are shades of one color."""

MIN_VOTES = 0.05
"""Joints that count for every color at the end of a line, beside those that show it: the noise of its colors."""

OPENING_RADII = 0.4
"""Radii of the disc that has to fit into the pixels of a hue: what is narrower is the background at the mask's edge."""


@dataclass(frozen=True)
class StrandHues:
    """The hues of the strands of an object.

    Shading, shadows and highlights change the lightness and the chroma of a strand, its hue hardly. Hues are the modes of the
    histogram of all hues in the mask, each weighted by its chroma. Two modes are two colors if the saddle between them is low.

    Attributes
    ----------
    color_of
        (HUE_BINS,) int, the number of the color of each hue, from 1.
    count
        number of colors; 0 for an object without hue.
    """

    color_of: Ints
    count: int

    @classmethod
    def learn(cls, color: Array, pixels: Ints) -> StrandHues:
        """Learn the hues of an object from some of its pixels.

        Parameters
        ----------
        color
            (H, W, 3) uint8 RGB.
        pixels
            (N, 2) int64 (u, v), the pixels of its mask.
        """
        some = pixels[:: max(1, len(pixels) // SAMPLES)]
        hue, chroma = _hues(np.ascontiguousarray(color[some[:, 1], some[:, 0]][None]))
        weight = chroma * (chroma > MIN_CHROMA)
        color_of = hue_modes(np.asarray(np.bincount(hue[0], weight[0], HUE_BINS), dtype=float))
        return cls(color_of, int(color_of.max()))

    def label(self, color: Array, mask: Bools, axis: tuple[Ints, Ints], radius: float, length: float) -> Ints:
        """Return the color (h, w) uint8 of the strand that shows at each pixel of a mask, from 1; 0 outside.

        A pixel without hue, and one where no disc fits into the pixels of its color, has the color of the nearest other pixel. A
        color that nowhere fills the width of the mask over some length belongs to a cable of several colors, and has none.

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
            px, over which a hue has to show alone across the mask, as a stripe along a cable never does.
        """
        hue, chroma = _hues(cv2.GaussianBlur(color, (5, 5), 1.0)[mask][None])
        seen = np.zeros(mask.shape, np.uint8)
        seen[mask] = np.where(chroma > MIN_CHROMA, self.color_of[hue], 0)[0]
        side = 2 * max(1, round(OPENING_RADII * radius)) + 1
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
        shown = [cv2.morphologyEx((seen == k).view(np.uint8), cv2.MORPH_OPEN, disc) for k in range(1, self.count + 1)]
        labels = np.zeros(mask.shape, np.uint8)
        around = np.ones((2 * round(radius) + 1,) * 2, np.uint8)
        beside = [cv2.dilate(own, around)[axis] for own in shown]
        for k, own in enumerate(shown):
            others = np.max(beside[:k] + beside[k + 1 :], axis=0)
            if np.count_nonzero(own[axis] > others) >= length:
                labels[own > 0] = k + 1
        if labels.max() == labels[labels > 0].min(initial=255):
            return np.where(mask, labels.max(), np.uint8(0))
        _, nearest = cv2.distanceTransformWithLabels((labels == 0).view(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
        of_pixel = np.zeros(int(nearest.max()) + 1, np.uint8)
        of_pixel[nearest[labels > 0]] = labels[labels > 0]
        return np.where(mask, of_pixel[nearest], np.uint8(0))


def hue_modes(counts: Array) -> Ints:
    """Return the number of the mode, from 1, of each bin of a histogram of hues (HUE_BINS,); 0 everywhere if it is empty.

    Modes are joined across their highest saddle until every saddle is low.
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
    """Return how much less likely the ends of E / 2 lines show one color than two of the same color do, for each pair of ends.

    The colors at the joints nearest to an end are votes, with MIN_VOTES for each color that was not seen.

    Parameters
    ----------
    labels
        (H, W) uint8, the number of the color of the strand at each pixel, from 1; 0 for none.
    lines
        the joints of each line, (N + 1, 2) px.
    window
        number of joints from an end whose colors count.

    Returns
    -------
    (E, E) nat, symmetric, 0 or more: minus the logarithm of the chance that both show the same color.
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
    """Return the bin of the hue and the chroma, both (h, w), of (h, w, 3) uint8 RGB."""
    cr, cb = np.moveaxis(cv2.cvtColor(color, cv2.COLOR_RGB2YCrCb)[:, :, 1:].astype(np.float32) - MIDDLE, 2, 0)
    angle = np.arctan2(cr, cb) / (2 * np.pi) % 1
    return (angle * HUE_BINS).astype(np.int64) % HUE_BINS, np.hypot(cr, cb)

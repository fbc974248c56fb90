"""Which pixels of a mask no chain claims."""

import itertools

import cv2
import numpy as np

from ..geometry.curves import Curves
from ..types import Array, Floats, Ints
from .frame_facts import FrameFacts

CLAIMED_RADII, CLAIMED_MARGIN_PX = 1.6, 1.5
"""Distance in the view from an axis within which a pixel of the mask is that chain's."""

DRAWN_EVERY = 3
"""Samples per line that is drawn along a chain to find the pixels that are its own."""

MAX_PIXEL, MAX_THICKNESS_PX = 1e5, 255
"""px; positions farther out are not drawn, and the widest line that can be."""


def unclaimed_shares(view: Curves, reach: Floats, facts: FrameFacts, is_clean: bool) -> Floats:
    """Return for each of C curves the share of the pixels of a mask that are near no curve, (C,).

    Parameters
    ----------
    view, reach
        samples of the curves in the image, px, and (S,) px, the radius at each.
    facts
        the mask.
    is_clean
        False if the mask may hold noise of depth: then the connected parts that a curve runs through are counted for it alone.
    """
    none = np.zeros(len(view.counts))
    if not facts.count:
        return none
    mask = facts.mask[facts.slices].astype(np.uint8)
    left = mask.copy()
    corner = np.array([cut.start for cut in facts.slices[::-1]])
    pixels = np.rint(view.points - corner)
    thickness = np.rint(2 * (CLAIMED_RADII * reach + CLAIMED_MARGIN_PX)).clip(1, MAX_THICKNESS_PX)
    for part in view.parts:
        if part.start < part.stop and np.abs(view.points[part]).max() < MAX_PIXEL:
            _draw_line(left, pixels[part][::DRAWN_EVERY].astype(np.int32), thickness[part][::DRAWN_EVERY].astype(int))
    if is_clean:
        return none + cv2.countNonZero(left) / facts.count
    return _shares_of_parts(mask, left, pixels, view)


def _shares_of_parts(mask: Array, left: Array, pixels: Floats, view: Curves) -> Floats:
    """Return for each chain the share of the pixels that are left of the 8-connected parts of a mask that it runs through, (C,).

    pixels : (S, 2), (u, v), whole numbers, of the samples of the chains in the view.
    """
    parts, sizes = cv2.connectedComponentsWithStats(mask)[1:3]
    lost = np.bincount(parts[left > 0], minlength=len(sizes))
    inside = ((pixels >= 0) & (pixels < mask.shape[::-1])).all(axis=1)
    at = np.zeros(len(pixels), dtype=int)
    at[inside] = parts[tuple(pixels[inside, ::-1].astype(int).T)]
    shares = []
    for part in view.parts:
        own = np.setdiff1d(at[part], 0)
        shares.append(lost[own].sum() / max(sizes[own, cv2.CC_STAT_AREA].sum(), 1))
    return np.array(shares)


def _draw_line(image: Array, pixels: Ints, thickness: Ints) -> None:
    """Draw zeros along pixels (P, 2), (u, v), in place, between two of them as thick as at the first, (P,)."""
    pixels = np.concatenate((pixels, pixels[-1:]))
    bounds = [0, *(np.flatnonzero(np.diff(thickness)) + 1).tolist(), len(thickness)]
    for start, end in itertools.pairwise(bounds):
        cv2.polylines(image, [pixels[start : end + 1]], False, 0, int(thickness[start]))

"""Where the mask ends and the image shows the same strand going on, the strand goes on.

A segmentation misses stretches: another light, a shadow, a background like the strand. Each free end of a chain is followed
by steps of half a radius: the strand ahead has the colours across that it has had so far, and the background on both of its
sides has others. What is found is added to the mask, and the stages are gone through again.
"""

from __future__ import annotations

import cv2
import numpy as np

from ..config import ExtendMaskConfig
from ..types import Array, Bools, Chain, Floats
from . import FrameContext

INSIDE = np.linspace(-0.7, 0.7, 5)  # radii from the middle, where the strand's colours are read
BESIDE = np.array([-2.2, -1.7, 1.7, 2.2])  # and its background's, clear of soft edges
STEP, LOOKS = 0.5, 4  # radii, and how many steps ahead every step is judged by
TURNS = np.linspace(-1, 1, 7) * STEP / 2  # radians a step: no object bends more sharply than two of its radii
SHIFTS = np.array([-1.0, 0.0, 1.0])  # px aside
TAIL, COURSE = 10.0, 4.0  # radii before the end from which the colours and the direction are taken
STRANGE = 25.0  # a difference above which colours are just as strange: a speck must not outweigh the rest
SUBPIXEL = 4  # bits of cv2's drawing
CONTRAST_WEIGHT, CONTRAST_ENOUGH, TURN_WEIGHT, SHIFT_WEIGHT = 0.5, 6.0, 0.36, 0.05  # among ways that all look right


MAX_HIDDEN = 8.0
"""Radii of the strand that may look different: another strand on top, a print, a glare."""

COLOR_NOISE = 6.0
"""Grey levels of 255 by which the colors of one strand differ anyway."""

MAX_COLOR_DISTANCE = 2.5
"""Squared color distance of the strand ahead from the strand so far, at most, in variances of the latter."""

MIN_CONTRAST = 1.5
"""Squared color distance by which the background on either side must differ more than that."""

COLOR_ADAPTATION = 0.2
"""Fraction of the colors ahead that a strand takes over at a step of half a radius."""


def extend_mask(chains: list[Chain], context: FrameContext, config: ExtendMaskConfig) -> Bools | None:
    """The mask (H, W) of an image with the stretches of strands that it misses; None where there are none.

    chains : as found in it, px, radii known. An end at the image's border has nowhere to go on to.
    """
    foreground = context.foreground
    mask, color = foreground.mask, foreground.color
    if not config.max_length or mask is None or color is None or foreground.points.shape[1] != 2:
        return None
    smooth = cv2.GaussianBlur(color, (3, 3), 0)
    grown, found = mask.astype(np.uint8), False
    for chain in chains:
        for joints, radii in ((chain.joints, chain.radii), (chain.joints[::-1], chain.radii[::-1])):
            radius = float(np.median(radii[-6:]))
            if chain.closed or not radius > 0 or not _within(joints[-1], mask, radius * (1 + STEP)):
                continue
            way = follow(smooth, mask, joints, radius, config)
            if np.linalg.norm(way[-1] - way[0]) > 2 * radius:
                points = np.round(way * 2**SUBPIXEL).astype(np.int32)
                cv2.polylines(grown, [points], False, 1, max(1, round(2 * radius)), cv2.LINE_8, SUBPIXEL)
                found = True
    return grown > 0 if found else None


def follow(image: Array, mask: Bools, joints: Floats, radius: float, config: ExtendMaskConfig) -> Floats:
    """(P, 2) px, the way on from the last of the joints (N, 2), which comes first; P = 1 where there is none.

    image : (H, W, 3). What hides the strand is jumped, up to `hidden` radii; it ends in what the mask has already.
    """
    tail = _tail(joints, TAIL * radius)
    course = tail[-1] - _tail(tail, COURSE * radius)[0]
    angle, place = float(np.arctan2(course[1], course[0])), tail[-1]
    colors, spread = _colors(image, tail, radius, COLOR_NOISE)
    step, scan = STEP * radius, int(MAX_HIDDEN / STEP) + 1
    way, gone, blocked = [place], 0.0, True
    while gone < config.max_length * radius:
        angles = angle + TURNS[:, None, None]
        along = np.stack((np.cos(angles), np.sin(angles)), axis=-1)
        aside = np.stack((-along[..., 1], along[..., 0]), axis=-1)
        for first, count in ((0, 1), (1, scan - 1))[:scan]:  # the next step; where that fails, all beyond what may hide it
            looks = step * np.arange(first + 1, first + count + LOOKS)[:, None]
            places = place + along * looks + aside * SHIFTS[:, None, None]  # (turns, shifts, looks, 2)
            inside = _read(image, places[..., None, :] + aside[..., None, :] * radius * INSIDE[:, None])
            beside = _read(image, places[..., None, :] + aside[..., None, :] * radius * BESIDE[:, None])
            difference = _ahead(_strange(inside - colors, spread).mean(axis=-1))
            other = _strange(beside[..., None, :] - colors, spread).min(axis=-1)
            contrast = _ahead(other.reshape(*other.shape[:-1], 2, -1).mean(axis=-1), axis=-2).min(axis=-1)
            cost = difference - CONTRAST_WEIGHT * np.minimum(contrast, CONTRAST_ENOUGH)
            cost += (TURN_WEIGHT * (TURNS[:, None] / TURNS[-1]) ** 2 + SHIFT_WEIGHT * SHIFTS**2)[..., None]
            best = cost.reshape(-1, count).argmin(axis=0)
            each = np.arange(count)
            strange, clear = difference.reshape(-1, count)[best, each], contrast.reshape(-1, count)[best, each]
            seen = np.flatnonzero((strange <= MAX_COLOR_DISTANCE) & (clear >= strange + MIN_CONTRAST))
            blocked = not len(seen)
            if not blocked:
                break
        if blocked:
            break
        turn, shift = np.unravel_index(best[seen[0]], cost.shape[:2])
        colors = colors + COLOR_ADAPTATION * (inside[turn, shift, seen[0]] - colors)
        place, angle = places[turn, shift, seen[0]], angle + float(TURNS[turn])
        way.append(place)
        gone += float(looks[seen[0], 0])
        if not _within(place, mask, 0) or (gone > 2 * radius and mask[tuple(np.rint(place[::-1]).astype(int))]):
            break
    return np.array(way)


def _ahead(values: Floats, axis: int = -1) -> Floats:
    """The means over LOOKS neighbours along an axis."""
    return np.asarray(np.lib.stride_tricks.sliding_window_view(values, LOOKS, axis=axis).mean(axis=-1))


def _within(place: Floats, mask: Bools, margin: float) -> bool:
    """Whether the place (2,) lies in the image, that far from its border."""
    return bool((place >= margin).all() and (place <= np.array(mask.shape[::-1]) - 1 - margin).all())


def _tail(joints: Floats, length: float) -> Floats:
    """The last joints over a length, two at least."""
    count = int(np.ceil(length / np.linalg.norm(joints[-1] - joints[-2])))
    return joints[-max(1, count) - 1 :]


def _colors(image: Array, tail: Floats, radius: float, noise: float) -> tuple[Floats, Floats]:
    """The mean colours across a strand, (I, 3) for the places INSIDE, and their variance along it, (3,).

    The last radius is left out, where the mask may end slantwise.
    """
    along = np.diff(tail, axis=0)
    size = float(np.linalg.norm(along[0]))
    at = np.arange(0, max(len(along) * size - radius, 1.0), 1.0)
    segment = np.minimum((at / size).astype(int), len(along) - 1)
    ahead = along[segment] / size
    places = tail[segment] + ahead * (at - segment * size)[:, None]
    aside = np.column_stack((-ahead[:, 1], ahead[:, 0]))
    seen = _read(image, places[:, None] + aside[:, None] * radius * INSIDE[:, None])
    return seen.mean(axis=0), seen.var(axis=0).mean(axis=0) + noise**2


def _read(image: Array, places: Floats) -> Floats:
    """(..., 3) the nearest pixels of places (..., 2), those of the border beyond it."""
    u, v = np.rint(places[..., 0]).astype(int), np.rint(places[..., 1]).astype(int)
    return np.asarray(image[v.clip(0, image.shape[0] - 1), u.clip(0, image.shape[1] - 1)], dtype=float)


def _strange(difference: Floats, spread: Floats) -> Floats:
    """Mean over the channels of squared differences (..., 3) in variances, bounded."""
    return np.asarray(np.minimum((difference**2 / spread).mean(axis=-1), STRANGE))

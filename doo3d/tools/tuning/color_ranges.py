"""Find the thin objects in an image at picks or in a box, and the color ranges that segment them."""

import math
from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from ...config import HsvRange
from ...errors import InputError
from ...segment.methods.hsv import in_ranges
from ...types import Array, Bools
from .hsv_range import completed_mask, fit_range
from .thin_object import ThinObject, find_thin_object, object_at

MAX_SEARCH_PIXELS = 1_500_000
"""Greatest number of pixels of the image in which the object is searched; larger images are scaled down."""

MAX_FALSE_SHARE = 0.5
"""Greatest fraction of the color ranges' pixels outside the object; above it, the color does not distinguish the object."""

BORDER_SHARE = 1 / 3
"""Fraction of a strand's half width, at its border, that the color ranges are not fitted to; `completed_mask` adds it if its
color agrees."""

OTHER_METHODS = (
    "use another method: segment.method=plane if it stands off a surface in the depth, background with an image "
    "without it (segment.reference), or your own mask (doo3d detect --mask)"
)


def find_ranges(
    color: Array, picks: Sequence[tuple[int, int]], box: tuple[int, int, int, int] | None
) -> tuple[list[Bools], tuple[HsvRange, ...]]:
    """Return the masks (H, W) of the objects at picks or in a box, and the color ranges that segment them."""
    _check_inside(color.shape[1], color.shape[0], picks, box)
    small, scale = reduced(color)
    candidates = _find_objects(small, [(int(x * scale), int(y * scale)) for x, y in picks], _scaled(box, scale))
    objects = [replace(thin, mask=completed_mask(small, thin)) for thin in candidates]
    ranges, _ = fit_ranges(small, objects)
    segmented, union = in_ranges(small, tuple(ranges)), np.logical_or.reduce([thin.mask for thin in objects])
    if (segmented & ~union).sum() > MAX_FALSE_SHARE * segmented.sum():
        raise InputError(
            f"no color range separates the thin object from the background: {np.mean(segmented & ~union):.0%} of the image has "
            f"its colors too: {OTHER_METHODS}",
            code="color-not-distinct",
        )
    return [full_size(thin.mask, color) for thin in objects], tuple(ranges)


def fit_ranges(color: Array, objects: Sequence[ThinObject]) -> tuple[list[HsvRange], list[float]]:
    """Return the color range of each object, and the fraction of the range's pixels outside all objects."""
    union = np.logical_or.reduce([thin.mask for thin in objects])
    ranges, false = list[HsvRange](), list[float]()
    for thin in objects:
        ranges.append(fit_range(color, thin, union & ~thin.mask))
        segmented = in_ranges(color, (ranges[-1],))
        false.append(float((segmented & ~union).sum() / max(1, segmented.sum())))
    return ranges, false


def reduced(color: Array) -> tuple[Array, float]:
    """Scale an image (H, W, 3) down to at most MAX_SEARCH_PIXELS; return it and the scale, 1 or less."""
    scale = min(1.0, math.sqrt(MAX_SEARCH_PIXELS / (color.shape[0] * color.shape[1])))
    return (color if scale == 1 else cv2.resize(color, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)), scale


def core(thin: ThinObject, shape: tuple[int, ...], scale: float) -> ThinObject:
    """Return the middle of an object in a scaled image, without its border, which may be background.

    shape : (width, height) px of the scaled image. scale : its scale.
    """
    mask = cv2.resize(thin.mask.view(np.uint8), shape, interpolation=cv2.INTER_NEAREST)
    half_width = scale * thin.half_width
    middle = cv2.distanceTransform(mask, cv2.DIST_L2, 3) > BORDER_SHARE * half_width
    return ThinObject(np.asarray(middle), thin.share, scale * thin.length, half_width)


def full_size(mask: Bools, color: Array) -> Bools:
    """Scale a mask to the size of an image (H, W, 3)."""
    return np.asarray(cv2.resize(mask.view(np.uint8), color.shape[1::-1], interpolation=cv2.INTER_NEAREST) > 0)


def _check_inside(width: int, height: int, picks: Sequence[tuple[int, int]], box: tuple[int, int, int, int] | None) -> None:
    for x, y in picks:
        if not (0 <= x < width and 0 <= y < height):
            raise InputError(f"--pick {x},{y}: is outside the image, which is {width}x{height} px", code="place-outside")
    if box and not (0 <= box[0] < box[0] + box[2] <= width and 0 <= box[1] < box[1] + box[3] <= height):
        raise InputError(
            f"--box {','.join(map(str, box))}: is not inside the image, which is {width}x{height} px", code="place-outside"
        )


def _scaled(box: tuple[int, int, int, int] | None, scale: float) -> tuple[int, int, int, int] | None:
    if box is None:
        return None
    x, y, w, h = (int(part * scale) for part in box)
    return x, y, max(w, 1), max(h, 1)


def _find_objects(color: Array, picks: Sequence[tuple[int, int]], box: tuple[int, int, int, int] | None) -> list[ThinObject]:
    """Return the objects at the picks, each once; without picks, the most prominent one in the box or the image."""
    if not picks:
        thin = find_thin_object(color, box)
        if thin is None:
            region = "in the box" if box else "in the image"
            raise InputError(
                f"no thin, long object {region} has a color of its own: select it with --pick X,Y, or {OTHER_METHODS}",
                code="object-missing",
            )
        return [thin]
    objects: list[ThinObject] = []
    for x, y in picks:
        if any(thin.mask[y, x] for thin in objects):
            continue
        thin = object_at(color, (x, y))
        if thin is None:
            raise InputError(
                f"the color at the pick {x},{y} of the image is not that of a thin, long object: if the pick lies on the "
                f"background, pick the middle of the object; if not, the background has its color, so {OTHER_METHODS}",
                code="pick-not-thin",
            )
        objects.append(thin)
    return objects

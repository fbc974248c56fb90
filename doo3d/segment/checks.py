"""Checks that the object can be where it is: depth and points in metres, masks and clouds of a size that the stages can take."""

import numpy as np

from ..config import SegmentConfig
from ..errors import InputError
from ..geometry.limits import MAX_CELLS
from ..geometry.mask import dilate
from ..geometry.noise import SAMPLES
from ..scene.frame_facts import FrameFacts
from ..types import Array, Floats, Frame

HOLE_MARGIN_PX = 16
"""Width of the border of an object whose readings tell why the object has none: stereo makes its holes up to 8 px too wide."""

MIN_DEPTH_SHARE_AROUND = 0.3
"""Of the pixels in that border; a hole that is 8 px too wide leaves a half."""

EXTENT_TOLERANCE = 10
"""Allowed ratio between the extent of a cloud and [min_depth, max_depth]; beyond it the unit must be wrong."""


def check_size(pixels: int) -> None:
    """Refuse a mask of so many pixels that the stages would take too much time and memory, before any of them."""
    if pixels > MAX_CELLS:
        raise InputError(f"the mask has {pixels} pixels, the limit is {MAX_CELLS}: scale the image down", code="voxels-too-many")


def median_depth(frame: Frame) -> float | None:
    """Return the median of a grid of a frame's readings, m; None without readings."""
    step = max(1, int(np.sqrt(frame.depth.size / SAMPLES)))
    some = frame.depth[::step, ::step]
    readings = some[some > 0] if (some > 0).any() else frame.depth[frame.depth > 0]
    some = readings[:: max(1, readings.size // SAMPLES)]
    return float(np.median(some)) if len(some) else None


def check_distance(median: float | None, frame: Frame, pixels: int, part: str, config: SegmentConfig) -> None:
    """Refuse a part of the frame of so many pixels without a median reading, m, and one whose median tells of a wrong unit."""
    if median is None:
        raise InputError(
            f"no depth at any of the {pixels} pixels of the {part}: is the depth aligned to the mask, and in metres?",
            code="depth-none",
        )
    if not config.min_depth <= median <= config.max_depth:
        raise InputError(
            f"the {part} is {median:.6g} m away, expected {config.min_depth:g} to {config.max_depth:g} m: "
            "check depth_scale (units per metre), or set segment.min_depth and segment.max_depth",
            code="depth-unit",
        )


def check_depth(frame: Frame, facts: FrameFacts, pixels: int, config: SegmentConfig) -> None:
    """Refuse an object of so many pixels without any depth reading, or with a median depth that suggests a wrong unit."""
    if not facts.readings and frame.depth.any():
        raise _without_depth(frame, facts.mask, pixels)
    check_distance(facts.median_depth if facts.readings else None, frame, pixels, "object", config)


def _without_depth(frame: Frame, mask: Array, pixels: int) -> InputError:
    """Return the error for an object without any reading: its material's, if the pixels around the object have readings."""
    around = dilate(mask, HOLE_MARGIN_PX) & ~mask
    share = float(np.mean(frame.depth[around] > 0)) if around.any() else 0.0
    sentence = f"no depth at any of the {pixels} pixels of the object"
    if share > MIN_DEPTH_SHARE_AROUND:
        sentence += (
            f", though {share:.0%} of those around it have depth: black and shiny materials return none. Detect it in the color "
            "image (-c image), or record it from another side or in other light"
        )
        return InputError(sentence, code="mask-without-depth")
    return InputError(f"{sentence}: is the depth aligned to the mask, and in metres?", code="mask-without-depth")


def check_extent(spread: Floats, count: int, config: SegmentConfig, is_fused: bool) -> None:
    """Refuse a cloud of so many points without extent, or with one in the wrong unit, by its quantiles at SPREAD, (6, 3) m."""
    least, _, low, high, _, largest = spread
    if not (largest > least).any():
        raise InputError(
            f"the cloud has {count} points and no extent: an object needs points along its length",
            code="cloud-without-extent",
        )
    extent = float(np.linalg.norm(high - low))
    if not config.min_depth / EXTENT_TOLERANCE <= extent <= EXTENT_TOLERANCE * config.max_depth:
        setting = f"max_depth={np.ceil(extent / EXTENT_TOLERANCE):.0f}" if extent > 1 else f"min_depth={extent:.1g}"
        remedy = (
            "points are expected in metres: for millimetres give --input-option depth_scale=1000 (units per metre); if it is "
            f"that {'large' if extent > 1 else 'small'}, --set segment.{setting}"
        )
        if is_fused:
            remedy = "the poses are expected to be camera to world, with translations in metres: are they in millimetres?"
        part = "fused views are" if is_fused else "cloud is"
        raise InputError(f"the {part} {extent:.6g} m across: {remedy}", code="points-unit")

"""Check that a color image is registered to the depth: the edges of the one against those of the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import fft

from .. import Array, Floats, Frame

WORK_WIDTH_PX = 320
"""Width that images are reduced to, px: a shift of a tenth of the width is found in milliseconds."""

MAX_SHIFT_WORK_PX = 20
"""Largest shift that is looked for, in px of the reduced images, each way."""

MIN_SHIFT_WIDTHS = 0.011
"""Least shift that counts, in image widths: 14 px of 1280. Depth edges of stereo cameras lie up to 10 px beside the real ones."""

PRECISION_WIDTHS = 0.003
"""Image widths, 4 px of 1280, within which a shift is known; a smaller part of it, along rows or columns, is not told."""

MIN_DEPTH_JUMP = 0.008
"""Least jump of depth between pixels beside each other that is an edge, as a share of the depth: 6 mm at 0.7 m."""

MAX_EDGE_SHARE = 0.1
"""Share of the pixels that are edges of depth at most: of a noisy image, only the strongest jumps count."""

COLOR_JUMP_RANGE = (10.0, 60.0)
"""Jump of a color channel, 0 to 255, from which an edge begins, and from which on a stronger one counts no more."""

MIN_EDGE_PIXELS = 60
"""Edge pixels of depth from which a frame is judged."""

MIN_CORRELATION = 0.1
"""Correlation of the edges at the best shift, above that of most shifts, from which a frame is judged; measured on 297 frames."""

MIN_GAIN = 1.35
"""Ratio of the correlation at the best shift to that without a shift, from which a shift counts; measured on 297 frames.

Strands side by side correlate with themselves: there the ratio is small, also if the shift is real.
"""


class ColorShift(NamedTuple):
    """The shift of a color image that fits its edges best to the edges of the depth.

    Attributes
    ----------
    right, down
        px by which the color lies right of and below the depth; 0, 0 if the color fits where it is.
    gain
        correlation of the edges at the best shift, in multiples of that where the color is; 1 if it fits.
    """

    right: int
    down: int
    gain: float


def color_shift(frame: Frame) -> ColorShift | None:
    """Return by how much the color of a frame is shifted against its depth; None if too few edges tell.

    The cross-correlation of the two edge images, by FFT, after Canny's idea that real edges coincide in all channels. A shift
    moves all edges the same way. Depth that is wider than the object, as stereo cameras give it, moves the edges on its two sides
    apart: therefore the edges on either side have to fit better, each by themselves.
    """
    if frame.color is None:
        return None
    step = max(1, round(frame.depth.shape[1] / WORK_WIDTH_PX))
    rows, columns = (slice(step // 2, None, step) for _ in range(2))
    depth_edges, slopes = _depth_edges(frame.depth[rows, columns])
    if np.count_nonzero(depth_edges) < MIN_EDGE_PIXELS:
        return None
    color_edges = _color_edges(frame.color[rows, columns])
    table = _correlation(depth_edges, color_edges)
    middle = MAX_SHIFT_WORK_PX
    row, column = np.unravel_index(table.argmax(), table.shape)
    above = float(table[row, column] - np.median(table))
    if above < MIN_CORRELATION:
        return None
    # the edges need not meet to the pixel
    unshifted = float(table[middle - 1 : middle + 2, middle - 1 : middle + 2].max() - np.median(table))
    gain = above / max(unshifted, 0.01 * above)
    right, down = (step * _peak(line, at) for line, at in ((table[row], int(column)), (table[:, column], int(row))))
    if gain < MIN_GAIN or np.hypot(right, down) < MIN_SHIFT_WIDTHS * frame.depth.shape[1]:
        return ColorShift(0, 0, 1.0)
    shift = int(row) - middle, int(column) - middle
    ahead = shift[0] * slopes[0] + shift[1] * slopes[1]
    if not all(_fits_better(np.where(side, depth_edges, 0), color_edges, shift) for side in (ahead > 0, ahead < 0)):
        return ColorShift(0, 0, 1.0)
    return ColorShift(round(right), round(down), round(gain, 2))


def registration_notes(shifts: Sequence[ColorShift], width: int | None = None) -> list[str]:
    """Return a sentence if most of the judged frames agree that their color is shifted against the depth.

    shifts : of the frames that were judged, without None. width : of the images, px, within whose 2 % the frames have to agree.
    """
    shifted = [shift for shift in shifts if shift.right or shift.down]
    if 2 * len(shifted) <= len(shifts):
        return []
    right, down = (int(np.median([getattr(shift, name) for shift in shifted])) for name in ("right", "down"))
    tolerance = max(8.0, 0.02 * (width or 0), 0.25 * np.hypot(right, down))
    agreeing = [shift for shift in shifted if np.hypot(shift.right - right, shift.down - down) <= tolerance]
    if 2 * len(agreeing) <= len(shifts):
        return []
    gain = float(np.median([shift.gain for shift in agreeing]))
    parts = [(right, "to the right", "to the left"), (down, "down", "up")]
    exact = PRECISION_WIDTHS * (width or 0)
    way = " and ".join(f"{abs(size)} px {ahead if size > 0 else back}" for size, ahead, back in parts if abs(size) > exact)
    times = f"{gain:.1f} times as well" if gain < 20 else "only"
    return [
        f"check the registration: the color lies {way} of where the depth has its edges ({times} there as where it is, in "
        f"{len(agreeing)} of {len(shifts)} frames judged): use color that is registered to the depth (aligned by the camera's "
        "driver, such as align_depth), and the intrinsics of that image"
    ]


def _depth_edges(depth: Array) -> tuple[Floats, Floats]:
    """Return how much depth jumps at each pixel between two readings, and in which direction it increases.

    The first is (H, W) float, 0 to 1. The second is (2, H, W) float: the increase down the columns and along the rows, as a share
    of the depth.
    """
    slopes = np.zeros((2, *depth.shape), np.float32)
    for slope, (after, before, between) in zip(slopes, _NEIGHBORS, strict=True):
        near = np.minimum(depth[after], depth[before])
        with np.errstate(divide="ignore", invalid="ignore"):
            slope[between] = np.where(near > 0, (depth[after] - depth[before]) / near, 0)
    edges = np.abs(slopes).max(axis=0)
    sample = edges[::2, 1::2].ravel()
    rank = int((1 - MAX_EDGE_SHARE) * (len(sample) - 1))
    strong = float(np.partition(sample, rank)[rank]) if len(sample) else 0.0
    return np.asarray(np.clip(edges / max(MIN_DEPTH_JUMP, strong) - 1, 0, 1)), slopes


def _color_edges(color: Array) -> Floats:
    """Return (H, W) float: how much the color jumps at each pixel, along rows or columns, 0 to 255 in the strongest channel."""
    values = color.astype(np.float32)
    edges = np.zeros(color.shape[:2], np.float32)
    for after, before, between in _NEIGHBORS:
        jump = np.abs(values[after] - values[before])
        strongest = np.maximum(np.maximum(jump[..., 0], jump[..., 1]), jump[..., 2])
        np.maximum(edges[between], strongest, out=edges[between])
    low, high = COLOR_JUMP_RANGE
    return np.asarray(np.clip(edges - low, 0, high - low))


_INNER, _AFTER, _BEFORE = slice(1, -1), slice(2, None), slice(None, -2)
_ALL = slice(None)
_NEIGHBORS = (((_AFTER, _ALL), (_BEFORE, _ALL), (_INNER, _ALL)), ((_ALL, _AFTER), (_ALL, _BEFORE), (_ALL, _INNER)))


def _correlation(first: Floats, second: Floats) -> Floats:
    """Return the correlation coefficients of two images for all shifts of the second; no shift is in the middle."""
    first, second = first - first.mean(), second - second.mean()
    most = min(MAX_SHIFT_WORK_PX, *first.shape)
    shape = [fft.next_fast_len(size + most, True) for size in first.shape]
    product = np.conj(fft.rfft2(first, shape)) * fft.rfft2(second, shape)
    table = np.roll(fft.irfft2(product, shape), (most, most), (0, 1))[: 2 * most + 1, : 2 * most + 1]
    return np.asarray(table / max(float(np.linalg.norm(first) * np.linalg.norm(second)), 1e-12))


def _fits_better(first: Floats, second: Floats, shift: tuple[int, int]) -> bool:
    """Return whether two images correlate better where the second is shifted by (down, right) px than about where it is."""
    margin = MAX_SHIFT_WORK_PX + 1
    padded = np.pad(second - second.mean(), margin)
    places = [shift, *((down, right) for down in (-1, 0, 1) for right in (-1, 0, 1))]
    (height, width), starts = first.shape, [(margin + down, margin + right) for down, right in places]
    shifted, *unshifted = (float((first * padded[top : top + height, left : left + width]).sum()) for top, left in starts)
    return shifted > max(0.0, *unshifted)


def _peak(line: Floats, at: int) -> float:
    """Return the shift of the maximum of a row or column of the correlation, at `at`, refined by a parabola."""
    shift = 0.0
    if 0 < at < len(line) - 1:
        left, peak, right = (float(value) for value in line[at - 1 : at + 2])
        bend = left - 2 * peak + right
        shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    return at - (len(line) - 1) / 2 + shift

"""Check that a color image is registered to the depth, by comparing the edges of both."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import fft

from .. import Array, Floats, Frame

WORK_WIDTH_PX = 320
"""Width in px to which images are reduced, so that a shift of a tenth of the width is found in milliseconds."""

MAX_SHIFT_WORK_PX = 20
"""Largest shift in each direction that is searched, in px of the reduced images."""

MIN_SHIFT_WIDTHS = 0.011
"""Least shift that is reported, in image widths: 14 px of 1280. Depth edges of stereo cameras are up to 10 px off the real
ones."""

PRECISION_WIDTHS = 0.003
"""Precision of a shift in image widths: 4 px of 1280. A smaller component, along rows or columns, is not reported."""

MIN_DEPTH_JUMP = 0.008
"""Least jump of depth between neighboring pixels that is an edge, as a fraction of the depth: 6 mm at 0.7 m."""

MAX_EDGE_SHARE = 0.1
"""Greatest fraction of pixels that are depth edges; in a noisy image, only the strongest jumps are used."""

COLOR_JUMP_RANGE = (10.0, 60.0)
"""Jump of a color channel, 0 to 255: least value of an edge, and value above which a stronger jump has no more weight."""

MIN_EDGE_PIXELS = 60
"""Least number of depth edge pixels for a frame to be judged."""

MIN_CORRELATION = 0.1
"""Least excess of the edges' correlation at the best shift over that at most shifts, for a frame to be judged; from 297
frames."""

MIN_GAIN = 1.35
"""Least ratio of the correlation at the best shift to that without a shift, for a shift to count; from 297 frames.

Strands side by side correlate with each other, so that the ratio is small there even if the shift is real.
"""


class ColorShift(NamedTuple):
    """The shift of a color image that fits its edges best to the edges of the depth.

    Attributes
    ----------
    right, down
        shift in px of the color to the right of and below the depth; 0, 0 if the color fits without a shift.
    gain
        ratio of the edges' correlation at the best shift to that without a shift; 1 if the color fits.
    """

    right: int
    down: int
    gain: float


def color_shift(frame: Frame) -> ColorShift | None:
    """Return the shift of a frame's color against its depth; None if there are too few edges.

    The shift maximizes the cross-correlation of the two edge images, by FFT, after Canny's idea that real edges coincide in all
    channels. A shift moves all edges the same way. Depth that is wider than the object, as from stereo cameras, moves the edges
    of its two sides apart: therefore the edges of each side must fit better at the shift, separately.
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

    shifts : those of the judged frames, without None. width : width of the images in px; frames must agree within 2 % of it.
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
    """Return the strength of depth edges at each pixel, and the increase of depth there.

    The strength is (H, W) float, 0 to 1. The increase is (2, H, W) float: down the columns and along the rows, as a fraction of
    the depth.
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
    """Return the strength of color edges, (H, W) float: greatest jump along rows or columns in any channel, 0 to 255."""
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
    """Return the correlation coefficients of two images for all shifts of the second; zero shift is in the middle."""
    first, second = first - first.mean(), second - second.mean()
    most = min(MAX_SHIFT_WORK_PX, *first.shape)
    shape = [fft.next_fast_len(size + most, True) for size in first.shape]
    product = np.conj(fft.rfft2(first, shape)) * fft.rfft2(second, shape)
    table = np.roll(fft.irfft2(product, shape), (most, most), (0, 1))[: 2 * most + 1, : 2 * most + 1]
    return np.asarray(table / max(float(np.linalg.norm(first) * np.linalg.norm(second)), 1e-12))


def _fits_better(first: Floats, second: Floats, shift: tuple[int, int]) -> bool:
    """Return whether two images correlate better with the second shifted by (down, right) px than near zero shift."""
    margin = MAX_SHIFT_WORK_PX + 1
    padded = np.pad(second - second.mean(), margin)
    places = [shift, *((down, right) for down in (-1, 0, 1) for right in (-1, 0, 1))]
    (height, width), starts = first.shape, [(margin + down, margin + right) for down, right in places]
    shifted, *unshifted = (float((first * padded[top : top + height, left : left + width]).sum()) for top, left in starts)
    return shifted > max(0.0, *unshifted)


def _peak(line: Floats, at: int) -> float:
    """Return the position of the maximum at index `at` of a row or column of the correlation, refined by a parabola."""
    shift = 0.0
    if 0 < at < len(line) - 1:
        left, peak, right = (float(value) for value in line[at - 1 : at + 2])
        bend = left - 2 * peak + right
        shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    return at - (len(line) - 1) / 2 + shift

"""Inpaint the depth of a mask where color sees the object and the sensor has no reading."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve

from ...facts import FrameFacts
from ...geometry.mask import bounding_box
from ...types import Bools, Floats, Ints
from .depth_filter import Readings

INPAINT_MIN_HOLE_PX = 2
"""px; the mask farther than this from a reading gets depth from the readings around it; smaller holes are closed as voxels."""


def inpaint_readings(readings: Readings, facts: FrameFacts, max_slope: float) -> Readings:
    """Add readings in the holes of the depth: pixels of the mask at which the sensor has no reading.

    Parameters
    ----------
    readings
        the measured readings, without outliers.
    facts
        the mask of the object, with the depth. A pixel whose reading was dropped as an outlier is no hole: it stays as it is.
    max_slope
        m per pixel, the largest depth step between neighboring pixels of one surface.

    Returns
    -------
    The measured and the inpainted readings, in row-major order of their pixels. `depth` and `filtered` of an inpainted reading
    are equal. Holes in which every pixel lies within 2 px of a reading are not filled.
    """
    if not len(readings.pixels) or facts.readings == facts.count:
        return readings
    assert facts.depth is not None
    rows, columns = facts.slices
    corner = np.array((columns.start, rows.start))
    in_box = readings.pixels - corner
    usable = facts.mask[rows, columns] & (facts.depth[rows, columns] <= 0)
    usable[in_box[:, 1], in_box[:, 0]] = True
    holes, inpainted = inpaint_depth(usable, in_box, readings.filtered, INPAINT_MIN_HOLE_PX, max_slope)
    if not len(holes):
        return readings
    pixels = np.concatenate((readings.pixels, holes + corner))
    order = np.lexsort((pixels[:, 0], pixels[:, 1]))
    return Readings(pixels[order], np.append(readings.depth, inpainted)[order], np.append(readings.filtered, inpainted)[order])


def inpaint_depth(mask: Bools, pixels: Ints, depth: Floats, min_hole: int, max_slope: float) -> tuple[Ints, Floats]:
    """Interpolate the depth in the holes of a mask, the pixels without a reading.

    Along a strand the depth is a straight line from reading to reading, and constant beyond the last reading: it solves Laplace's
    equation with the readings at the border of the hole and no flux through the edge of the mask. Pixels where the inpainted
    depth changes by more than `max_slope` lie between two strands and are left out.

    Parameters
    ----------
    mask
        (H, W) bool, the pixels of the object.
    pixels
        (N, 2) int64, the pixels (u, v) of the N readings.
    depth
        (N,) m, the readings.
    min_hole
        px; only holes with pixels farther than this (in rows or columns) from every reading are filled.
    max_slope
        m per pixel, the largest depth step between neighboring pixels of one surface.

    Returns
    -------
    pixels : (Q, 2) int64 (u, v), the Q inpainted pixels, without those that have a reading; Q = 0 if nothing was filled.
    depth : (Q,) m, the depth of each inpainted pixel.
    """
    if not len(pixels) or len(pixels) == np.count_nonzero(mask):
        return np.zeros((0, 2), dtype=np.int64), np.zeros(0)
    rows, columns = bounding_box(mask)
    part = np.pad(mask[rows, columns], 1)
    v, u = pixels[:, 1] - rows.start + 1, pixels[:, 0] - columns.start + 1
    has_reading = np.zeros(part.shape, dtype=bool)
    has_reading[v, u] = True
    hole = _holes(part, has_reading, min_hole)
    if not hole.any():
        return np.zeros((0, 2), dtype=np.int64), np.zeros(0)
    measured = np.zeros(part.shape)
    measured[v, u] = depth
    hole_pixels, inpainted = _solve_laplace(np.flatnonzero(hole), measured.ravel(), part.shape[1], max_slope)
    row, column = np.divmod(hole_pixels, part.shape[1])
    return np.column_stack((column + columns.start - 1, row + rows.start - 1)), inpainted


def _holes(mask: Bools, has_reading: Bools, min_hole: int) -> Bools:
    """Return the pixels (H, W) without a reading around those that are farther than `min_hole` px from any."""
    square = np.ones((2 * min_hole + 1, 2 * min_hole + 1), np.uint8)
    far = np.asarray(mask & (cv2.dilate(has_reading.view(np.uint8), square) == 0))
    if not far.any():
        return far
    return np.asarray(mask & ~has_reading & (cv2.dilate(far.view(np.uint8), square) > 0))


def _solve_laplace(pixels: Ints, measured: Floats, width: int, max_slope: float) -> tuple[Ints, Floats]:
    """Return the pixels of holes whose depth could be inpainted, and that depth.

    The depth of each pixel is the mean of its neighbors that are in a hole or measured; the linear system is sparse, one equation
    per pixel. Holes without a reading beside them, and pixels at which the result is steep, are left out.

    Parameters
    ----------
    pixels
        (K,) int, row-major indices of the pixels in holes, ascending, none at the border of the image.
    measured
        (H * W,) m, the readings in row-major order; 0 = none.
    width
        px, of the image.
    max_slope
        m per pixel, the largest step to a neighboring pixel.
    """
    pixels, neighbor, value = _with_reading_beside(pixels, measured, width)
    count, inside = len(pixels), neighbor >= 0
    if not count:
        return pixels, np.zeros(0)
    degree = (inside | (value > 0)).sum(axis=1)
    i = np.concatenate((np.nonzero(inside)[0], np.arange(count)))
    j = np.concatenate((neighbor[inside], np.arange(count)))
    entries = np.concatenate((np.full(len(i) - count, -1.0), degree))
    depth = np.asarray(spsolve(csr_matrix((entries, (i, j)), (count, count)).tocsc(), value.sum(axis=1)))
    beside = np.where(inside, depth[neighbor], value)
    slope = np.where(beside > 0, np.abs(beside - depth[:, None]), 0.0).max(axis=1)
    kept = (depth > 0) & (slope <= max_slope)
    return pixels[kept], depth[kept]


def _with_reading_beside(pixels: Ints, measured: Floats, width: int) -> tuple[Ints, Ints, Floats]:
    """Return the pixels of the holes with a reading beside them, and for each pixel its four neighbors.

    Returns
    -------
    pixels : (K,) int. neighbor : (K, 4) int, index in `pixels` of the neighbors in the hole, -1 = not in it. value : (K, 4) m,
    the readings at the neighbors, 0 = none.
    """
    beside = pixels[:, None] - np.array((1, width, -1, -width))
    found = np.minimum(np.searchsorted(pixels, beside), len(pixels) - 1)
    inside, value = pixels[found] == beside, measured[beside]
    graph = csr_matrix((np.ones(np.count_nonzero(inside)), (np.nonzero(inside)[0], found[inside])), (len(pixels), len(pixels)))
    label = connected_components(graph, directed=False)[1]
    kept = (np.bincount(label, weights=(value > 0).any(axis=1)) > 0)[label]
    number = np.cumsum(kept) - 1
    return pixels[kept], np.where(inside, number[found], -1)[kept], value[kept]

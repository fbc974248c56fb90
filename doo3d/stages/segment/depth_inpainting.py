"""Inpaint the depth of a mask where color sees the object and the sensor has no reading."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import spsolve

from ...geometry.mask import bounding_box
from ...types import Array, Bools, Floats, Ints
from .depth_filter import Readings

FOUR_NEIGHBORS = ((0, 1), (1, 0), (0, -1), (-1, 0))

INPAINT_MIN_HOLE_PX = 2
"""px; the mask farther than this from a reading gets depth from the readings around it; smaller holes are closed as voxels."""


def inpaint_readings(readings: Readings, mask: Bools, depth: Array, max_slope: float) -> Readings:
    """Add readings in the holes of the depth: pixels of the mask at which the sensor has no reading.

    Parameters
    ----------
    readings
        the measured readings, without outliers.
    mask
        (H, W) bool, the pixels of the object.
    depth
        (H, W) m, 0 = no reading. A pixel whose reading was dropped as an outlier is no hole and stays without depth.
    max_slope
        m per pixel, the largest depth step between neighboring pixels of one surface.

    Returns
    -------
    The measured and the inpainted readings, in row-major order of their pixels. `depth` and `filtered` of an inpainted reading
    are equal. Holes in which every pixel lies within 2 px of a reading are not filled.
    """
    if not len(readings.pixels):
        return readings
    rows, columns = bounding_box(mask)
    corner = np.array((columns.start, rows.start))
    in_box = readings.pixels - corner
    usable = mask[rows, columns] & (depth[rows, columns] <= 0)
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
    inpainted = _solve_laplace(hole, measured)
    slope = _max_slope(np.where(inpainted > 0, inpainted, measured), part)
    row, column = np.nonzero((inpainted > 0) & (slope <= max_slope))
    return np.column_stack((column + columns.start - 1, row + rows.start - 1)), inpainted[row, column]


def _holes(mask: Bools, has_reading: Bools, min_hole: int) -> Bools:
    """Return the pixels (H, W) without a reading around those that are farther than `min_hole` px from any."""
    square = np.ones((2 * min_hole + 1, 2 * min_hole + 1), np.uint8)
    far = np.asarray(mask & (cv2.dilate(has_reading.view(np.uint8), square) == 0))
    if not far.any():
        return far
    return np.asarray(mask & ~has_reading & (cv2.dilate(far.view(np.uint8), square) > 0))


def _max_slope(depth: Array, mask: Bools) -> Array:
    """Return the largest depth step, (H, W) m, to any of the four neighbors of a pixel that have depth."""
    slope = np.zeros(depth.shape)
    for shift in FOUR_NEIGHBORS:
        neighbor = np.roll(depth, shift, (0, 1))
        slope = np.maximum(slope, np.where((neighbor > 0) & mask, np.abs(neighbor - depth), 0.0))
    return slope


def _solve_laplace(hole: Bools, measured: Array) -> Array:
    """Return the depth (H, W) m in the holes: the mean of each pixel's neighbors that are in the hole or measured.

    It is 0 elsewhere, and in holes without a reading beside them. The linear system is sparse, one equation per pixel.

    hole : (H, W) bool, False along the border. measured : (H, W) m, 0 = none.
    """
    count, label = cv2.connectedComponents(hole.view(np.uint8), connectivity=4)
    has_reading = np.zeros(count, dtype=bool)
    for shift in FOUR_NEIGHBORS:
        has_reading[label[hole & (np.roll(measured, shift, (0, 1)) > 0)]] = True
    hole = hole & has_reading[label]
    unknown = np.full(hole.shape, -1)
    unknown[hole] = np.arange(np.count_nonzero(hole))
    row, column, right, degree = [], [], np.zeros(unknown.max() + 1), np.zeros(unknown.max() + 1)
    for shift in FOUR_NEIGHBORS:
        neighbor, value = np.roll(unknown, shift, (0, 1))[hole], np.roll(measured, shift, (0, 1))[hole]
        inside = neighbor >= 0
        row.append(np.flatnonzero(inside))
        column.append(neighbor[inside])
        right += value
        degree += inside | (value > 0)
    i = np.concatenate((*row, np.arange(len(right))))
    j = np.concatenate((*column, np.arange(len(right))))
    value = np.concatenate((np.full(len(i) - len(right), -1.0), degree))
    result = np.zeros(hole.shape)
    if len(right):
        result[hole] = spsolve(csr_matrix((value, (i, j)), (len(right), len(right))).tocsc(), right)
    return result

"""Depth where colour sees the object and the sensor has no reading, from what the object's readings round it say."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import spsolve

from ...geometry.mask import bounding_box
from ...types import Array, Bools, Floats, Ints

BESIDE = ((0, 1), (1, 0), (0, -1), (-1, 0))


def bridged(mask: Bools, pixels: Ints, depth: Floats, wide: int, steep: float) -> tuple[Ints, Floats]:
    """Pixels (Q, 2) of holes in the depth of a mask (H, W), and the depth there, (Q,) m.

    The depth of a hole is harmonic: Laplace's equation, with the readings at its border and no flux through the edge of the mask.
    Along a strand that is the straight line from reading to reading, and level beyond the last one. Where it changes by more
    than `steep` m per pixel the hole lies between two strands, and has none.

    pixels : (N, 2), where the readings are. depth : (N,) m. wide : px; what is no farther than this from a reading is no hole.
    """
    none = np.zeros((0, 2), dtype=np.int64), np.zeros(0)
    if not len(pixels) or len(pixels) == np.count_nonzero(mask):
        return none
    rows, columns = bounding_box(mask)
    part = np.pad(mask[rows, columns], 1)
    v, u = pixels[:, 1] - rows.start + 1, pixels[:, 0] - columns.start + 1
    known = np.zeros(part.shape)
    known[v, u] = depth
    square = np.ones((2 * wide + 1, 2 * wide + 1), np.uint8)
    far = part & (cv2.dilate((known > 0).view(np.uint8), square) == 0)
    hole = part & (known == 0) & (cv2.dilate(far.view(np.uint8), square) > 0)
    if not hole.any():
        return none
    filled = _harmonic(hole, known)
    some = np.where(filled > 0, filled, known)
    slope = np.zeros(part.shape)
    for dv, du in BESIDE:
        other = np.roll(some, (dv, du), (0, 1))
        slope = np.maximum(slope, np.where((other > 0) & part, np.abs(other - some), 0.0))
    row, column = np.nonzero((filled > 0) & (slope <= steep))
    return np.column_stack((column + columns.start - 1, row + rows.start - 1)), filled[row, column]


def _harmonic(hole: Bools, known: Array) -> Array:
    """(H, W): in a hole the mean of its neighbours that are in it or known; 0 elsewhere, and in holes without a reading beside.

    hole : (H, W) bool, False along the border. known : (H, W), 0 = unknown.
    """
    count, label = cv2.connectedComponents(hole.view(np.uint8), connectivity=4)
    touched = np.zeros(count, dtype=bool)
    for shift in BESIDE:
        touched[label[hole & (np.roll(known, shift, (0, 1)) > 0)]] = True
    hole = hole & touched[label]
    number = np.full(hole.shape, -1)
    number[hole] = np.arange(np.count_nonzero(hole))
    row, column, right, degree = [], [], np.zeros(number.max() + 1), np.zeros(number.max() + 1)
    for shift in BESIDE:
        near, value = np.roll(number, shift, (0, 1))[hole], np.roll(known, shift, (0, 1))[hole]
        inside = near >= 0
        row.append(np.flatnonzero(inside))
        column.append(near[inside])
        right += value
        degree += inside | (value > 0)
    i = np.concatenate((*row, np.arange(len(right))))
    j = np.concatenate((*column, np.arange(len(right))))
    value = np.concatenate((np.full(len(i) - len(right), -1.0), degree))
    result = np.zeros(hole.shape)
    if len(right):
        result[hole] = spsolve(csr_matrix((value, (i, j)), (len(right), len(right))).tocsc(), right)
    return result

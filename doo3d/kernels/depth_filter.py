"""Depth readings compared with their neighbors in the image."""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True)
def count_agreeing_neighbors(depth, mask, rows, columns, half_width, slope):  # type: ignore[no-untyped-def]
    """Count the neighbors of each depth reading that agree with it, and average them.

    A neighbor agrees if it differs by less than `slope` times its distance in pixels (the longer of the two sides).

    Parameters
    ----------
    depth
        (H, W) float32 m, 0 = none
    mask
        (H, W) bool, the pixels whose readings are compared
    rows, columns
        (N,) int64, the pixels of the readings
    half_width
        px, the window has 2 half_width + 1 rows and columns
    slope
        m per pixel

    Returns
    -------
    support : (N,) int64, neighbors that agree
    neighbors : (N,) int64, neighbors in the mask with a reading
    mean : (N,) float64 m, of the reading and the neighbors that agree
    """
    height, width = depth.shape
    support = np.zeros(rows.size, np.int64)
    neighbors = np.zeros(rows.size, np.int64)
    mean = np.zeros(rows.size, np.float64)
    for i in range(rows.size):
        center = depth[rows[i], columns[i]]
        total = np.float64(center)
        for row in range(max(rows[i] - half_width, 0), min(rows[i] + half_width + 1, height)):
            for column in range(max(columns[i] - half_width, 0), min(columns[i] + half_width + 1, width)):
                z = depth[row, column]
                distance = max(abs(row - rows[i]), abs(column - columns[i]))
                if distance > 0 and z > 0 and mask[row, column]:
                    neighbors[i] += 1
                    if abs(z - center) < slope * distance:
                        support[i] += 1
                        total += z
        mean[i] = total / (support[i] + 1)
    return support, neighbors, mean


@numba.njit(cache=True)
def sigma_filter(depth, mask, rows, columns, half_width, max_difference):  # type: ignore[no-untyped-def]
    """Average each depth reading with the neighbors of similar depth (sigma filter: Lee, CVGIP 24, 1983).

    Parameters
    ----------
    depth
        (H, W) float32 m, 0 = none
    mask
        (H, W) bool, the pixels whose readings are averaged; holds the readings themselves
    rows, columns
        (N,) int64, the pixels of the readings
    half_width
        px, the window has 2 half_width + 1 rows and columns
    max_difference
        m, neighbors that differ by as much or more are left out

    Returns
    -------
    (N,) float64 m
    """
    height, width = depth.shape
    mean = np.zeros(rows.size, np.float64)
    for i in range(rows.size):
        center, total, count = depth[rows[i], columns[i]], 0.0, 0
        for row in range(max(rows[i] - half_width, 0), min(rows[i] + half_width + 1, height)):
            for column in range(max(columns[i] - half_width, 0), min(columns[i] + half_width + 1, width)):
                z = depth[row, column]
                if mask[row, column] and z > 0 and abs(z - center) < max_difference:
                    total += z
                    count += 1
        mean[i] = total / count
    return mean

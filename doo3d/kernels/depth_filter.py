"""What the neighbours of a depth reading say about it."""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True)
def count_agreeing_neighbors(depth, mask, v, u, half, tolerance):  # type: ignore[no-untyped-def]
    """How many neighbours of each reading agree with it, of how many, and the mean of it and those that do.

    depth : (H, W) float32 m, 0 = none. mask : (H, W) bool, where neighbours may be. v, u : (N,) int64, the readings.
    half : px, the window is 2 half + 1 wide. tolerance : m per pixel of distance by which neighbours may differ.
    Returns (N,) int64, (N,) int64 and (N,) float64 m.
    """
    height, width = depth.shape
    support = np.zeros(v.size, np.int64)
    among = np.zeros(v.size, np.int64)
    mean = np.zeros(v.size, np.float64)
    for i in range(v.size):
        here = depth[v[i], u[i]]
        total = np.float64(here)
        for row in range(max(v[i] - half, 0), min(v[i] + half + 1, height)):
            for column in range(max(u[i] - half, 0), min(u[i] + half + 1, width)):
                z = depth[row, column]
                apart = max(abs(row - v[i]), abs(column - u[i]))
                if apart > 0 and z > 0 and mask[row, column]:
                    among[i] += 1
                    if abs(z - here) < tolerance * apart:
                        support[i] += 1
                        total += z
        mean[i] = total / (support[i] + 1)
    return support, among, mean


@numba.njit(cache=True)
def sigma_filter(depth, mask, v, u, half, tolerance):  # type: ignore[no-untyped-def]
    """The mean of each reading and those about it that differ by less than `tolerance` m: (N,) float64 m.

    depth, mask, v, u, half : as for `agreement`.
    """
    height, width = depth.shape
    mean = np.zeros(v.size, np.float64)
    for i in range(v.size):
        here, total, count = depth[v[i], u[i]], 0.0, 0
        for row in range(max(v[i] - half, 0), min(v[i] + half + 1, height)):
            for column in range(max(u[i] - half, 0), min(u[i] + half + 1, width)):
                z = depth[row, column]
                if mask[row, column] and z > 0 and abs(z - here) < tolerance:
                    total += z
                    count += 1
        mean[i] = total / count
    return mean

"""Where the ends of chains are heading."""

from __future__ import annotations

import math

import numba
import numpy as np


@numba.njit(cache=True)
def end_tangents(joints, bounds, reach):  # type: ignore[no-untyped-def]
    """Where either end of every chain is heading: the outward direction, and the curvature, which is square to it.

    Of a parabola (a line, from fewer than four joints) fitted over `reach` of it: a line over a length of a curve of radius R
    lags behind its end by length / 2R. It is fitted in polynomials that are orthogonal over the joints: t less its mean, and the
    square of that less what the former and 1 have of it; t is the arc length, 0 at the end.

    joints : (N, D) float64 of all chains. bounds : (C + 1,) int64, where each chain's begin. reach : m (px in 2-D).
    Returns (2 C, D) unit and (2 C, D) 1/m, the first end of each chain and then its last.
    """
    dim = joints.shape[1]
    direction = np.zeros((2 * len(bounds) - 2, dim))
    curvature = np.zeros(direction.shape)
    along = np.empty(len(joints))
    slope, bend = np.empty(dim), np.empty(dim)
    for end in range(len(direction)):
        size = bounds[end // 2 + 1] - bounds[end // 2]
        tip, way = (bounds[end // 2], 1) if end % 2 == 0 else (bounds[end // 2 + 1] - 1, -1)
        count, mean = 1, 0.0
        along[0] = 0.0
        while count < size:
            step = 0.0
            for d in range(dim):
                step += (joints[tip + way * count, d] - joints[tip + way * (count - 1), d]) ** 2
            back = math.sqrt(step) - along[count - 1]
            if count > 1 and back > max(reach, -along[1]) * (1 + 1e-9):
                break
            along[count] = -back
            mean -= back
            count += 1
        mean /= count
        second, third, square = 0.0, 0.0, 0.0
        for i in range(count):
            along[i] -= mean
            second += along[i] ** 2
            third += along[i] ** 3
        for i in range(count):
            square += (along[i] ** 2 - second / count - third / second * along[i]) ** 2
        norm, outward = 0.0, 0.0
        for d in range(dim):
            slope[d] = bend[d] = 0.0
            for i in range(count):
                place = joints[tip + way * i, d] - joints[tip, d]
                slope[d] += along[i] * place / second
                if count > 3:
                    bend[d] += (along[i] ** 2 - second / count - third / second * along[i]) * place / square
            slope[d] -= bend[d] * (2 * mean + third / second)
            norm += slope[d] ** 2
        for d in range(dim):
            direction[end, d] = slope[d] / math.sqrt(norm) if norm > 0 else 0.0
            outward += 2 * bend[d] * direction[end, d]
        for d in range(dim):
            curvature[end, d] = 2 * bend[d] - outward * direction[end, d]
    return direction, curvature

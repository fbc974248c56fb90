"""Equal steps along a curve."""

from __future__ import annotations

import math

import numba
import numpy as np


@numba.njit(cache=True)
def walk(points, length):  # type: ignore[no-untyped-def]
    """Lay chords of exactly `length` along a polyline, the first from its first point.

    A chord ends where the polyline first leaves the sphere of that radius about its start, and is put on it exactly.
    points : (P, D) float64. Returns (N + 1, D) joints, and (N + 1,) the arc length at which each lies.
    """
    count, dim = points.shape
    total = 0.0
    for i in range(1, count):
        total += math.sqrt(np.sum((points[i] - points[i - 1]) ** 2))
    joints = np.empty((int(total / length) + 2, dim))
    at = np.zeros(joints.shape[0])
    joints[0] = points[0]
    size, i = 1, 1
    before = 0.0  # arc length of the vertex before points[i]
    here = points[0].copy()
    while i < count:
        start = joints[size - 1]
        away, along, half, inside = 0.0, 0.0, 0.0, length * length
        for d in range(dim):
            offset, step = here[d] - start[d], points[i, d] - here[d]
            away += (points[i, d] - start[d]) ** 2
            along += step * step
            half += step * offset
            inside -= offset * offset
        if math.sqrt(away) < length:
            before += math.sqrt(np.sum((points[i] - points[i - 1]) ** 2))
            here[:] = points[i]
            i += 1
            continue
        part = min(1.0, (math.sqrt(half * half + along * max(inside, 0.0)) - half) / along)
        norm = 0.0
        for d in range(dim):
            here[d] += part * (points[i, d] - here[d])
            norm += (here[d] - start[d]) ** 2
        for d in range(dim):
            joints[size, d] = start[d] + (here[d] - start[d]) * length / math.sqrt(norm)
        here[:] = joints[size]
        at[size] = before + math.sqrt(np.sum((here - points[i - 1]) ** 2))
        size += 1
    return joints[:size], at[:size]

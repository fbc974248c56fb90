"""Tangents and curvatures at the ends of chains."""

from __future__ import annotations

import math

import numba
import numpy as np

from ._jit import inlined


@inlined
def _lengths_to_end(joints, last, inward, size, window, t):  # type: ignore[no-untyped-def]
    """Fill t with the arc lengths of the joints within `window` of an end, 0 there and falling inwards.

    last : the joint at the end. inward : 1 or -1, the step to the joint before it. size : joints of the chain. At least two
    joints are taken. Returns their number and the mean of t.
    """
    count, mean = 1, 0.0
    t[0] = 0.0
    while count < size:
        square = 0.0
        for d in range(joints.shape[1]):
            square += (joints[last + inward * count, d] - joints[last + inward * (count - 1), d]) ** 2
        length = math.sqrt(square) - t[count - 1]
        if count > 1 and length > max(window, -t[1]) * (1 + 1e-9):
            break
        t[count] = -length
        mean -= length
        count += 1
    return count, mean / count


@inlined
def _center(t, count, mean):  # type: ignore[no-untyped-def]
    """Subtract the mean from the first `count` of t; return the sums of t^2, of t^3 and of the quadratic polynomial squared."""
    second, third, quadratic = 0.0, 0.0, 0.0
    for i in range(count):
        t[i] -= mean
        second += t[i] ** 2
        third += t[i] ** 3
    for i in range(count):
        quadratic += (t[i] ** 2 - second / count - third / second * t[i]) ** 2
    return second, third, quadratic


@inlined
def _fit_parabola(joints, last, inward, t, count, mean, first, second):  # type: ignore[no-untyped-def]
    """Fit the joints near an end: first and second (D,) become the derivative there and half the second derivative."""
    moment2, moment3, quadratic = _center(t, count, mean)
    for d in range(joints.shape[1]):
        first[d] = second[d] = 0.0
        for i in range(count):
            offset = joints[last + inward * i, d] - joints[last, d]
            first[d] += t[i] * offset / moment2
            if count > 3:
                second[d] += (t[i] ** 2 - moment2 / count - moment3 / moment2 * t[i]) * offset / quadratic
        first[d] -= second[d] * (2 * mean + moment3 / moment2)


@numba.njit(cache=True)
def end_tangents(joints, bounds, window):  # type: ignore[no-untyped-def]
    """Return the outward tangent and the curvature vector at both ends of every chain.

    They are those of a parabola over arc length, fitted by least squares to the joints within `window` of the end (a line, for
    fewer than four joints): a line over a length of a curve of radius R lags behind its end by length / 2R. The fit is in
    polynomials orthogonal over the joints, which needs no system of equations: with t the arc length, 0 at the end, they are 1,
    t less its mean, and the square of that less its projections on the former two.

    Parameters
    ----------
    joints
        (J, D) float64, of all chains one after the other; each has at least two
    bounds
        (C + 1,) int64, where each chain begins in `joints`
    window
        the length of chain that is fitted, in the unit of the joints

    Returns
    -------
    tangents : (2 C, D) float64 unit vectors out of the chain, the first end of each chain and then its last
    curvatures : (2 C, D) float64, one over the unit of the joints, square to the tangents
    """
    dim = joints.shape[1]
    tangents = np.zeros((2 * len(bounds) - 2, dim))
    curvatures = np.zeros(tangents.shape)
    t = np.empty(len(joints))
    first, second = np.empty(dim), np.empty(dim)
    for end in range(len(tangents)):
        size = bounds[end // 2 + 1] - bounds[end // 2]
        last, inward = (bounds[end // 2], 1) if end % 2 == 0 else (bounds[end // 2 + 1] - 1, -1)
        count, mean = _lengths_to_end(joints, last, inward, size, window, t)
        _fit_parabola(joints, last, inward, t, count, mean, first, second)
        norm, outward = 0.0, 0.0
        for d in range(dim):
            norm += first[d] ** 2
        for d in range(dim):
            tangents[end, d] = first[d] / math.sqrt(norm) if norm > 0 else 0.0
            outward += 2 * second[d] * tangents[end, d]
        for d in range(dim):
            curvatures[end, d] = 2 * second[d] - outward * tangents[end, d]
    return tangents, curvatures

"""What it costs at least to do without one connection of a matching: up to three connections are exchanged for others.

More than three are not tried. On 100 connections of rendered tangles, knots, several, crossing and occluded cables 96 values
are those of the best matching with the connection forbidden; 4, all in one tangle, are up to 0.36 of `most` higher. To match
anew for each connection takes 10 to 20 times as long on tangles (0.5 to 1.1 ms a frame against 0.05 ms), and minutes where the
cost has no limit and rings are forbidden: then it is as hard as the travelling salesman's problem.

full : (E, E) float64, cost of joining any two ends. partner : (E,) int64, what each end is joined to, -1 for nothing. most : cost
of leaving two ends free. spare : (E,) int64, the free end that each end would be joined to at the least cost, -1 where none is
worth it. settled : (E,) float64, what it costs to leave what an end is joined to, or that it is free, for something else.
"""

from __future__ import annotations

import numba
import numpy as np

_inner = numba.njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)


@_inner
def _rises(full, partner, most, settled, a, b, rise):  # type: ignore[no-untyped-def]
    """Into (E + 1, E + 1): the least by which the total rises when a goes to end c and b to end d instead; the last is none."""
    count = len(full)
    for c in range(count + 1):
        for d in range(count + 1):
            if (c == d and c < count) or c == a or c == b or d == a or d == b:
                rise[c, d] = np.inf
                continue
            first = full[a, c] + settled[c] if c < count else most / 2
            second = full[b, d] + settled[d] if d < count else most / 2
            rise[c, d] = first + second - full[a, b]
            if c == count or d == count or partner[c] < 0 or partner[d] < 0:
                continue
            e, f = partner[c], partner[d]
            if d == e:
                rise[c, d] = full[a, c] + full[b, d] - full[c, d] - full[a, b]
            else:
                apart = settled[c] + full[c, e] + settled[d] + full[d, f]
                rise[c, d] += min(full[e, f] - apart, 0.0)


@_inner
def _exchange(full, partner, most, spare, ends, made, gone):  # type: ignore[no-untyped-def]
    """What an exchange costs: a goes to c and b to d, -1 being none, and what those were joined to elsewhere.

    ends : (4,) int64, a, b, c, d. Into made (4, 2) go the connections made, into gone (6,) the ends whose connections go.
    Returns the rise of the total and how many there are of either.
    """
    left = np.empty(2, np.int64)
    size, lefts, lost = 0, 0, 2
    gone[0], gone[1] = ends[0], ends[1]
    before = full[ends[0], ends[1]]
    low, high = min(ends[2], ends[3]), max(ends[2], ends[3])
    for k in range(2):
        if ends[2 + k] >= 0:
            made[size, 0], made[size, 1] = ends[k], ends[2 + k]
            size += 1
    for end in (low, high):
        if end < 0 or partner[end] < 0 or (end == high and partner[end] == low):
            continue
        other = partner[end]
        before += full[end, other]
        gone[lost], gone[lost + 1] = end, other
        lost += 2
        if other != high:
            left[lefts] = other
            lefts += 1
    if lefts == 2 and full[left[0], left[1]] < most:
        made[size, 0], made[size, 1] = left[0], left[1]
        size += 1
    else:
        for k in range(lefts):
            end, taken = spare[left[k]], False
            for m in range(size):
                taken = taken or made[m, 1] == end
            if end >= 0 and not taken:
                made[size, 0], made[size, 1] = left[k], end
                size += 1
    after = 0.0
    for m in range(size):
        after += full[made[m, 0], made[m, 1]]
    return after - before + (lost - 2 * size) * most / 2, size, lost


@_inner
def _closes(partner, made, size, gone, lost):  # type: ignore[no-untyped-def]
    """Whether an exchange closes a ring."""
    now = partner.copy()
    for k in range(lost):
        now[gone[k]] = -1
    for m in range(size):
        now[made[m, 0]], now[made[m, 1]] = made[m, 1], made[m, 0]
    for m in range(size):
        end = made[m, 0] ^ 1
        while now[end] >= 0 and now[end] != made[m, 0]:
            end = now[end] ^ 1
        if now[end] >= 0:
            return True
    return False


@_inner
def _lowest(row):  # type: ignore[no-untyped-def]
    lowest = 0
    for k in range(len(row)):
        if row[k] < row[lowest]:
            lowest = k
    return lowest


@numba.njit(cache=True)
def second_best_rise(full, partner, most, spare, settled, pairs, rings):  # type: ignore[no-untyped-def]
    """The least rise of the total without each of the connections (K, 2) int64, at most that of leaving its ends free: (K,)."""
    count = len(full)
    rise, column, low = np.empty((count + 1, count + 1)), np.empty(count + 1, np.int64), np.empty(count + 1)
    found = np.empty(len(pairs))
    ends, made, gone = np.empty(4, np.int64), np.empty((4, 2), np.int64), np.empty(6, np.int64)
    for k in range(len(pairs)):
        ends[0], ends[1] = pairs[k, 0], pairs[k, 1]
        found[k] = most - full[ends[0], ends[1]]
        _rises(full, partner, most, settled, ends[0], ends[1], rise)
        for c in range(count + 1):
            column[c] = _lowest(rise[c])
            low[c] = rise[c, column[c]]
        while True:
            c = _lowest(low)
            d = column[c]
            if not low[c] < found[k]:
                break
            rise[c, d] = np.inf
            column[c] = _lowest(rise[c])
            low[c] = rise[c, column[c]]
            ends[2], ends[3] = c if c < count else -1, d if d < count else -1
            value, size, lost = _exchange(full, partner, most, spare, ends, made, gone)
            if value < found[k] and (rings or not _closes(partner, made, size, gone, lost)):
                found[k] = value
    return found

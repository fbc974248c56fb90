"""Cost of doing without one connection of a matching: up to three connections are exchanged for others.

More than three are not tried. On 100 connections of rendered tangles, knots, several, crossing and occluded cables 96 values
are those of the best matching with the connection forbidden; 4, all in one tangle, are up to 0.36 of `free_cost` higher. To match
anew for each connection takes 10 to 20 times as long on tangles (0.5 to 1.1 ms a frame against 0.05 ms), and minutes where the
cost has no limit and closed chains are forbidden: then it is as hard as the travelling salesman's problem.

The arrays have the same names in all functions:

cost : (E, E) float64, of joining any two ends; infinite where they may not be joined
partner : (E,) int64, the end that each is joined to, -1 for none
free_cost : of leaving two ends free
free_partner : (E,) int64, the free end that each end would be joined to at the least cost, -1 where none is worth it
release : (E,) float64, the rise of the total when an end leaves its partner, or stops being free, for another connection
"""

from __future__ import annotations

import numba
import numpy as np

from ._jit import helper


@helper
def _bound_rises(cost, partner, free_cost, release, a, b, rise):  # type: ignore[no-untyped-def]
    """Fill rise (E + 1, E + 1) with lower bounds: of the total's rise when a goes to end c and b to end d; E stands for none."""
    count = len(cost)
    for c in range(count + 1):
        for d in range(count + 1):
            if (c == d and c < count) or c == a or c == b or d == a or d == b:
                rise[c, d] = np.inf
                continue
            first = cost[a, c] + release[c] if c < count else free_cost / 2
            second = cost[b, d] + release[d] if d < count else free_cost / 2
            rise[c, d] = first + second - cost[a, b]
            if c == count or d == count or partner[c] < 0 or partner[d] < 0:
                continue
            e, f = partner[c], partner[d]
            if d == e:
                rise[c, d] = cost[a, c] + cost[b, d] - cost[c, d] - cost[a, b]
            else:
                apart = release[c] + cost[c, e] + release[d] + cost[d, f]
                rise[c, d] += min(cost[e, f] - apart, 0.0)


@helper
def _release_partners(cost, partner, low, high, before, removed, widowed):  # type: ignore[no-untyped-def]
    """Remove the connections of two ends, -1 for none, that a and b are joined to instead.

    Appends the ends of the connections to `removed`, and fills in the ends that lost their partner. Returns the cost of all
    removed connections and the sizes of both lists.
    """
    removals, widows = 2, 0
    for end in (low, high):
        if end < 0 or partner[end] < 0 or (end == high and partner[end] == low):
            continue
        other = partner[end]
        before += cost[end, other]
        removed[removals], removed[removals + 1] = end, other
        removals += 2
        if other != high:
            widowed[widows] = other
            widows += 1
    return before, removals, widows


@helper
def _join_widowed(cost, free_cost, free_partner, widowed, widows, made, size):  # type: ignore[no-untyped-def]
    """Join the ends that lost their partner to each other, or each to its best free end; return the number of connections."""
    if widows == 2 and cost[widowed[0], widowed[1]] < free_cost:
        made[size, 0], made[size, 1] = widowed[0], widowed[1]
        return size + 1
    for k in range(widows):
        end, used = free_partner[widowed[k]], False
        for m in range(size):
            used = used or made[m, 1] == end
        if end >= 0 and not used:
            made[size, 0], made[size, 1] = widowed[k], end
            size += 1
    return size


@helper
def _exchange(cost, partner, free_cost, free_partner, ends, made, removed):  # type: ignore[no-untyped-def]
    """Return the rise of the total when a goes to c and b to d, -1 for none, and their former partners elsewhere.

    ends : (4,) int64, a, b, c, d. Fills made (4, 2) with the new connections and removed (6,) with the ends of the old ones;
    returns their numbers, too.
    """
    widowed = np.empty(2, np.int64)
    size = 0
    removed[0], removed[1] = ends[0], ends[1]
    for k in range(2):
        if ends[2 + k] >= 0:
            made[size, 0], made[size, 1] = ends[k], ends[2 + k]
            size += 1
    low, high = min(ends[2], ends[3]), max(ends[2], ends[3])
    before, removals, widows = _release_partners(cost, partner, low, high, cost[ends[0], ends[1]], removed, widowed)
    size = _join_widowed(cost, free_cost, free_partner, widowed, widows, made, size)
    after = 0.0
    for m in range(size):
        after += cost[made[m, 0], made[m, 1]]
    return after - before + (removals - 2 * size) * free_cost / 2, size, removals


@helper
def _closes_chain(partner, made, size, removed, removals):  # type: ignore[no-untyped-def]
    """Return whether an exchange makes a closed chain. The ends of one chain are 2 k and 2 k + 1."""
    new_partner = partner.copy()
    for k in range(removals):
        new_partner[removed[k]] = -1
    for m in range(size):
        new_partner[made[m, 0]], new_partner[made[m, 1]] = made[m, 1], made[m, 0]
    for m in range(size):
        end = made[m, 0] ^ 1
        while new_partner[end] >= 0 and new_partner[end] != made[m, 0]:
            end = new_partner[end] ^ 1
        if new_partner[end] >= 0:
            return True
    return False


@helper
def _argmin(row):  # type: ignore[no-untyped-def]
    lowest = 0
    for k in range(len(row)):
        if row[k] < row[lowest]:
            lowest = k
    return lowest


@numba.njit(cache=True)
def second_best_rise(cost, partner, free_cost, free_partner, release, pairs, allow_closed):  # type: ignore[no-untyped-def]
    """Return the least rise of the total cost without each connection of a matching.

    Without the connection (a, b) either end stays free or goes to another end; the former partners of those stay free, go to a
    free end, or to each other. A lower bound of the rise is computed for every pair (c, d) that a and b may go to; the exchanges
    are then tried in order of their bounds until the bound exceeds the best rise so far.

    Parameters
    ----------
    cost, partner, free_cost, free_partner, release
        as above
    pairs
        (K, 2) int64, the connections
    allow_closed
        bool, whether an exchange may make a closed chain

    Returns
    -------
    (K,) float64, at most that of leaving both ends free
    """
    count = len(cost)
    rise, column, low = np.empty((count + 1, count + 1)), np.empty(count + 1, np.int64), np.empty(count + 1)
    least = np.empty(len(pairs))
    ends, made, removed = np.empty(4, np.int64), np.empty((4, 2), np.int64), np.empty(6, np.int64)
    for k in range(len(pairs)):
        ends[0], ends[1] = pairs[k, 0], pairs[k, 1]
        least[k] = free_cost - cost[ends[0], ends[1]]
        _bound_rises(cost, partner, free_cost, release, ends[0], ends[1], rise)
        for c in range(count + 1):
            column[c] = _argmin(rise[c])
            low[c] = rise[c, column[c]]
        while True:
            c = _argmin(low)
            d = column[c]
            if not low[c] < least[k]:
                break
            rise[c, d] = np.inf
            column[c] = _argmin(rise[c])
            low[c] = rise[c, column[c]]
            ends[2], ends[3] = c if c < count else -1, d if d < count else -1
            value, size, removals = _exchange(cost, partner, free_cost, free_partner, ends, made, removed)
            if value < least[k] and (allow_closed or not _closes_chain(partner, made, size, removed, removals)):
                least[k] = value
    return least

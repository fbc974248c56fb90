"""How sure connections of chain ends are: what each of them saves against the best that could be had without it."""

from __future__ import annotations

import numpy as np

from .config import MergeConfig
from .evidence import Evidence, Seen
from .types import Floats, Ints

Link = tuple[int, int, float]

SAMPLES = (np.arange(12) + 0.5) / 12
"""Parts of the straight way between two ends at which it is looked at."""


def alternatives(
    cost: Floats, points: Floats, unit_cost: float, radius: float, config: MergeConfig, evidence: Evidence | None
) -> Floats:
    """The costs (E, E) of joining ends (E, D) with what the camera says of the straight ways between them.

    The way that a connection would really take is too dear to be found for all; the straight one tells as well which
    alternatives are none.

    cost : without that, infinite where ends may not be joined. unit_cost, radius : as in merging.
    """
    total = cost.copy()
    one, other = np.nonzero(np.isfinite(cost))
    if not len(one):
        return total
    step = points[other] - points[one]
    length = np.linalg.norm(step, axis=1)
    free, unknown = np.zeros(len(one)), np.ones(len(one))
    if evidence is not None:
        places = points[one][:, None] + SAMPLES[:, None] * step[:, None]
        said = evidence.classify(places.reshape(-1, points.shape[1])).reshape(len(one), -1)
        free, unknown = ((np.isin(said, kinds)).mean(axis=1) for kinds in ((Seen.FREE, Seen.OUTSIDE), (Seen.NO_DEPTH,)))
    unknown = np.where((length < config.direction_length * radius) & (free == 0), 0.0, unknown)
    total[one, other] += unit_cost * length * (config.free_space_weight * free + config.unknown_weight * unknown)
    return total


def sureness(links: list[Link], cost: Floats, most: float, rings: bool = False) -> list[float]:
    """How sure each connection is, 0 to 1: the rise of the total cost without it, over the most that a connection may cost.

    Without a connection either of its ends stays free, which costs half of `most`, or goes to another end; what that was
    joined to stays free, or is joined to what the other end's new partner was joined to. These are the exchanges of up to
    three connections for up to three others between the same ends, or fewer; no end is used twice.

    Parameters
    ----------
    links : (end, end, price) as chosen. End e is the first (even) or last (odd) of chain e // 2.
    cost : (E, E), of joining two ends, in the upper triangle; infinite where that may not be.
    most : cost of leaving both ends of a connection free; where it is infinite, twice the dearest that there is.
    rings : whether alternatives may join both ends of what is one chain then.
    """
    if not np.isfinite(most):
        most = 2 * max([float(cost[np.isfinite(cost)].max(initial=0.0)), *(price for _, _, price in links)]) + 1
    full = np.minimum(cost, cost.T)
    full[full > most] = np.inf
    partner = np.full(len(cost), -1)
    for a, b, price in links:
        partner[[a, b]] = b, a
        full[a, b] = full[b, a] = price
    gain = _joined_instead(full, partner, most)
    found = []
    for a, b, price in links:
        rise = _rises(a, b, full, partner, gain, most)
        found.append(float(np.clip(_least(a, b, rise, full, partner, most - price, most, rings) / most, 0.0, 1.0)))
    return found


def _joined_instead(full: Floats, partner: Ints, most: float) -> Floats:
    """(E, E): what it saves to join the partners of two ends to each other rather than to leave them free."""
    result = np.zeros_like(full)
    matched = np.flatnonzero(partner >= 0)
    old = np.ix_(partner[matched], partner[matched])
    result[np.ix_(matched, matched)] = np.maximum(most - full[old], 0.0)
    return result


def _rises(a: int, b: int, full: Floats, partner: Ints, gain: Floats, most: float) -> Floats:
    """By how much the total rises when a goes to end c and b to end d instead: (E + 1, E + 1), the last is none."""
    ends = np.arange(len(full))
    matched = np.flatnonzero(partner >= 0)
    settled = np.full(len(full), -most / 2)
    settled[matched] = most / 2 - full[matched, partner[matched]]
    first, second = (np.append(full[end] + settled, most / 2) for end in (a, b))
    rise = first[:, None] + second[None] - full[a, b]
    rise[:-1, :-1] -= gain
    swapped = partner[matched]
    rise[matched, swapped] = full[a, matched] + full[b, swapped] - full[matched, swapped] - full[a, b]
    rise[ends, ends] = np.inf
    rise[[a, b]] = np.inf
    rise[:, [a, b]] = np.inf
    return np.asarray(rise)


def _least(
    a: int, b: int, rise: Floats, full: Floats, partner: Ints, apart: float, most: float, rings: bool
) -> float:  # fmt: skip
    """The least of the rises whose connections close no ring; `apart` is that of leaving both ends free."""
    none = len(full)
    rows, columns = np.nonzero(rise < apart)
    for k in np.argsort(rise[rows, columns], kind="stable"):
        c, d = int(rows[k]), int(columns[k])
        if rings or not _closes(a, b, c if c != none else -1, d if d != none else -1, full, partner, most):
            return float(rise[c, d])
    return apart


def _closes(a: int, b: int, c: int, d: int, full: Floats, partner: Ints, most: float) -> bool:
    """Whether a ring comes of a going to end c and b to end d instead of to each other; -1 is none."""
    now = {end: int(to) for end, to in enumerate(partner) if to >= 0 and end not in (a, b)}
    left = [now.pop(to) for to in (c, d) if to in now]
    for end in left:
        now.pop(end, None)
    made = [(one, other) for one, other in ((a, c), (b, d)) if other >= 0]
    if len(left) == 2 and left[0] != d and full[left[0], left[1]] < most:
        made.append((left[0], left[1]))
    for one, other in made:
        now[one], now[other] = other, one
    for one, _ in made:
        end = one ^ 1
        while end in now and now[end] != one:
            end = now[end] ^ 1
        if end in now:
            return True
    return False

"""How sure connections of chain ends are: what each of them saves against the best that could be had without it."""

from __future__ import annotations

from dataclasses import dataclass

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


@dataclass(frozen=True)
class _Chosen:
    """The connections as they are.

    full : (E, E) cost of joining any two ends. partner : (E,) what each end is joined to, -1 for nothing. most : cost of
    leaving two ends free. spare : (E,) the free end that each end would be joined to at the least cost, -1 where none is
    worth it. settled : (E,) what it costs to leave what an end is joined to, or that it is free, for something else.
    """

    full: Floats
    partner: Ints
    most: float
    spare: Ints
    settled: Floats

    @staticmethod
    def of(links: list[Link], cost: Floats, most: float) -> _Chosen:
        """All that is asked of links and costs more than once."""
        full = np.minimum(cost, cost.T)
        full[full > most] = np.inf
        partner = np.full(len(full), -1)
        for a, b, price in links:
            partner[[a, b]] = b, a
            full[a, b] = full[b, a] = price
        matched, free = np.flatnonzero(partner >= 0), np.flatnonzero(partner < 0)
        spare, least = np.full(len(full), -1), np.full(len(full), np.inf)
        if len(free):
            best = full[:, free].argmin(axis=1)
            least = full[np.arange(len(full)), free[best]]
            spare = np.where(least < most, free[best], -1)
        settled = np.full(len(full), -most / 2)
        left = partner[matched]
        settled[matched] = np.minimum(most / 2, least[left] - most / 2) - full[matched, left]
        return _Chosen(full, partner, most, spare, settled)

    def rises(self, a: int, b: int) -> Floats:
        """(E + 1, E + 1): the least by which the total rises when a goes to end c and b to end d instead; the last is none."""
        matched = np.flatnonzero(self.partner >= 0)
        first, second = (np.append(self.full[end] + self.settled, self.most / 2) for end in (a, b))
        rise = first[:, None] + second[None] - self.full[a, b]
        left = self.partner[matched]
        own = self.settled[matched] + self.full[matched, left]
        apart = np.add.outer(own, own)
        rise[np.ix_(matched, matched)] += np.minimum(self.full[np.ix_(left, left)] - apart, 0.0)
        rise[matched, left] = self.full[a, matched] + self.full[b, left] - self.full[matched, left] - self.full[a, b]
        np.fill_diagonal(rise[:-1, :-1], np.inf)
        rise[[a, b]] = np.inf
        rise[:, [a, b]] = np.inf
        return np.asarray(rise)

    def exchange(self, a: int, b: int, c: int, d: int) -> tuple[float, list[tuple[int, int]], set[int]]:
        """What an exchange costs: the rise, the connections made, and the ends whose connections are gone; -1 is none."""
        made = [(one, other) for one, other in ((a, c), (b, d)) if other >= 0]
        broken = {end for end in (c, d) if end >= 0 and self.partner[end] >= 0}
        left = [int(self.partner[end]) for end in sorted(broken) if self.partner[end] not in (c, d)]
        if len(left) == 2 and self.full[left[0], left[1]] < self.most:
            made.append((left[0], left[1]))
        else:
            for end in left:
                if self.spare[end] >= 0 and self.spare[end] not in [other for _, other in made]:
                    made.append((end, int(self.spare[end])))
        gone = {a, b, *broken, *(int(self.partner[end]) for end in broken)}
        before = sum(self.full[end, self.partner[end]] for end in gone) / 2
        after = sum(self.full[pair] for pair in made)
        used = {end for pair in made for end in pair}
        free = len(gone - used) - len(used - gone)
        return float(after - before + free * self.most / 2), made, gone

    def closes(self, made: list[tuple[int, int]], gone: set[int]) -> bool:
        """Whether an exchange closes a ring."""
        now = {end: int(to) for end, to in enumerate(self.partner) if to >= 0 and end not in gone}
        for one, other in made:
            now[one], now[other] = other, one
        for one, _ in made:
            end = one ^ 1
            while end in now and now[end] != one:
                end = now[end] ^ 1
            if end in now:
                return True
        return False


def sureness(links: list[Link], cost: Floats, most: float, rings: bool = False) -> list[float]:
    """How sure each connection is, 0 to 1: the rise of the total cost without it, over the most that a connection may cost.

    Without a connection either of its ends stays free, which costs half of `most`, or goes to another end. What that was
    joined to stays free, goes to an end that was free, or to what was joined to the other end's new partner. So up to three
    connections are exchanged; no end is used twice.

    Parameters
    ----------
    links : (end, end, price) as chosen. End e is the first (even) or last (odd) of chain e // 2.
    cost : (E, E), of joining two ends, in the upper triangle; infinite where that may not be.
    most : cost of leaving both ends of a connection free; where it is infinite, twice the dearest that there is.
    rings : whether alternatives may join both ends of what is one chain then.
    """
    if not np.isfinite(most):
        most = 2 * max([float(cost[np.isfinite(cost)].max(initial=0.0)), *(price for _, _, price in links)]) + 1
    chosen = _Chosen.of(links, cost, most)
    return [float(np.clip(_least(chosen, a, b, most - price, rings) / most, 0.0, 1.0)) for a, b, price in links]


def _least(chosen: _Chosen, a: int, b: int, apart: float, rings: bool) -> float:
    """The least rise of the total without a connection; `apart` is that of leaving both its ends free."""
    rise = chosen.rises(a, b)
    rows, columns = np.nonzero(rise < apart)
    best, none = apart, len(rise) - 1
    for k in np.argsort(rise[rows, columns], kind="stable"):
        if rise[rows[k], columns[k]] >= best:
            break
        c, d = (-1 if end == none else int(end) for end in (rows[k], columns[k]))
        value, made, gone = chosen.exchange(a, b, c, d)
        if value < best and (rings or not chosen.closes(made, gone)):
            best = value
    return best

"""How sure connections of chain ends are: what each of them saves against the best that could be had without it."""

from __future__ import annotations

import numpy as np

from ...config import MergeConfig
from ...kernels.second_best import second_best_rise
from ...types import Floats, Ints
from ...visibility import PointVisibility, Visibility

Link = tuple[int, int, float]

SAMPLES = (np.arange(12) + 0.5) / 12
"""Parts of the straight way between two ends at which it is looked at."""


def alternatives(
    cost: Floats, points: Floats, unit_cost: float, radius: float, config: MergeConfig, visibility: Visibility | None
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
    if visibility is not None:
        places = points[one][:, None] + SAMPLES[:, None] * step[:, None]
        said = visibility.classify(places.reshape(-1, points.shape[1])).reshape(len(one), -1)
        free, unknown = (
            (np.isin(said, kinds)).mean(axis=1)
            for kinds in ((PointVisibility.FREE, PointVisibility.OUTSIDE), (PointVisibility.NO_DEPTH,))
        )
    unknown = np.where((length < config.tangent_window_radii * radius) & (free == 0), 0.0, unknown)
    total[one, other] += unit_cost * length * (config.free_space_weight * free + config.unknown_weight * unknown)
    return total


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
    if not links:
        return []
    full = np.minimum(cost, cost.T)
    full[full > most] = np.inf
    partner = np.full(len(full), -1)
    for a, b, price in links:
        partner[[a, b]] = b, a
        full[a, b] = full[b, a] = price
    pairs = np.array([(a, b) for a, b, _ in links])
    rise = second_best_rise(full, partner, float(most), *_elsewhere(full, partner, most), pairs, rings)
    return [float(confidence) for confidence in np.clip(rise / most, 0.0, 1.0)]


def _elsewhere(full: Floats, partner: Ints, most: float) -> tuple[Ints, Floats]:
    """Where ends may go besides, as `kernels.second_best` has it: `spare` and `settled`."""
    matched, free = np.flatnonzero(partner >= 0), np.flatnonzero(partner < 0)
    spare, price = np.full(len(full), -1), np.full(len(full), np.inf)
    if len(free):
        best = full[:, free].argmin(axis=1)
        price = full[np.arange(len(full)), free[best]]
        spare = np.where(price < most, free[best], -1)
    settled = np.full(len(full), -most / 2)
    left = partner[matched]
    settled[matched] = np.minimum(most / 2, price[left] - most / 2) - full[matched, left]
    return spare, settled

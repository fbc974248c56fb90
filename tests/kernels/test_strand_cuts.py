"""Cuts of strands that a single frame joined wrongly: against every choice of cuts and places."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from doo3d.kernels import strand_cuts

STEP, DEVIATION, OUTSIDE, SHIFT = 0.01, 0.012, 9.0, 2.5
PLACES = np.column_stack((np.arange(30) * STEP, 0.03 * np.sin(np.arange(30) / 4), np.zeros(30)))


def cuts_of(points, arcs, cut):
    return strand_cuts(
        np.ascontiguousarray(points), arcs, arcs[-1] if len(arcs) else 0.0, PLACES, STEP, DEVIATION, OUTSIDE, SHIFT, cut
    )


def cost_of(points, arcs, length, start, backwards):
    """Return the cost (N,) of each point if the strand begins at a place, or ends there, by the definition."""
    at = start + (-1 if backwards else 1) * np.rint(arcs / STEP).astype(int)
    squares = ((points - PLACES[np.clip(at, 0, len(PLACES) - 1)]) ** 2).sum(axis=1) / DEVIATION**2
    return np.minimum(squares, OUTSIDE)


def by_trying(points, arcs, length, cut):
    """Return the cuts of least cost, of up to two cuts at every point with every place for every part, moved or not."""
    whole = round(length / STEP)
    states = [(start, False) for start in range(-whole, len(PLACES))] + [(start, True) for start in range(len(PLACES) + whole)]
    means, costs = zip(*(laid_whole(points, arcs, *state) for state in states), strict=True)
    moved = means[int(np.argmin(costs))]
    still = cheapest(points, arcs, length, cut, states)
    other = cheapest(points - moved, arcs, length, cut, states)
    return list(other[1] if other[0] + len(points) * (moved @ moved) / (SHIFT * DEVIATION) ** 2 < still[0] else still[1])


def laid_whole(points, arcs, start, backwards):
    """Return the mean offset (3,) of an uncut strand from its places, and its cost if that counts little."""
    at = start + (-1 if backwards else 1) * np.rint(arcs / STEP).astype(int)
    off = points - PLACES[np.clip(at, 0, len(PLACES) - 1)]
    mean = off.mean(axis=0)
    return mean, (off**2).sum(axis=1).mean() - mean @ mean + mean @ mean / SHIFT**2


def cheapest(points, arcs, length, cut, states):
    """Return the least cost, and the cuts."""
    sums = np.array([np.append(0.0, np.cumsum(cost_of(points, arcs, length, *state))) for state in states])
    best = np.inf, ()
    for cuts in itertools.chain.from_iterable(itertools.combinations(range(1, len(points)), k) for k in range(3)):
        edges = [0, *cuts, len(points)]
        total = cut[list(cuts)].sum() + sum((sums[:, b] - sums[:, a]).min() for a, b in itertools.pairwise(edges))
        best = min(best, (total, cuts))
    return best


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("most", [6.0, 15.0])
def test_the_cuts_are_the_cheapest(seed, most):
    rng = np.random.default_rng(seed)
    first, second = rng.integers(0, 18, 2)
    parts = PLACES[first : first + 7], PLACES[second : second + 8][:: 1 if seed % 2 else -1]
    points = np.concatenate(parts) + rng.normal(0, 0.002, (15, 3))
    arcs = np.arange(15) * STEP
    cut = np.where(rng.random(15) < 0.3, rng.uniform(0.5, most, 15), most)
    assert cuts_of(points, arcs, cut).tolist() == by_trying(points, arcs, arcs[-1], cut)


def test_a_strand_that_follows_the_object_stays_whole_and_one_that_turns_back_is_cut():
    arcs = np.arange(20) * STEP
    for line in (PLACES[5:25], PLACES[24:4:-1]):
        assert len(cuts_of(line, arcs, np.full(20, 15.0))) == 0
    exchanged = np.concatenate((PLACES[:10], PLACES[29:19:-1]))
    assert cuts_of(exchanged, arcs, np.full(20, 15.0)).tolist() == [10]


def test_a_strand_that_moved_as_a_whole_stays_whole():
    line, arcs = PLACES[5:25] + np.array([0.0, 0.025, 0.0]), np.arange(20) * STEP
    assert len(cuts_of(line, arcs, np.full(20, 13.0))) == 0


def test_no_points_have_no_cuts():
    assert len(cuts_of(np.zeros((0, 3)), np.zeros(0), np.zeros(0))) == 0

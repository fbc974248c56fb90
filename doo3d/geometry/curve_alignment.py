"""Align the points of a path with curves: one position for each point, all chosen together by dynamic programming.

A point near a crossing of curves is near two of them. Choosing the nearest for each point alone makes a path that is a little
off seem to jump to the other curve and back; the Viterbi algorithm finds the sequence of positions of least total cost.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from scipy.ndimage import minimum_filter1d

from ..types import Bools, Floats, Ints


@dataclass(frozen=True)
class AlignmentCosts:
    """Weights of an alignment.

    misfit : cost of a point at the edge of its tolerance; it grows with the square of the distance. jump : cost of leaving
    a curve, and the highest cost of a step along one. slack_fraction : fraction of the path from one point to the next by
    which the length along the curve may differ before the step is a jump; corners are cut, and noise adds length.
    """

    misfit: float
    jump: float = 20.0
    slack_fraction: float = 0.5


@dataclass(frozen=True)
class Candidates:
    """Positions on curves that the points of a path may have: (C,) arrays in the order of the points.

    point : index of the point. curve : index of the curve. arc : length along the curve. distance : of the point from the
    curve. tolerance : of the distance. slack : length, in addition to the fraction of `AlignmentCosts`, by which a step along
    the curve may differ from that along the path. direction : 1 or -1, in which the curve is followed; 0 for either.
    period : length of a closed curve, so that the shorter way round counts; infinite for an open one. path_position : of the
    point along the path, in units of `path_unit`, which is a length.
    """

    point: Ints
    curve: Ints
    arc: Floats
    distance: Floats
    tolerance: Floats
    slack: Floats
    direction: Ints
    period: Floats
    path_position: Floats
    path_unit: float = 1.0

    def step_cost(self, a: Ints, b: Ints, costs: AlignmentCosts) -> Floats:
        """Return the cost of the steps from candidates a to b, indices that broadcast: up to `costs.jump`, which is a jump."""
        run = (self.path_position[b] - self.path_position[a]) * self.path_unit
        step = self.arc[b] - self.arc[a]
        period = self.period[a]
        step = np.where(np.abs(step) > period / 2, step - np.copysign(period, step), step)
        step = np.where(self.direction[a] == 0, np.abs(step), self.direction[a] * step)
        excess = np.abs(step - run) / (costs.slack_fraction * run + np.maximum(self.slack[a], self.slack[b]))
        leaves_curve = (self.curve[a] != self.curve[b]) | (self.direction[a] != self.direction[b])
        return np.asarray(costs.jump * np.where(leaves_curve, 1.0, np.minimum(excess**2, 1.0)))

    def choose(self, costs: AlignmentCosts) -> Ints:
        """Return the index of the chosen candidate of each point that has any, of least total cost (Viterbi)."""
        if not len(self.point):
            return np.zeros(0, dtype=int)
        groups = np.split(np.arange(len(self.point)), np.flatnonzero(np.diff(self.point)) + 1)
        total = costs.misfit * (self.distance / self.tolerance) ** 2
        predecessor = np.full(len(total), -1)
        for before, group in pairwise(groups):
            sums = total[before][:, None] + self.step_cost(before[:, None], group[None], costs)
            best = sums.argmin(axis=0)
            predecessor[group] = before[best]
            total[group] += sums[best, np.arange(len(group))]
        chosen = [int(groups[-1][total[groups[-1]].argmin()])]
        while predecessor[chosen[-1]] >= 0:
            chosen.append(int(predecessor[chosen[-1]]))
        return np.array(chosen[::-1])


def nearest_samples(
    distances: Floats, limits: Floats, half_window: int, mode: Literal["nearest", "wrap"] = "nearest"
) -> tuple[Ints, Ints]:
    """Return where points come nearest to a curve: local minima of the distance along it, within limits.

    Parameters
    ----------
    distances
        (N, P), from each point to each sample of the curve.
    limits
        (P,) or (N, P), the greatest distance.
    half_window
        samples on either side of which none may be nearer.
    mode
        "wrap" for a closed curve.

    Returns
    -------
    points, samples : (C,) indices, in the order of the points.
    """
    lowest: Bools = distances == minimum_filter1d(distances, 2 * half_window + 1, axis=1, mode=mode)
    points, samples = np.nonzero(lowest & (distances <= limits))
    return points, samples

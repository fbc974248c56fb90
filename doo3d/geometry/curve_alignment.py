"""Align the points of a path with curves, all together by the Viterbi algorithm.

A point near a crossing of curves is near two of them. If the nearest one is chosen for each point alone, a path with small
errors seems to jump to the other curve and back; the Viterbi algorithm finds the sequence of positions of least total cost.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from scipy.ndimage import minimum_filter1d

from ..types import Bools, Floats, Ints

JUMP = 20.0
"""Cost of a jump from one curve to another, and largest cost of a step along one curve."""

SLACK_SHARE = 0.5
"""Fraction of a step's length along the path by which its length along the curve may differ before the step costs as much as a
jump. Paths cut corners, and noise adds length."""


@dataclass(frozen=True)
class Candidates:
    """Candidate positions on curves for the points of a path, sorted by point.

    All arrays have C candidates. A point may have several, such as one on each of two crossing curves. All lengths are in the
    unit of the curves.

    Attributes
    ----------
    point
        (C,) int, index of the candidate's point along the path.
    curve
        (C,) int, index of the curve of the candidate.
    arc
        (C,) length along the curve from its start to the candidate.
    distance
        (C,) distance of the point from the candidate.
    tolerance
        (C,) distance that costs the `misfit` of `choose`.
    slack
        (C,) length by which a step along the curve may differ from the step along the path, in addition to SLACK_SHARE (0.5)
        of the step.
    direction
        (C,) 1 or -1, the direction in which the path must follow the curve; 0 for either.
    period
        (C,) length of a closed curve, around which a step takes the shorter way; infinite for an open curve.
    path_position
        (C,) position of the point along the path, in units of `path_unit`.
    path_unit
        length of one unit of `path_position`.
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

    def step_cost(self, a: Ints, b: Ints) -> Floats:
        """Return the costs of steps from candidates a to candidates b.

        A step along one curve costs the squared difference between its lengths along the curve and along the path, relative to
        the slack, times JUMP (20), and JUMP at most. A step to another curve, or to another `direction`, costs JUMP.

        Parameters
        ----------
        a, b
            int arrays of one shape, or of shapes that broadcast: indices of candidates of successive points.

        Returns
        -------
        Costs, in the broadcast shape of a and b.
        """
        run = (self.path_position[b] - self.path_position[a]) * self.path_unit
        step = self.arc[b] - self.arc[a]
        period = self.period[a]
        step = np.where(np.abs(step) > period / 2, step - np.copysign(period, step), step)
        step = np.where(self.direction[a] == 0, np.abs(step), self.direction[a] * step)
        excess = np.abs(step - run) / (SLACK_SHARE * run + np.maximum(self.slack[a], self.slack[b]))
        leaves_curve = (self.curve[a] != self.curve[b]) | (self.direction[a] != self.direction[b])
        return np.asarray(JUMP * np.where(leaves_curve, 1.0, np.minimum(excess**2, 1.0)))

    def choose(self, misfit: float = 1.0) -> Ints:
        """Choose one candidate for each point by the Viterbi algorithm.

        Parameters
        ----------
        misfit
            cost of a point whose distance from the curve equals its tolerance; it grows with the square of the distance.

        Returns
        -------
        (Q,) int, indices of the Q chosen candidates, in the order of the points. Points without a candidate
        are skipped; (0,) if there are no candidates at all.
        """
        if not len(self.point):
            return np.zeros(0, dtype=int)
        groups = np.split(np.arange(len(self.point)), np.flatnonzero(np.diff(self.point)) + 1)
        total = misfit * (self.distance / self.tolerance) ** 2
        predecessor = np.full(len(total), -1)
        for before, group in pairwise(groups):
            sums = total[before][:, None] + self.step_cost(before[:, None], group[None])
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
    """Find the local minima of the distance of points along a curve.

    They are the samples of the curve that are nearest to each point.

    Parameters
    ----------
    distances
        (N, P), distance of each of N points from each of P samples along the curve.
    limits
        (P,) or (N, P), largest distance of a minimum, in the unit of `distances`.
    half_window
        number of samples on either side of a minimum that must not be nearer to the point.
    mode
        "wrap" for a closed curve, "nearest" for an open one.

    Returns
    -------
    points, samples : (C,) and (C,) int, index of the point and of the sample for each of C minima, sorted by the point.
    """
    lowest: Bools = distances == minimum_filter1d(distances, 2 * half_window + 1, axis=1, mode=mode)
    points, samples = np.nonzero(lowest & (distances <= limits))
    return points, samples

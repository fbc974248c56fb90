"""Polylines compared at the best shift: against the traces of the matrix of distances."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from doo3d.kernels import shift_costs


def samples(points, count):
    at = np.linspace(0, len(points) - 1, count)
    return np.column_stack([np.interp(at, np.arange(len(points)), column) for column in points.T])


def by_traces(first, second, counts, limit):
    distances = cdist(samples(first, counts[0]), samples(second, counts[1]))
    rows, columns = counts
    least = (min(rows, columns) + 1) // 2
    costs = []
    for turned in (distances, distances[:, ::-1]):
        means = []
        for shift in range(least - rows, columns - least + 1):
            overlap = len(np.diagonal(turned, shift))
            unmatched = (rows + columns) / 2 - overlap
            means.append((turned.trace(shift) / limit + unmatched) / (overlap + unmatched))
        costs.append(min(means))
    return costs


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(20))
def test_against_the_traces_of_the_distances(seed, dim):
    rng = np.random.default_rng(seed)
    first, second = (np.cumsum(rng.normal(0.01, 0.01, (n, dim)), axis=0) for n in rng.integers(2, 50, 2))
    counts = tuple(map(int, rng.integers(2, 62, 2)))
    assert shift_costs(first, second[::-1], counts, 5.0) == pytest.approx(by_traces(first, second[::-1], counts, 5.0))


def test_a_part_of_a_line_costs_what_is_missing_of_it():
    line = np.column_stack((np.arange(61.0), np.zeros(61), np.ones(61)))
    forward, backward = shift_costs(line, line[:46], (61, 46), 10.0)
    assert forward == pytest.approx(7.5 / 53.5)
    assert backward > 1
    assert shift_costs(line, line[45::-1], (61, 46), 10.0) == (backward, forward)


def test_lines_further_apart_than_the_limit_cost_infinitely_much():
    line = np.column_stack((np.arange(61.0), np.zeros(61)))
    assert shift_costs(line, line + np.array([0.0, 10.001]), (61, 61), 10.0) == (np.inf, np.inf)
    assert np.isfinite(shift_costs(line, line + np.array([0.0, 9.999]), (61, 61), 10.0)).all()

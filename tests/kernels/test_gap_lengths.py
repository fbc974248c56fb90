"""Lengths of gaps by what the camera says, and the limits of pairs of ends, against plain computations in NumPy."""

import numpy as np
import pytest

from doo3d.kernels import gap_lengths, straight_gap_costs, straight_gaps

OUTSIDE, NO_DEPTH, FREE, BARE = 0, 1, 5, 6


@pytest.mark.parametrize("dim", [2, 3])
def test_lengths_are_those_of_the_steps_of_each_class(dim):
    rng = np.random.default_rng(dim)
    bounds = np.array([0, 5, 6, 40])
    points, classes = rng.normal(size=(40, dim)), rng.integers(0, 7, 39)
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    for found, a, b in zip(gap_lengths(points, bounds, classes), bounds[:-1], bounds[1:] - 1, strict=True):
        kind, length = classes[a:b], step[a:b]
        expected = [length[np.isin(kind, kinds)].sum() for kinds in ((OUTSIDE, FREE), (NO_DEPTH,), (BARE,))]
        np.testing.assert_allclose(found, expected)


@pytest.mark.parametrize("dim", [2, 3])
def test_straight_gaps_cost_their_open_and_unknown_shares(dim):
    rng = np.random.default_rng(dim)
    points, shares = rng.normal(size=(9, dim)), (np.arange(12) + 0.5) / 12
    first, second = rng.integers(0, 9, (2, 30))
    offset = points[second] - points[first]
    expected = points[first][:, None] + shares[:, None] * offset[:, None]
    np.testing.assert_allclose(straight_gaps(points, first, second, shares), expected.reshape(-1, dim))
    classes = np.where(rng.random((30, 1)) < 0.5, rng.integers(0, 7, (30, 12)), rng.integers(1, 5, (30, 12)))
    length = np.linalg.norm(offset, axis=1)
    is_open = np.isin(classes, (OUTSIDE, FREE, BARE)).mean(axis=1)
    unknown = np.where((length < 1.5) & (is_open == 0), 0.0, (classes == NO_DEPTH).mean(axis=1))
    costs = straight_gap_costs(points, first, second, classes.ravel(), 1.5, 1000.0, 3.0, 0.5)
    np.testing.assert_allclose(costs, 1000 * length * (3 * is_open + 0.5 * unknown))


def test_a_pair_of_no_end_is_refused():
    with pytest.raises(ValueError, match="no end"):
        straight_gaps(np.zeros((2, 2)), np.array([0]), np.array([2]), np.ones(1))

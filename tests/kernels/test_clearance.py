"""Where lines that leave one place are clear of each other, against all distances."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from doo3d.kernels import first_clear


def slow_first_clear(lines, counts, limits, clearance):
    """The same from all distances."""
    result = []
    for e, line in enumerate(lines):
        own = line[: counts[e]]
        others = [other[: min(counts[e], limits[k])] for k, other in enumerate(lines) if k != e]
        others = np.concatenate([np.zeros((0, line.shape[1])), *others])
        clear = np.flatnonzero((cdist(own, others) > clearance).all(axis=1)) if len(others) else np.zeros(1, int)
        result.append(clear[0] if len(clear) else len(own) - 1)
    return result


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(10))
def test_against_all_distances(seed, dim):
    random = np.random.default_rng(seed)
    lines = [np.cumsum(random.normal(size=(size, dim)), axis=0) for size in random.integers(1, 40, random.integers(1, 8))]
    bounds = np.cumsum([0, *map(len, lines)])
    for clearance in (0.0, 0.5, 2.0, 5.0):
        counts, limits = random.integers(1, 45, len(lines)), random.integers(0, 45, len(lines))
        first = first_clear(np.concatenate(lines), bounds, counts, limits, clearance)
        assert first.tolist() == slow_first_clear(lines, counts, limits, clearance)


def test_one_line_is_clear_of_all_others():
    assert first_clear(np.zeros((4, 2)), np.array([0, 4]), np.array([4]), np.array([4]), 1.0).tolist() == [0]


def test_no_lines():
    none = np.zeros(0, dtype=np.int64)
    assert first_clear(np.zeros((0, 2)), np.zeros(1, dtype=np.int64), none, none, 1.0).tolist() == []


def test_a_line_within_the_clearance_ends_at_its_last_point():
    points = np.zeros((6, 3))
    assert first_clear(points, np.array([0, 2, 6]), np.array([9, 3]), np.array([9, 9]), 1.0).tolist() == [1, 2]

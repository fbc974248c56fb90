"""Where a line leaves others behind, against all distances."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from doo3d.kernels import first_clear


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(5))
def test_against_all_distances(seed, dim):
    random = np.random.default_rng(seed)
    points = np.cumsum(random.normal(size=(40, dim)), axis=0)
    others = np.cumsum(random.normal(size=(30, dim)), axis=0)
    apart = cdist(points, others).min(axis=1)
    for limit in np.quantile(apart, [0.0, 0.3, 0.6, 0.9]):
        assert first_clear(points, others, limit) == np.flatnonzero(apart > limit)[0]
    assert first_clear(points, others, apart.max()) == len(points) - 1


def test_with_no_others_all_are_clear():
    assert first_clear(np.zeros((4, 2)), np.zeros((0, 2)), 1.0) == 0

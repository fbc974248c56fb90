"""Blocks find all points in a box."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.geometry.blocks import BLOCK, Blocks


@pytest.mark.parametrize("count", [1, BLOCK, BLOCK + 1, 1000])
@pytest.mark.parametrize("dim", [2, 3])
def test_all_points_in_a_box_are_among_those_found(count, dim):
    random = np.random.default_rng(count)
    points = np.sort(random.uniform(0, 1, (count, dim)), axis=0)
    for _ in range(20):
        low = random.uniform(0, 1, dim)
        high = low + random.uniform(0, 0.3, dim)
        found = Blocks(points).within(low, high)
        inside = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
        assert set(inside.tolist()) <= set(found.tolist())
        assert (np.diff(found) > 0).all()
    assert not len(Blocks(points).within(np.full(dim, 2.0), np.full(dim, 3.0)))

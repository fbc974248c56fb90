"""Chains along polylines, against Algorithm 2 as it stands in the paper."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from doo3d.kernels import fit_chains


def divided(line, length):
    """The line with points added so that no step is longer than `length`."""
    points = [line[:1]]
    for a, b in pairwise(line):
        parts = max(1, int(np.ceil(np.linalg.norm(b - a) / length)))
        points.append(a + (b - a) * (np.arange(1, parts + 1) / parts)[:, None])
    return np.concatenate(points)


def slow_chains(line, length, min_cosine):
    """Algorithm 2: start, tip and end of each segment in turn."""
    chains, chain, update_tip = [], [], True
    start = tip = line[0]
    for point in line:
        away = np.linalg.norm(point - start)
        if away >= length:
            end = start + length * (point - start) / away
            if not chain or (chain[-1] - chain[-2]) @ (end - start) >= min_cosine * length**2:
                chain += [end] if chain else [start, end]
                start = tip = end
            else:
                chains.append(np.array(chain))
                chain, start = [], tip
            update_tip = True
        elif away >= np.linalg.norm(tip - start):
            tip = point if update_tip else tip
        else:
            update_tip = False
    return [*chains, np.array(chain)] if chain else chains


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(20))
def test_against_the_algorithm_of_the_paper(seed, dim):
    random = np.random.default_rng(seed)
    sizes, min_cosine = random.integers(0, 60, 5), random.uniform(-0.5, 0.9)
    lines = [np.cumsum(random.normal(size=(size, dim)) + 0.6, axis=0) * random.uniform(0.1, 1.5) for size in sizes]
    closed = random.random(5) < 0.4
    bounds = np.cumsum([0, *sizes])
    joints, starts, rings = fit_chains(np.concatenate(lines), bounds, closed, 1.0, min_cosine)
    expected, expected_rings = [], []
    for line, ring in zip(lines, closed.tolist(), strict=True):
        if len(line) > 1:
            found = slow_chains(divided(np.concatenate((line, line[: int(ring)])), 1.0), 1.0, min_cosine)
            expected += found
            expected_rings += [ring and len(found) == 1] * len(found)
    assert rings.tolist() == expected_rings
    assert np.diff(starts).tolist() == [len(chain) for chain in expected]
    np.testing.assert_allclose(joints, np.concatenate([np.zeros((0, dim)), *expected]), atol=1e-9)


def test_a_length_of_which_too_many_would_be_laid_is_refused():
    with pytest.raises(ValueError, match="1e8 times"):
        fit_chains(np.array([(0.0, 0.0), (1.0, 0.0)]), np.array([0, 2]), np.zeros(1, dtype=bool), 1e-9, 0.5)

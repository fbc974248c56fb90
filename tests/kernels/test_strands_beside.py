"""Strands beside each other in the view, against all pairs of samples."""

import numpy as np
import pytest

from doo3d.geometry.polyline import unit
from doo3d.kernels import strands_beside


def tangents_of(lines):
    return np.concatenate([unit(np.gradient(line, axis=0)) if len(line) > 1 else np.zeros((1, 2)) for line in lines])


def slow_strands_beside(lines, reach, along, around, reaches, apart, min_cosine):
    view = np.concatenate(lines)
    number = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
    tangent = tangents_of(lines)
    between = np.abs(along[:, None] - along)
    between = np.minimum(between, np.abs(around[number][:, None] - between))
    other = (number[:, None] != number) | (between > apart)
    near = np.linalg.norm(view[:, None] - view, axis=2) < reaches * np.maximum(reach[:, None], reach)
    return (other & near & (np.abs(tangent @ tangent.T) > min_cosine)).any(axis=1)


@pytest.mark.parametrize("seed", range(4))
def test_samples_beside_another_strand_are_those_of_all_pairs(seed):
    rng = np.random.default_rng(seed)
    lines = [np.cumsum(unit(np.cumsum(rng.normal(0, 0.2, (size, 2)), axis=0) + 1), axis=0) for size in (60, 1, 80, 2, 50)]
    bounds = np.cumsum([0, *map(len, lines)])
    reach = rng.uniform(0.5, 1.5, bounds[-1])
    along = np.concatenate([np.arange(len(line)) * 0.5 for line in lines])
    around = np.array([30.0, np.inf, np.inf, np.inf, np.inf])
    settings = (2.0, 8.0, np.cos(np.radians(25)))
    found = strands_beside(np.concatenate(lines), tangents_of(lines), bounds, reach, along, around, *settings, 1e6)
    np.testing.assert_array_equal(found, slow_strands_beside(lines, reach, along, around, *settings))
    assert 0 < found.sum() < len(found)


def test_of_too_many_pairs_every_other_sample_is_compared():
    u = np.linspace(0, 20, 200)
    lines = [np.column_stack((u, np.full(200, v))) for v in (0.0, 1.0, 9.0)]
    arguments = (tangents_of(lines), np.array([0, 200, 400, 600]), np.ones(600), np.tile(u, 3), np.full(3, np.inf), 2.0, 8.0, 0.9)
    for max_pairs in (1e6, 2e3):
        assert strands_beside(np.concatenate(lines), *arguments, max_pairs).tolist() == [True] * 400 + [False] * 200

"""Strands along the continuation of an end, against plain loops over all samples."""

import itertools

import numpy as np
import pytest

from doo3d.geometry.polyline import unit
from doo3d.kernels import strands_ahead

SLOPE, MISS, BEHIND, BEHIND_SHARE = 0.5, 1.1, 0.3, 0.4


def is_ahead(end, samples, sample_radii):
    point, tangent, bend, towards, radius, reach = end
    for sample, other in zip(samples, sample_radii, strict=True):
        offset, both = sample - point, radius + other
        if towards is not None:
            depth = offset @ towards
            beside = offset - depth * towards
            uncertain = SLOPE * max(0.0, np.linalg.norm(beside) - both)
            offset = beside + np.sign(depth) * max(0.0, abs(depth) - uncertain) * towards
        ahead = offset @ tangent
        expected = ahead * tangent + 0.5 * max(0.0, ahead) ** 2 * bend
        is_near = np.linalg.norm(offset) <= reach + other and np.linalg.norm(offset - expected) <= MISS * both
        if is_near and -ahead - both <= BEHIND + BEHIND_SHARE * both:
            return True
    return False


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("with_camera", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_strands_ahead_are_those_with_such_a_sample(seed, with_camera, dim):
    rng = np.random.default_rng(seed)
    lines = [np.cumsum(rng.normal(0, 0.3, (size, dim)), axis=0) + rng.normal(0, 2, dim) for size in (1, 40, 7, 30, 90)]
    samples, bounds = np.concatenate(lines), np.cumsum([0, *map(len, lines)])
    sample_radii = rng.uniform(0.02, 0.2, len(samples))
    points, tangents, bends = rng.normal(0, 2, (60, dim)), unit(rng.normal(size=(60, dim))), rng.normal(0, 0.3, (60, dim))
    towards = unit(rng.normal(size=(60, dim))) if with_camera else np.zeros((0, dim))
    radii, reach = rng.uniform(0.02, 0.2, 60), rng.uniform(0.5, 2, 60)
    limits = SLOPE, MISS, BEHIND, BEHIND_SHARE
    found = strands_ahead(points, tangents, bends, towards, radii, reach, samples, sample_radii, bounds, *limits)
    views = towards if with_camera else [None] * 60
    parts = [slice(*pair) for pair in itertools.pairwise(bounds)]
    ends = zip(points, tangents, bends, views, radii, reach, strict=True)
    expected = [[is_ahead(end, samples[part], sample_radii[part]) for part in parts] for end in ends]
    np.testing.assert_array_equal(found, expected)
    assert 0 < found.sum() < found.size


def test_shapes_that_do_not_fit_are_refused():
    one = np.zeros((1, 3))
    rest = np.ones(1), np.ones(1), one, np.ones(1), np.array([0, 1]), 0.5, 1.0, 0.0, 0.0
    with pytest.raises(ValueError, match="not one per end"):
        strands_ahead(one, one, np.zeros((2, 3)), one, *rest)

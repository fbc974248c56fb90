"""Distance, turn and bend of pairs of chain ends, against the angles of each pair of tangents half way."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from doo3d.geometry.polyline import angle, unit
from doo3d.kernels import end_pairs


def slow_pairs(points, tangents, curvatures, radius, window, kept):
    distance = np.linalg.norm(points[None] - points[:, None], axis=-1)
    strength = np.linalg.norm(curvatures, axis=1, keepdims=True)
    bends = curvatures * np.minimum(1.0, 1 / np.maximum(2 * radius * strength, 1e-12))
    expected = unit(tangents[:, None] + kept * np.minimum(distance, window)[:, :, None] / 2 * bends[:, None])
    bend = angle(expected, points[None] - points[:, None])
    bend[distance < 1e-12] = 0
    return distance, angle(expected, -expected.swapaxes(0, 1)), np.maximum(bend, bend.T)


@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(0, 12),
    dim=st.sampled_from([2, 3]),
    strength=st.sampled_from([0.0, 1.0, 300.0]),
    kept=st.floats(0, 1),
)
def test_pairs_are_those_of_the_tangents_half_way(seed, count, dim, strength, kept):
    random = np.random.default_rng(seed)
    points, tangents = random.normal(size=(count, dim)), unit(random.normal(size=(count, dim)))
    points[count // 2 :] = points[: count - count // 2]  # some ends coincide
    settings = strength * random.normal(size=(count, dim)), 0.01, 0.8, kept
    for found, expected in zip(end_pairs(points, tangents, *settings), slow_pairs(points, tangents, *settings), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(found, found.T)


def test_two_ends_of_one_circle_match_if_they_keep_their_curvature():
    at = np.array([0.0, 0.2])
    points = np.column_stack((np.cos(at), np.sin(at)))
    tangents = np.array([[1.0], [-1.0]]) * np.column_stack((-np.sin(at), np.cos(at)))
    distance, turn, bend = end_pairs(points, tangents, -points, 0.01, 1.0, 1.0)
    assert distance[0, 1] == pytest.approx(2 * np.sin(0.1))
    assert turn[0, 1] < 1e-3
    assert bend[0, 1] < 1e-3
    assert end_pairs(points, tangents, -points, 0.01, 1.0, 0.0)[1][0, 1] == pytest.approx(0.2)

import numpy as np
import pytest

from doo3d import kernels as lines
from doo3d.geometry.polyline import resample


@pytest.mark.parametrize("dim", [2, 3])
def test_as_numpy_has_it(dim):
    points = np.random.default_rng(dim).normal(size=(50, dim))
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    np.testing.assert_array_equal(lines.arc_length(points), along)
    np.testing.assert_array_equal(lines.steps(points, False), np.linalg.norm(np.diff(points, axis=0), axis=1))
    np.testing.assert_array_equal(lines.steps(points, True), np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1))
    np.testing.assert_allclose(lines.unit_rows(points), points / np.linalg.norm(points, axis=1, keepdims=True), rtol=1e-15)
    np.testing.assert_array_equal(lines.unit(points[3]), lines.unit_rows(points)[3])


def test_places_that_coincide_and_empty_lines():
    points = np.array([(0.0, 0.0), (0.0, 0.0), (2.0, 0.0), (2.0, 0.0)])
    assert resample(points, np.array([-1.0, 0.0, 1.0, 2.0, 3.0])).tolist() == [[0, 0], [0, 0], [1, 0], [2, 0], [2, 0]]
    assert len(lines.arc_length(points[:0])) == 0
    assert [len(lines.steps(points[:n], closed)) for n in (0, 1, 2) for closed in (False, True)] == [0, 0, 0, 1, 1, 2]
    assert lines.unit(np.zeros(3)).tolist() == [0, 0, 0]
    assert lines.unit_rows(np.zeros((1, 3))).tolist() == [[0, 0, 0]]


@pytest.mark.parametrize("half", [1, 3, 7])
def test_the_mean_of_those_around(half):
    points = np.random.default_rng(half).normal(size=(20, 3))
    widths = np.minimum(np.minimum(np.arange(20), np.arange(20)[::-1]), half)
    expected = [points[i - width : i + width + 1].mean(axis=0) for i, width in enumerate(widths)]
    np.testing.assert_allclose(lines.moving_mean(points, half), expected, atol=1e-14)

import numpy as np
import pytest

from doo3d.kernels import lines


@pytest.mark.parametrize("dim", [2, 3])
def test_as_numpy_has_it(dim):
    points = np.random.default_rng(dim).normal(size=(50, dim))
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    np.testing.assert_array_equal(lines.arc_length(points), along)
    at = np.linspace(-1, along[-1] + 1, 333)
    expected = np.column_stack([np.interp(at, along, points[:, d]) for d in range(dim)])
    np.testing.assert_allclose(lines.resample(points, at), expected, rtol=1e-13)
    np.testing.assert_allclose(lines.unit_rows(points), points / np.linalg.norm(points, axis=1, keepdims=True), rtol=1e-15)
    np.testing.assert_array_equal(lines.unit(points[3]), lines.unit_rows(points)[3])


def test_places_that_coincide_and_empty_lines():
    points = np.array([(0.0, 0.0), (0.0, 0.0), (2.0, 0.0), (2.0, 0.0)])
    assert lines.resample(points, np.array([-1.0, 0.0, 1.0, 2.0, 3.0])).tolist() == [[0, 0], [0, 0], [1, 0], [2, 0], [2, 0]]
    assert len(lines.arc_length(points[:0])) == 0
    assert lines.unit(np.zeros(3)).tolist() == [0, 0, 0] and lines.unit_rows(np.zeros((1, 3))).tolist() == [[0, 0, 0]]

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


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("count", [1, 2, 40])
def test_points_at_arc_lengths_are_those_of_interpolation(dim, count):
    rng = np.random.default_rng(count)
    points = rng.normal(size=(count, dim))
    points[count // 2 :: 7] = points[count // 2]
    along = lines.arc_length(points)
    at = np.concatenate((rng.uniform(-1, along[-1] + 1, 30), along))
    expected = np.column_stack([np.interp(at, along, column) for column in points.T])
    np.testing.assert_array_equal(lines.resample(points, at), expected)


def test_a_line_without_points_has_none_at_any_length():
    with pytest.raises(ValueError, match="no points"):
        lines.resample(np.zeros((0, 2)), np.zeros(1))


def test_places_that_coincide_and_empty_lines():
    points = np.array([(0.0, 0.0), (0.0, 0.0), (2.0, 0.0), (2.0, 0.0)])
    assert resample(points, np.array([-1.0, 0.0, 1.0, 2.0, 3.0])).tolist() == [[0, 0], [0, 0], [1, 0], [2, 0], [2, 0]]
    assert len(lines.arc_length(points[:0])) == 0
    assert [len(lines.steps(points[:n], closed)) for n in (0, 1, 2) for closed in (False, True)] == [0, 0, 0, 1, 1, 2]
    assert lines.unit(np.zeros(3)).tolist() == [0, 0, 0]
    assert lines.unit_rows(np.zeros((1, 3))).tolist() == [[0, 0, 0]]


@pytest.mark.parametrize("dim", [2, 3])
def test_samples_of_polylines_are_those_of_interpolation(dim):
    rng = np.random.default_rng(dim)
    parts = [rng.normal(size=(size, dim)) for size in (12, 1, 30, 2)]
    parts[2][7] = parts[2][8]
    bounds, counts = np.cumsum([0, *map(len, parts)]), np.array([9, 2, 40, 3])
    length = lines.polyline_lengths(np.concatenate(parts), bounds)
    assert length.tolist() == [lines.arc_length(part)[-1] for part in parts]
    to_end = np.array([True, False, False, True])
    spacing = length / (counts - to_end)
    samples, segment = lines.sample_polylines(np.concatenate(parts), bounds, spacing, counts, to_end)
    at = [np.linspace(0, total, count, endpoint=end) for total, count, end in zip(length, counts, to_end, strict=True)]
    np.testing.assert_array_equal(samples, np.concatenate([resample(part, each) for part, each in zip(parts, at, strict=True)]))
    steps = [
        np.clip(np.searchsorted(lines.arc_length(part), each, side="right") - 1, 0, max(len(part) - 2, 0))
        for part, each in zip(parts, at, strict=True)
    ]
    np.testing.assert_array_equal(segment, np.concatenate(steps))


@pytest.mark.parametrize("dim", [2, 3])
def test_tangents_of_polylines_are_central_differences(dim):
    rng = np.random.default_rng(dim)
    parts = [rng.normal(size=(size, dim)) for size in (12, 2, 30, 5)]
    closed = np.array([False, False, True, False])
    found = lines.polyline_tangents(np.concatenate(parts), np.cumsum([0, *map(len, parts)]), closed)
    expected = [
        np.roll(part, -1, axis=0) - np.roll(part, 1, axis=0) if ring else np.gradient(part, axis=0)
        for part, ring in zip(parts, closed, strict=True)
    ]
    np.testing.assert_array_equal(found, lines.unit_rows(np.concatenate(expected)))
    assert lines.polyline_tangents(np.ones((1, dim)), np.array([0, 1]), np.array([False])).tolist() == [[0.0] * dim]


def test_the_sharpest_turn_is_the_least_cosine():
    rng = np.random.default_rng(0)
    parts = [np.cumsum(rng.normal(1, 0.5, (size, 2)), axis=0) for size in (30, 8, 12)]
    bounds = np.cumsum([0, *map(len, parts)])
    expected = [1.0] * 3
    for c, part in enumerate(parts):
        for i in range(4, len(part) - 4):
            before, after = lines.unit(part[i] - part[i - 4]), lines.unit(part[i + 4] - part[i])
            expected[c] = min(expected[c], float(before @ after))
    np.testing.assert_allclose(lines.turn_cosines(np.concatenate(parts), bounds, 4), expected, rtol=1e-12)
    assert expected[1] == 1.0


@pytest.mark.parametrize("dim", [2, 3])
def test_legs_of_angles_are_the_sum_and_the_difference_of_unit_vectors(dim):
    a, b = np.random.default_rng(dim).normal(size=(2, 40, dim))
    a[3], b[4], b[5] = 0, 0, 2 * a[5]
    apart, together = lines.angle_legs(a, b)
    first, second = lines.unit_rows(a), lines.unit_rows(b)
    np.testing.assert_array_equal(apart, np.linalg.norm(first - second, axis=1))
    np.testing.assert_array_equal(together, np.linalg.norm(first + second, axis=1))
    assert apart[5] == 0

"""Curves in flat arrays, against each curve computed alone, and against circles and lines whose values are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from doo3d.geometry import polyline
from doo3d.geometry.curves import Curves, runs
from doo3d.geometry.projection import Projection


@st.composite
def lines(draw, most=5):
    """Up to `most` random polylines of two points or more, and whether each is a ring, whose last point repeats its first."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    dim = draw(st.sampled_from((2, 3)))
    found = [np.cumsum(rng.normal(size=(n, dim)), axis=0) for n in draw(st.lists(st.integers(2, 30), min_size=1, max_size=most))]
    closed = [bool(draw(st.booleans())) and len(line) > 3 for line in found]
    return [np.concatenate((line, line[:1])) if ring else line for line, ring in zip(found, closed, strict=True)], closed


@given(lines())
def test_each_curve_has_the_values_that_it_has_alone(drawn):
    parts, closed = drawn
    curves = Curves.of(parts, closed)
    assert len(curves) == len(parts)
    alone = [Curves.of([part], [ring]) for part, ring in zip(parts, closed, strict=True)]
    tangents = curves.ends(2.0)
    for k, (part, one) in enumerate(zip(parts, alone, strict=True)):
        np.testing.assert_array_equal(curves[k], part)
        np.testing.assert_array_equal(curves.owner[curves.parts[k]], k)
        np.testing.assert_array_equal(curves.points[curves.tips[2 * k : 2 * k + 2]], part[[0, -1]])
        assert curves.lengths[k] == one.lengths[0] == pytest.approx(polyline.arc_length(part)[-1])
        np.testing.assert_array_equal(curves.tangents[curves.parts[k]], one.tangents)
        np.testing.assert_array_equal(tangents[2 * k : 2 * k + 2], one.ends(2.0))


@given(lines(), st.integers(2, 50))
def test_samples_lie_on_their_curve_at_their_arc_length(drawn, count):
    curves = Curves.of(*drawn)
    counts = np.full(len(curves), count)
    spacing = curves.lengths / (count - 1)
    samples, segment = curves.sampled(spacing, counts, np.ones(len(curves), dtype=bool))
    np.testing.assert_array_equal(samples.counts, counts)
    np.testing.assert_array_equal(samples.closed, curves.closed)
    for k in range(len(curves)):
        at = np.linspace(0, curves.lengths[k], count)
        np.testing.assert_allclose(samples[k], polyline.resample(curves[k], at), atol=1e-9)
        assert (np.diff(segment[samples.parts[k]]) >= 0).all()
        np.testing.assert_array_equal(samples[k][-1], curves[k][-1])


def test_lengths_and_tangents_of_a_line_and_of_a_circle_are_the_known_ones():
    angles = np.linspace(0, np.pi, 400)
    circle, line = 3 * np.column_stack((np.cos(angles), np.sin(angles))), np.array([[0.0, 0], [1, 0], [4, 0]])
    curves = Curves.of([line, circle])
    np.testing.assert_allclose(curves.lengths, (4, 3 * np.pi), rtol=1e-4)
    np.testing.assert_allclose(curves.tangents[:3], np.tile((1.0, 0), (3, 1)))
    np.testing.assert_allclose(curves.tangents[3:], np.column_stack((-np.sin(angles), np.cos(angles))), atol=5e-3)
    np.testing.assert_allclose(curves.ends(0.3), [(-1, 0), (1, 0), (0, -1), (0, -1)], atol=1e-3)


@given(lines())
def test_segments_lead_from_each_point_but_the_last_of_a_curve(drawn):
    curves = Curves.of(*drawn)
    steps = curves.points[curves.segments + 1] - curves.points[curves.segments]
    for k, part in enumerate(np.split(steps, curves.segment_bounds[1:-1])):
        np.testing.assert_array_equal(part, np.diff(curves[k], axis=0))


@given(lines(), st.randoms())
def test_some_of_the_curves_are_the_same_curves(drawn, random):
    curves = Curves.of(*drawn)
    numbers = np.array(random.sample(range(len(curves)), random.randint(1, len(curves))))
    some = curves.of_numbers(numbers)
    np.testing.assert_array_equal(some.closed, curves.closed[numbers])
    for one, number in zip(some, numbers, strict=True):
        np.testing.assert_array_equal(one, curves[number])


def test_runs_are_those_of_true_values():
    assert runs(np.array([True, True, False, True, False, False, True])) == [(0, 2), (3, 4), (6, 7)]
    assert runs(np.zeros(3, dtype=bool)) == runs(np.zeros(0, dtype=bool)) == []


def test_no_curves_have_no_values():
    curves = Curves.of([])
    assert len(curves) == 0
    assert curves.points.shape == (0, 2)
    assert len(curves.owner) == len(curves.tips) == len(curves.lengths) == 0


def test_points_cannot_be_written():
    given_points = np.zeros((2, 3))
    curves = Curves.of([given_points])
    with pytest.raises(ValueError, match="read-only"):
        curves.points[0] = 1
    given_points[:] = 2
    assert (curves.points == 0).all()


def test_each_value_is_computed_once():
    curves = Curves.of([np.eye(3)])
    assert curves.lengths is curves.lengths
    assert curves.tangents is curves.tangents
    assert curves.owner is curves.owner


def test_a_view_shows_position_and_distance_of_each_point():
    curves = Curves.of([np.array([[0.0, 0, 1], [1, 2, 4]]), np.array([[1.0, 1, 2]])])
    seen = curves.seen_in(Projection.parallel(np.zeros(3), np.eye(3), 10.0))
    np.testing.assert_allclose(seen.points, [(0, 0, 1), (10, 20, 4), (10, 10, 2)])
    np.testing.assert_array_equal(seen.bounds, curves.bounds)


def test_interpolated_values_are_those_of_a_plain_computation():
    rng = np.random.default_rng(0)
    parts, closed = [rng.normal(size=(n, 3)) for n in (5, 9, 2)], np.array([False, True, False])
    curves = Curves.of(parts, closed)
    curve, at = rng.integers(0, 3, (6, 40)), rng.uniform(-3, 12, (6, 40))
    at[0, :5] = np.nan, np.inf, 4.0, 8.0, -8.0
    for index in np.ndindex(curve.shape):
        values, position = parts[curve[index]], at[index]
        count = len(values) - 1
        expected = np.full(3, np.nan)
        if np.isfinite(position) and (closed[curve[index]] or 0 <= position <= count):
            position = position % count if closed[curve[index]] else position
            first = min(int(position), count - 1)
            expected = values[first] * (1 - position + first) + values[first + 1] * (position - first)
        np.testing.assert_allclose(curves.interpolate(curve[index][None], at[index][None])[0], expected, atol=1e-12)
    np.testing.assert_array_equal(curves.interpolate(curve, at)[2, 3], curves.interpolate(curve[2, 3:4], at[2, 3:4])[0])

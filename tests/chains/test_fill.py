"""Filling: gaps closed by segments that follow the arcs."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from doo3d.chains.fill import fill
from doo3d.geometry.assembly import Assembly
from doo3d.geometry.gap_path import gap_path
from doo3d.geometry.polyline import angle, steps, unit

dims = pytest.mark.parametrize("dim", [2, 3])


def row(start, direction, count, dim=3):
    start, direction = (np.pad(np.asarray(v, dtype=float), (0, dim - len(v))) for v in (start, direction))
    return start + np.arange(count + 1)[:, None] * unit(direction)


def assembly(*pieces, closed=False, inside=False):
    pairs = [*pairwise(pieces), *([(pieces[-1], pieces[0])] if closed else [])]
    paths = tuple(gap_path(a[-1], unit(a[-1] - a[-2]), b[0], unit(b[0] - b[1]), inside=inside) for a, b in pairs)
    return Assembly(tuple(pieces), paths, closed)


@dims
def test_a_straight_gap(dim):
    before, after = row((0, 0), (1, 0), 4, dim), row((7.5, 0), (1, 0), 5, dim)
    (path,) = fill([assembly(before, after)], 1.0)
    expected = np.pad(np.append(np.arange(8.0), np.arange(7.5, 13))[:, None], ((0, 0), (0, dim - 1)))
    np.testing.assert_allclose(path.points, expected, atol=1e-9)
    assert path.filled.tolist() == [False] * 4 + [True] * 4 + [False] * 5
    assert not path.closed


@dims
def test_new_segments_follow_the_arc(dim):
    """A quarter turn of radius 6 from end to end: joints on the circle, a segment apart."""
    before, after = row((-4, 0), (1, 0), 4, dim), row((6, 6), (0, 1), 4, dim)
    (path,) = fill([assembly(before, after)], 1.0)
    new = path.points[4:-4]
    center = np.pad([0.0, 6.0], (0, dim - 2))
    np.testing.assert_allclose(np.linalg.norm(new - center, axis=1), 6, atol=2e-3)
    np.testing.assert_allclose(steps(new)[:-1], 1.0, atol=1e-9)
    assert 0 < steps(new)[-1] <= 1 + 1e-9
    assert len(new) == int(6 * np.pi / 2 * 1.002) + 2
    assert path.filled.sum() == len(new) - 1


@pytest.mark.parametrize("seed", range(6))
def test_skew_ends_are_joined_smoothly(seed):
    random = np.random.default_rng(seed)
    before = row((0, 0), random.normal(size=3), 5)
    after = random.normal(size=3) * 8 + row((0, 0), random.normal(size=3), 5)
    (path,) = fill([assembly(before, after)], 1.0)
    np.testing.assert_array_equal(path.points[:6], before)
    np.testing.assert_array_equal(path.points[-6:], after)
    lengths = steps(path.points)
    np.testing.assert_allclose(lengths[5:-6], 1.0, atol=1e-9)
    edges = np.diff(path.points, axis=0)
    whole = lengths > 0.2
    bend = angle(edges[1:], edges[:-1])[whole[1:] & whole[:-1]]
    assert np.degrees(bend).max() < 60


@dims
@pytest.mark.parametrize(("gap", "hidden"), [(0.4, False), (0.99, False), (1.0, True), (3.3, True)])
def test_short_gaps_count_as_seen(dim, gap, hidden):
    before, after = row((0, 0), (1, 0), 3, dim), row((3 + gap, 0), (1, 0), 3, dim)
    (path,) = fill([assembly(before, after)], 1.0)
    assert path.filled.any() == hidden
    assert len(path.filled) == len(path.points) - 1
    if hidden:
        first, last = np.flatnonzero(path.filled)[[0, -1]]
        np.testing.assert_allclose(path.points[first], before[-1])
        np.testing.assert_allclose(path.points[last + 1], after[0])


@dims
def test_three_pieces(dim):
    pieces = row((0, 0), (1, 0), 3, dim), row((5, 0), (1, 0), 2, dim), row((7.2, 0), (1, 0), 3, dim)
    (path,) = fill([assembly(*pieces)], 1.0)
    assert path.filled.tolist() == [False] * 3 + [True] * 2 + [False] * 6
    assert (np.diff(path.points[:, 0]) > 0).all()


@dims
def test_a_ring(dim):
    turn = np.linspace(0, 5.5, 28)
    radius = 0.5 / np.sin(5.5 / 54)
    piece = np.pad(radius * np.column_stack((np.cos(turn), np.sin(turn))), ((0, 0), (0, dim - 2)))
    (path,) = fill([assembly(piece, closed=True)], 1.0)
    assert path.closed
    assert len(path.filled) == len(path.points)
    np.testing.assert_array_equal(path.points[:28], piece)
    assert path.filled.tolist() == [False] * 27 + [True] * (len(path.points) - 27)
    np.testing.assert_allclose(np.linalg.norm(path.points, axis=1), radius, atol=0.05 * radius)
    assert steps(path.points, closed=True).max() <= 1 + 1e-9


@dims
def test_ends_that_touch(dim):
    before, after = row((0, 0), (1, 0), 3, dim), row((3, 0), (1, 0.2), 3, dim)
    (path,) = fill([assembly(before, after)], 1.0)
    assert not path.filled.any()
    assert len(path.filled) == len(path.points) - 1
    np.testing.assert_array_equal(path.points[[0, -1]], [before[0], after[-1]])


def test_the_side_is_chosen():
    before, after = row((-2, 0), (1, 0.6), 3), row((-2, -4), (1, -0.6), 3)[::-1]
    outside, inside = (fill([assembly(before, after, inside=inside)], 1.0)[0] for inside in (False, True))
    assert not np.array_equal(outside.points, inside.points)


@dims
def test_one_piece_is_unchanged(dim):
    piece = row((0, 0), (1, 0), 3, dim)
    (path,) = fill([assembly(piece)], 1.0)
    np.testing.assert_array_equal(path.points, piece)
    assert path.filled.tolist() == [False] * 3


def test_each_assembly_is_a_path():
    assert fill([], 1.0) == []
    assert len(fill([assembly(row((0, 0), (1, 0), 3)), assembly(row((0, 9), (1, 0), 3))], 1.0)) == 2

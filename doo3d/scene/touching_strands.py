"""Strands of a cloud that touch side by side, parted by the normals of their surfaces: those of one tube meet on its axis.

Every point votes for the place one radius along its normal, on either side, and the side with more votes of its neighbors is the
inside (a Hough transform). The votes of one tube meet in a line; those of two tubes that touch meet in two, two radii apart.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..geometry.disjoint_set import group_sums
from ..geometry.radii import STEP_RADII
from ..types import Floats, Ints
from .cloud_facts import sampled

MIN_WIDTH_RATIO, MAX_WIDTH_RATIO = 1.4, 2.4
"""Ratios of widths of the strips of a cloud at which strands may touch side by side: of the usual width (median) to the narrow
one (5th percentile), and of the wide one (90th) to the usual one. The strips of one cable differ by a tenth. A bundle is twice as
wide as a cable, and up to twice as wide again where it parts; where cables cross, strips are three times as wide and more."""

MAX_STRANDS = 4
"""Strands in a strip of the usual width at most: each number costs the time of a vote."""

REACH_RADII, REACH_SPACINGS = 2.5, 3.0
"""Radii, and spacings of the points, along a strand within which points vote together: a cable with a bend of 10 radii is off by
a third of a radius at the end of it."""

PATCH_RADII, PATCH_SPACINGS = 0.7, 1.5
"""Radii, and spacings of the points, across a strand within which points show one normal: 40 degrees of a circle to either side,
and two or three points of a ring of few."""

MEETING_RADII = 0.5
"""Radii across a strand within which votes meet: a quarter of the distance of the axes of strands that touch."""

ONE_SIDED = 0.6
"""Fraction of the points that find more votes behind them than before them, seen from the sensor, from which on all are taken to
vote behind: 0.1 to 0.4 where all sides were seen, 0.8 to 1 where one was."""

MIN_VOTES = 0.5
"""Fraction of the usual number of votes below which a place is between two axes."""


class Votes(NamedTuple):
    """The votes of points for the axis of their strand.

    radius : m. places : (N, 3) m, that each point votes for. along : (N, 3) unit, direction of the strand. pairs : (2, P) indices
    of neighbors, each also of itself. agreement : mean fraction of the neighbors of a point that vote for its place.
    """

    radius: float
    places: Floats
    along: Floats
    pairs: Ints
    agreement: float


class Parted(NamedTuple):
    """Strands that touch side by side; of no points where none do.

    places : (M, 3) m, points moved to the axes. strand : (M,), number of the strand of each, from 0. radius : m.
    """

    places: Floats
    strand: Ints
    radius: float


NOT_TOUCHING = Parted(np.zeros((0, 3)), np.zeros(0, dtype=np.int64), 0.0)


def part_strands(points: Floats, widths: Floats, spacing: float, sensor: Floats) -> Parted:
    """Return the strands of a cloud that touch side by side.

    Parameters
    ----------
    points
        (N, 3) m, on the surface.
    widths
        (K,) m, half-widths of the cloud where it looks like a strip.
    spacing
        m, between neighboring points.
    sensor
        (3,) m, position of the sensor; where it is unknown, that which it has if one camera saw the points.
    """
    narrow, usual, wide = np.quantile(widths, (0.05, 0.5, 0.9)).tolist()
    if not (narrow * MIN_WIDTH_RATIO < usual or usual * MIN_WIDTH_RATIO < wide < usual * MAX_WIDTH_RATIO):
        return NOT_TOUCHING
    sample = sampled(points)
    apart = spacing * math.sqrt(len(points) / len(sample))
    tried = [cast_votes(sample, usual / count, apart, sensor) for count in range(1, MAX_STRANDS + 1)]
    best = max(tried, key=lambda votes: votes.agreement / math.sqrt(votes.radius))
    return NOT_TOUCHING if best is tried[0] else meetings(best)


def cast_votes(points: Floats, radius: float, spacing: float, sensor: Floats) -> Votes:
    """Return the votes of points for axes at a radius, m; the other arguments are as for `part_strands`.

    Points are thinned to half a radius, or half their spacing if that is more, so that each has a thousand neighbors at most.
    """
    cells, cell = np.unique(np.floor(points / (STEP_RADII * max(radius, spacing))), axis=0, return_inverse=True)
    points = group_sums(points, cell.ravel(), len(cells)) / np.bincount(cell.ravel())[:, None]
    near = cKDTree(points).query_pairs(max(REACH_RADII * radius, REACH_SPACINGS * spacing), output_type="ndarray")
    pairs = np.concatenate((near, near[:, ::-1], np.tile(np.arange(len(cells))[:, None], 2))).T
    patch, nowhere = max(PATCH_RADII * radius, PATCH_SPACINGS * spacing), np.zeros_like(points)
    around = _together(points, nowhere, pairs, np.inf)
    normal = np.linalg.eigh(_spread(_together(points, nowhere, pairs, patch), points)[1])[1][..., 0]
    along = np.linalg.eigh((around @ _squares(normal).reshape(-1, 9)).reshape(-1, 3, 3))[1][..., 0]
    mean, spread = _spread(_together(points, along, pairs, patch), points)
    across = np.eye(3) - _squares(along)
    normal = np.linalg.eigh(across @ spread @ across + _squares(along))[1][..., 0]  # 1 m^2 along the strand is the largest
    normal *= np.sign(np.einsum("ij,ij->i", normal, points - sensor))[:, None]
    smooth = points + np.einsum("ij,ij->i", mean - points, normal)[:, None] * normal
    sides = smooth + radius * normal, smooth - radius * normal
    behind, before = (_together(side, along, pairs, MEETING_RADII * radius).sum(axis=1) for side in sides)
    is_behind = (behind >= before) | (np.mean(behind > before) > ONE_SIDED)
    places = np.where(is_behind, *sides)
    sharp = _together(places, along, pairs, MEETING_RADII / 2 * radius)
    return Votes(radius, places, along, pairs, float(np.mean(sharp.sum(axis=1) / around.sum(axis=1))))


def meetings(votes: Votes) -> Parted:
    """Return the places where votes meet: means of neighboring votes, without those between two axes."""
    places, width = votes.places, MEETING_RADII * votes.radius
    for _ in range(2):
        near = _together(places, votes.along, votes.pairs, width)
        shift = np.asarray(near @ places / near.sum(axis=1)) - places
        places = places + shift - np.einsum("ij,ij->i", shift, votes.along)[:, None] * votes.along
    near = _together(places, votes.along, votes.pairs, width)
    count = np.asarray(near.sum(axis=1)).ravel()
    kept = count > MIN_VOTES * np.median(count)
    return Parted(places[kept], connected_components(near[kept][:, kept])[1], votes.radius)


def _together(places: Floats, along: Floats, pairs: Ints, width: float) -> csr_matrix:
    """Return which pairs of N places are nearer to each other than `width` across the strand, (N, N) of 0 and 1."""
    offset = places[pairs[1]] - places[pairs[0]]
    near = np.einsum("ij,ij->i", offset, offset) - np.einsum("ij,ij->i", offset, along[pairs[0]]) ** 2 < width**2
    return csr_matrix((np.ones(np.count_nonzero(near)), pairs[:, near]), (len(places),) * 2)


def _spread(near: csr_matrix, points: Floats) -> tuple[Floats, Floats]:
    """Return the mean, (N, 3), and the covariance, (N, 3, 3), of the points near each of N."""
    shifted = points - points.mean(axis=0)
    mean = np.asarray(near @ np.column_stack((shifted, _squares(shifted).reshape(-1, 9))) / near.sum(axis=1))
    return mean[:, :3] + points.mean(axis=0), mean[:, 3:].reshape(-1, 3, 3) - _squares(mean[:, :3])


def _squares(vectors: Floats) -> Floats:
    """Return the product of each of N vectors with itself, (N, 3, 3)."""
    return vectors[:, :, None] * vectors[:, None]

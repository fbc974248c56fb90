"""Samples along the paths of a frame, close together, at which the axis and the radius of the object are estimated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...geometry.radii import STEP_RADII
from ...kernels import polyline_lengths, polyline_tangents, sample_polylines
from ...types import Bools, Floats, Ints, Path

WINDOW_RADII = 1.0
"""Radii on either side of a sample from which its estimate is taken."""

MIN_SAMPLES = 4
"""Samples of a path at least: tangents and second differences need as many."""


@dataclass(frozen=True)
class Samples:
    """S samples along all paths of a frame, at which the axis and the radius of the object are estimated.

    The samples are listed path by path, and in order along each path.

    Attributes
    ----------
    positions
        (S, D) m, D = 3 (in 2-D: px, D = 2).
    path
        (S,) int, index of the path that each sample lies on.
    filled
        (S,) bool, True for a sample in a gap that was filled.
    closed
        for each path, True for a ring, on which the last sample is followed by the first.
    radius
        (S,) m (px in 2-D), radius of the whole path that the sample lies on.
    radii
        (S,) m (px in 2-D), radius at the sample itself.
    window_half
        number of samples on either side of a sample whose measurements are pooled with its own.
    spacing
        m (px in 2-D), approximate distance of neighboring samples along a path; less on very short paths.
    """

    positions: Floats
    path: Ints
    filled: Bools
    closed: tuple[bool, ...]
    radius: Floats
    radii: Floats
    window_half: int
    spacing: float

    @cached_property
    def bounds(self) -> Ints:
        """The first sample of each of P paths, and the number of samples: (P + 1,)."""
        return np.searchsorted(self.path, np.arange(len(self.closed) + 1))

    def of_path(self, number: int) -> slice:
        """Return the slice that selects the samples of path `number` (its index) in the arrays over all samples."""
        return slice(*self.bounds[number : number + 2].tolist())

    def tangents(self) -> Floats:
        """Return the unit tangent of the path at each of the S samples, (S, 3), in 2-D (S, 2), towards higher sample indices."""
        return polyline_tangents(self.positions, self.bounds, np.array(self.closed))


def sample_paths(paths: Sequence[Path], radius: float, segment_length: float) -> Samples:
    """Take evenly spaced samples along each path, about 0.5 radii apart, or half a segment if that is less.

    Parameters
    ----------
    paths
        polylines along the objects, m (px in 2-D); at least one.
    radius
        radius of the objects, m (px in 2-D), which every sample gets at first.
    segment_length
        m (px in 2-D), length of the segments of the chains to be laid.

    Returns
    -------
    The samples of all paths, at least four per path. Both ends of an open path are samples.
    """
    spacing = min(STEP_RADII * radius, segment_length / 2)
    closed = np.array([path.closed for path in paths])
    lines = [np.concatenate((path.points, path.points[:1])) if path.closed else path.points for path in paths]
    points, bounds = np.concatenate(lines), np.cumsum([0, *map(len, lines)])
    length = polyline_lengths(points, bounds)
    counts = np.maximum(MIN_SAMPLES, np.rint(length / spacing).astype(int) + 1)
    positions, segment = sample_polylines(points, bounds, length / (counts - ~closed), counts, ~closed)
    number = np.repeat(np.arange(len(paths)), counts)
    filled = [
        np.zeros(len(line) - 1, dtype=bool) if path.filled is None else path.filled
        for path, line in zip(paths, lines, strict=True)
    ]
    return Samples(
        positions,
        number,
        np.concatenate(filled)[(bounds[:-1] - np.arange(len(paths)))[number] + segment],
        tuple(path.closed for path in paths),
        np.full(len(positions), radius),
        np.full(len(positions), radius),
        round(WINDOW_RADII * radius / spacing),
        spacing,
    )

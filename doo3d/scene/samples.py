"""Samples along the paths of a frame, close together, at which the axis and the radius of the object are estimated."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.curves import Curves
from ..geometry.limits import MAX_CELLS
from ..geometry.radii import STEP_RADII
from ..types import Bools, Floats, Path

MIN_SAMPLES = 4
"""Samples of a path at least: tangents and second differences need as many."""


@dataclass(frozen=True, eq=False)
class Samples:
    """S samples along all paths of a frame, at which the axis and the radius of the object are estimated.

    Attributes
    ----------
    curves
        the samples as curves, one per path, m (px in 2-D). The last sample of a ring does not repeat the first.
    filled
        (S,) bool, True for a sample in a gap that was filled.
    radius
        (S,) m (px in 2-D), radius of the whole path that the sample lies on.
    radii
        (S,) m (px in 2-D), radius at the sample itself.
    window_half
        number of samples on either side of a sample whose measurements are pooled with its own: up to a radius away.
    spacing
        m (px in 2-D), approximate distance of neighboring samples along a path; less on very short paths.
    """

    curves: Curves
    filled: Bools
    radius: Floats
    radii: Floats
    window_half: int
    spacing: float


def sample_paths(paths: Sequence[Path], radius: float, segment_length: float) -> Samples:
    """Take evenly spaced samples along each path, about 0.5 radii apart, or half a segment if that is less.

    They are farther apart where they would be more than a million, of which each takes the memory of two cells.

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
    lines = [np.concatenate((path.points, path.points[:1])) if path.closed else path.points for path in paths]
    curves = Curves.of(lines, [path.closed for path in paths])
    spacing = max(min(STEP_RADII * radius, segment_length / 2), 2 * float(curves.lengths.sum()) / MAX_CELLS)
    counts = np.maximum(MIN_SAMPLES, np.rint(curves.lengths / spacing).astype(int) + 1)
    samples, segment = curves.sampled(curves.lengths / (counts - ~curves.closed), counts, ~curves.closed)
    filled = [
        np.zeros(len(line) - 1, dtype=bool) if path.filled is None else path.filled
        for path, line in zip(paths, lines, strict=True)
    ]
    return Samples(
        samples,
        np.concatenate(filled)[curves.segment_bounds[samples.owner] + segment],
        np.full(len(segment), radius),
        np.full(len(segment), radius),
        round(radius / spacing),
        spacing,
    )

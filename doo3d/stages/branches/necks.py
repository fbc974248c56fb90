"""Necks: a strand that only touches another ends in a tip, which is narrower than the strand right before the contact.

A branch keeps its width until it runs into its trunk. So the width of the object in the image is measured in cuts along the
trunk, from the trunk's surface outwards: where it falls well below the branch's diameter, open surface shows beside a tip.
"""

from __future__ import annotations

import numpy as np

from ...geometry.polyline import unit
from ...types import Bools, Floats
from ...visibility import Visibility
from .strands import Strand

FIRST_CUT, NECK_END, LAST_CUT = 0.6, 2.5, 6.0
"""The cuts begin at this distance from the trunk's axis, radii of the trunk. A neck is looked for up to the second, the width of
the branch is measured from there up to the third: radii of the branch beyond the trunk's surface."""

CELL_RADII, CELLS = 0.125, 16
"""Radii of the branch between cuts and between the positions of a cut, and positions of a cut to each side of the axis."""

MAX_OFFSET_CELLS = 8
"""Positions beside the branch's axis within which a cut must meet the object, or it shows a gap."""

IN_FRONT_RADII = 2.5
"""Radii of the trunk by which an occluder is nearer than the axes: stereo depth beside a strand is often that of its surface."""

UNSURE_PIXELS = 0.75
"""Pixels by which a branch may seem too narrow: the border of a mask is that uncertain."""


def neck_share(
    branch: Floats, radius: float, trunk: Strand, at: float, visibility: Visibility, viewpoint: Floats | None
) -> float:
    """Return by how much a strand narrows before it meets another: the open share of its diameter in its narrowest cut.

    Parameters
    ----------
    branch
        (P, D) m (px in 2-D), P >= 2 points along the strand's axis, beginning with the end that meets the other strand.
    radius
        of the strand, m (px in 2-D).
    trunk, at
        the other strand, and the arc length of the place on it, m (px in 2-D).
    visibility
        tells where the camera looks past the object.
    viewpoint
        (3,) m, where the camera is; None in 2-D, and where it is unknown.

    Returns
    -------
    0 for a strand that keeps its width, 1 for one that ends before it reaches the other.
    """
    place = trunk.at(at)
    i = int(np.abs(trunk.along - at).argmin())
    surface = float(trunk.radii[i])
    line = np.concatenate((np.zeros((1, len(place))), branch - place))
    along = trunk.points[min(i + 3, len(trunk.points) - 1)] - trunk.points[max(i - 3, 0)]
    if viewpoint is not None:
        towards = unit(place - viewpoint)
        line, along = (vectors - (vectors @ towards)[..., None] * towards for vectors in (line, along))
    along = unit(along)
    outside = np.flatnonzero(np.linalg.norm(line, axis=1) > surface + radius)
    if not len(outside):
        return 0.0
    line = np.concatenate((line[:1], line[outside[0] :]))
    across = unit(line[1] - (line[1] @ along) * along)
    height, shift = line @ across, line @ along
    rising = np.concatenate(([True], np.diff(np.maximum.accumulate(height)) > 0))
    cell = CELL_RADII * radius
    cuts = np.arange(FIRST_CUT * surface, min(surface + LAST_CUT * radius, height.max()), cell)
    is_near = cuts < surface + NECK_END * radius
    if not is_near.any():
        return 0.0
    middle = np.interp(cuts, height[rising], shift[rising])
    beside = middle[:, None] + cell * np.arange(-CELLS, CELLS + 1)
    points = place + cuts[:, None, None] * across + beside[..., None] * along
    is_beside = visibility.is_beside(points.reshape(-1, len(place)), IN_FRONT_RADII * surface).reshape(beside.shape)
    width = cell * np.array([_run_length(row) for row in ~is_beside])
    full = 2 * radius if is_near.all() else min(2 * radius, float(np.median(width[~is_near])))
    missing = full - width[is_near].min() - UNSURE_PIXELS * visibility.pixel_at(place)
    return float(np.clip(missing / (2 * radius), 0, 1))


def _run_length(is_object: Bools) -> int:
    """Return how many positions in a row of a cut are of the object, in the row nearest to the branch's axis."""
    near = np.flatnonzero(is_object[CELLS - MAX_OFFSET_CELLS : CELLS + MAX_OFFSET_CELLS + 1])
    if not len(near):
        return 0
    start = CELLS - MAX_OFFSET_CELLS + int(near[np.abs(near - MAX_OFFSET_CELLS).argmin()])
    gaps = np.flatnonzero(~is_object)
    return int(gaps[gaps > start].min(initial=len(is_object)) - gaps[gaps < start].max(initial=-1) - 1)

"""Measure necks: a tip that only touches a strand is narrower at the contact than before it, a branch keeps its width.

The width of the object in the image is measured in cuts parallel to the trunk, from the trunk's surface outwards. A width well
below the diameter of the branch shows the background beside a tip.
"""

from __future__ import annotations

import numpy as np

from ...geometry.curves import runs
from ...geometry.polyline import unit
from ...types import Bools, Floats
from ...visibility import Visibility
from .strands import ARM_RADII, INSIDE_DEPTH_RADII, SampledChain, across_view

FIRST_CUT, NECK_END, LAST_CUT = 0.6, 2.5, 6.0
"""Distances of the cuts: the first cut from the trunk's axis, in radii of the trunk; and from the trunk's surface, in radii of
the branch, the end of the range of necks, and the end of the range in which the width of the branch is measured."""

CELL_RADII, CELLS = 0.125, 32
"""Spacing of the cuts, and of the positions of a cut, in radii of the branch; and number of positions on each side of the axis.
A cut that does not meet the object in the inner half of its positions shows a gap: ends are uncertain."""


def neck_share(
    branch: Floats, radius: float, trunk: SampledChain, at: float, visibility: Visibility, viewpoint: Floats | None
) -> float:
    """Return the share of its diameter that a branch lacks in its narrowest cut before it meets a trunk.

    Parameters
    ----------
    branch
        (P, D) m (px in 2-D), P >= 2 points along the axis of the branch, beginning with the end at the trunk.
    radius
        radius of the branch, m (px in 2-D).
    trunk, at
        the trunk, and the arc length on it at which the branch ends, m (px in 2-D).
    visibility
        the camera's view, which shows the background beside the object.
    viewpoint
        (3,) m, where the camera is; None in 2-D, and where it is unknown.

    Returns
    -------
    0 for a branch that keeps its width, 1 for one that ends before the trunk.
    """
    place = trunk.at(at)
    surface = float(trunk.radii[int(np.abs(trunk.along - at).argmin())])
    towards = None if viewpoint is None else unit(place - viewpoint)
    near = branch[: _samples_of(branch, trunk.radius_near(at, 1) + ARM_RADII[1] * radius)]
    line, axis = (across_view(points - place, towards) for points in (near, trunk.points))
    inside = np.flatnonzero(np.linalg.norm(line, axis=1) <= surface + radius)
    line = line[inside[-1] + 1 if len(inside) else 0 :]
    if not len(line):
        return 0.0
    nearest = np.linalg.norm(line[:, None] - axis[None], axis=2).argmin(axis=1)
    height = np.append(0.0, np.linalg.norm(line - axis[nearest], axis=1))
    shift = np.append(0.0, trunk.along[nearest] - at)
    rising = np.concatenate(([True], np.diff(np.maximum.accumulate(height)) > 0))
    cell = CELL_RADII * radius
    cuts = np.arange(FIRST_CUT * surface, min(surface + LAST_CUT * radius, height.max()), cell)
    is_near = cuts < surface + NECK_END * radius
    if not is_near.any():
        return 0.0
    middle = np.interp(cuts, height[rising], shift[rising])
    arcs = at + middle[:, None] + cell * np.arange(-CELLS, CELLS + 1)
    feet, across = _beside(trunk.along, axis, arcs, line[0], towards)
    points = place + feet + cuts[:, None, None] * across
    is_beside = visibility.model.is_beside(points.reshape(-1, len(place)), INSIDE_DEPTH_RADII * surface).reshape(arcs.shape)
    width = cell * np.array([_run_length(row) for row in ~is_beside])
    full = 2 * radius if is_near.all() else min(2 * radius, float(np.median(width[~is_near])))
    missing = full - width[is_near].min() - visibility.model.pixel_at(place)
    return float(np.clip(missing / (2 * radius), 0, 1))


def _samples_of(line: Floats, length: float) -> int:
    """Return how many of the evenly spaced points of a line make up a length, 2 at least."""
    return max(2, round(length / max(float(np.linalg.norm(line[1] - line[0])), 1e-12)))


def _beside(along: Floats, axis: Floats, arcs: Floats, side: Floats, towards: Floats | None) -> tuple[Floats, Floats]:
    """Return the points of an axis at arc lengths, and the unit normals there to the side on which a point lies.

    Parameters
    ----------
    along, axis
        (S,) arc lengths and (S, D) points of the axis.
    arcs
        (C, N) arc lengths asked for; the ends of the axis go on straight.
    side
        (D,) the point to whose side the normals point.
    towards
        (3,) unit, the view direction, which normals have no part in; None in 2-D, and where it is unknown.

    Returns
    -------
    feet, normals : (C, N, D).
    """
    clipped = np.clip(arcs, along[0], along[-1])
    tangents = unit(np.gradient(axis, axis=0))
    feet, tangent = (np.stack([np.interp(clipped, along, each) for each in values.T], axis=-1) for values in (axis, tangents))
    tangent = unit(tangent)
    feet = feet + (arcs - clipped)[..., None] * tangent
    foot = int(np.linalg.norm(axis - side, axis=1).argmin())
    across = side - axis[foot]
    if towards is not None:
        normals = np.cross(towards, tangent)
    elif axis.shape[1] == 2:
        normals = np.stack((-tangent[..., 1], tangent[..., 0]), axis=-1)
    else:
        normals = across - (tangent @ across)[..., None] * tangent
    return feet, unit(normals) * np.where(normals @ across < 0, -1.0, 1.0)[..., None]


def _run_length(is_object: Bools) -> int:
    """Return how many positions in a row of a cut are of the object: the longest row that lies at the branch's axis."""
    near = [end - first for first, end in runs(is_object) if first <= CELLS + CELLS // 2 and end > CELLS - CELLS // 2]
    return max(near, default=0)

"""Free ends extended along the seen surface to where the object ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.blocks import Blocks
from ...geometry.polyline import unit
from ...geometry.radii import OWN_RADII
from ...kernels import nearest, points_near_line
from ...types import Floats, Path
from .samples import Samples

MAX_END_EXTENSION = 6.0
"""Radii by which an end may be extended to the last surface point: thinning and trimming shorten it by less."""


@dataclass(frozen=True)
class SurfaceAhead:
    """N surface points near the tangent line at a free end of a path, ahead of the end and a little behind it.

    Attributes
    ----------
    axial
        (N,) m (px in 2-D), position of each point along the tangent, ascending: 0 at the end, positive outside the path.
    lateral
        (N,) m (px in 2-D), distance of each point from the tangent line.
    tangent
        (D,) unit, D = 2 or 3, tangent at the end, pointing out of the path.
    """

    axial: Floats
    lateral: Floats
    tangent: Floats


def free_ends(samples: Samples, path: int) -> tuple[tuple[int, int], ...]:
    """Return the free ends of one path as (sample index, direction) pairs; an empty tuple for a ring.

    The direction is that of the sample indices from the end into the path: 1 at the path's first sample, -1 at its last.

    Parameters
    ----------
    samples
        samples along all paths.
    path
        index of the path.
    """
    part = samples.of_path(path)
    return () if samples.closed[path] else ((part.start, 1), (part.stop - 1, -1))


def surface_ahead(samples: Samples, end: int, inwards: int, surface: Blocks, spacing: float) -> SurfaceAhead:
    """Find the surface points near the tangent line at a free end of a path, up to the first stretch ahead without points.

    That stretch is a radius long, or two `spacing` if that is more. Points are taken up to 6 radii from the end along each
    coordinate axis and up to 1.6 radii from the tangent line. Points that are nearer to another path, or to a part of the path
    far from the end, are left out.

    Parameters
    ----------
    samples
        samples along all paths.
    end
        index of the sample at the end.
    inwards
        direction from the end into its path: 1 towards higher sample indices, -1 towards lower.
    surface
        the N surface points, (N, D) m, D = 3 (in 2-D: px, D = 2).
    spacing
        m (px in 2-D), distance up to which gaps between neighboring surface points are normal.

    Returns
    -------
    The points found, in the order of their position along the tangent; no points if there is no surface.
    """
    tip, radius = samples.positions[end], float(samples.radius[end])
    tangent = unit(tip - samples.position_inside(end, inwards, 2 * radius))
    reach = MAX_END_EXTENSION * radius
    near, axial, lateral = points_near_line(
        surface.points[surface.within(tip - reach, tip + reach)], tip, tangent, reach, OWN_RADII * radius
    )
    if not len(near):
        return SurfaceAhead(np.zeros(0), np.zeros(0), tangent)
    # the end itself is a sample, so the nearest of each point lies no farther from it than that
    margin = float(np.linalg.norm(near - tip, axis=1).max())
    around = samples.blocks.within(near.min(axis=0) - margin, near.max(axis=0) + margin)
    own = np.abs(around[nearest(near, samples.positions[around], 2 * radius, False)[1]] - end) <= 3 * samples.window_half + 3
    axial, lateral = axial[own], lateral[own]
    order = np.argsort(axial)
    axial, lateral = axial[order], lateral[order]
    empty = np.flatnonzero((np.diff(axial) > max(radius, 2 * spacing)) & (axial[1:] > 0))
    stop = empty[0] + 1 if len(empty) else len(axial)
    return SurfaceAhead(axial[:stop], lateral[:stop], tangent)


def extend_to_surface(paths: Sequence[Path], samples: Samples, points: Floats, spacing: float) -> list[Path]:
    """Extend the free ends of paths straight ahead, as far as the surface of the object reaches.

    Surface is looked for up to 6 radii from the end along each coordinate axis, as `surface_ahead` finds it.

    Parameters
    ----------
    paths
        polylines along the seen surface, m (px in 2-D).
    samples
        samples along these paths.
    points
        (N, D) m, D = 3 (in 2-D: px, D = 2), the N surface points.
    spacing
        m (px in 2-D), distance up to which gaps between neighboring surface points are normal.

    Returns
    -------
    The paths in the same order, with one point more at each end that was extended.
    """
    result, surface = [], Blocks(points)
    for p, path in enumerate(paths):
        points_of_path, filled, joins = path.points, path.filled, path.joins
        for end, inwards in free_ends(samples, p):
            ahead = surface_ahead(samples, end, inwards, surface, spacing)
            if len(ahead.axial) and ahead.axial[-1] > 0:
                tip = samples.positions[end] + ahead.axial[-1] * ahead.tangent
                points_of_path = np.concatenate(([tip], points_of_path) if inwards == 1 else (points_of_path, [tip]))
                joins = tuple((step + (inwards == 1), confidence) for step, confidence in joins)
                if filled is not None:
                    filled = np.concatenate(([False], filled) if inwards == 1 else (filled, [False]))
        result.append(Path(points_of_path, path.closed, filled, joins))
    return result

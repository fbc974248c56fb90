"""Free ends extended to where the object ends: along the seen surface, and to visible fragments beyond an occluder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.blocks import Blocks
from ...geometry.polyline import unit
from ...kernels import nearest, points_near_line
from ...types import Bools, Floats, Ints, Path
from ...visibility import PointVisibility, Visibility
from .cross_sections import thinned
from .samples import Samples

MAX_END_EXTENSION = 6.0
"""Radii by which an end may be extended to the last surface point: thinning and trimming shorten it by less."""

SURFACE_WIDTH_RADII = 1.6
"""Radii from the tangent at an end within which surface ahead of it belongs to it."""

MAX_FRAGMENT_GAP = 8.0
"""Radii beyond a hidden end within which a visible fragment of surface is attached to it."""

OWN_SURFACE_RADII = 1.5
"""Radii from a path within which surface belongs to it; the rest may be fragments."""

FRAGMENT_OFFSET_RADII, FRAGMENT_OFFSET_SLOPE = 0.9, 0.25
"""Lateral offset, in radii, that a fragment may have from the tangent at the end, and how much more per radius ahead."""

MIN_FRAGMENT_RADII = 0.6
"""Radii of length that a fragment must have."""

FRAGMENT_TANGENT_RADII = 3.0
"""Radii of path from which the tangent at a hidden end is taken."""

MIN_FRAGMENT_FILL = 0.25
"""Fraction of a fragment's area that must have depth readings."""

MIN_GAP_HIDDEN = 0.3
"""Fraction of the gap before a fragment in front of which something nearer must have been seen."""

MIN_FRAGMENT_POINTS = 4

GAP_CHECKS = 10
"""Points of the straight line across the gap at which visibility is asked for."""


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
        surface.points[surface.within(tip - reach, tip + reach)], tip, tangent, reach, SURFACE_WIDTH_RADII * radius
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


@dataclass(frozen=True)
class _Fragment:
    """A visible fragment ahead of a hidden end.

    path, first : the end: of which path, and whether it is the first. start, stop : (D,) m, the fragment's two ends.
    points : indices of its surface points. offset : m, how far off it lies, the less the better.
    """

    path: int
    first: bool
    start: Floats
    stop: Floats
    points: Ints
    offset: float


def attach_fragments(paths: list[Path], samples: Samples, points: Floats, visibility: Visibility | None) -> list[Path]:
    """Attach visible fragments of the object to the free ends of paths, across hidden gaps.

    A fragment is a piece of surface up to 8 radii ahead of an end, too short for a chain of its own. A gap is hidden if the
    camera saw something nearer in front of at least 0.3 of it, and free space nowhere in it. The nearest pair of end and fragment
    is joined first. An end takes at most one fragment.

    Parameters
    ----------
    paths
        polylines along the seen surface, m in the camera's optical frame.
    samples
        samples along these paths.
    points
        (N, 3) m, the N surface points in the same frame.
    visibility
        tells what is hidden. If it is None or has no single depth image (in 2-D, for a fused cloud), the paths are returned
        unchanged.

    Returns
    -------
    The paths in the same order. An end that took a fragment has two more points, the near and the far end of the fragment; the
    step across the gap is marked in `filled`.
    """
    if visibility is None or visibility.depth is None:
        return paths
    surface = thinned(points)
    radius = float(samples.radius[0])
    free = surface[np.isinf(nearest(surface, samples.positions, OWN_SURFACE_RADII * radius, True)[0])]
    points_per_sample = len(points) / max(1, len(surface))
    available = np.ones(len(free), dtype=bool)
    ends = [(p, first) for p, path in enumerate(paths) if not path.closed for first in (True, False)]
    while available.any():
        fragments = [_fragment(*end, samples, free, available, points_per_sample, visibility) for end in ends]
        candidates = [fragment for fragment in fragments if fragment is not None]
        if not candidates:
            break
        best = min(candidates, key=lambda fragment: fragment.offset)
        available[best.points] = False
        ends.remove((best.path, best.first))
        paths = [_with_fragment(path, best) if p == best.path else path for p, path in enumerate(paths)]
    return paths


def _fragment(
    p: int, first: bool, samples: Samples, free: Floats, available: Bools, points_per_sample: float, visibility: Visibility
) -> _Fragment | None:
    """Return the fragment ahead of one end of path `p`, or None."""
    part = samples.of_path(p)
    end, inwards = (part.start, 1) if first else (part.stop - 1, -1)
    tip, radius = samples.positions[end], float(samples.radius[end])
    tangent = unit(tip - samples.position_inside(end, inwards, FRAGMENT_TANGENT_RADII * radius))
    axial = (free - tip) @ tangent
    lateral = np.linalg.norm(free - tip - axial[:, None] * tangent, axis=1)
    near = available & (axial > radius / 2) & (axial < MAX_FRAGMENT_GAP * radius)
    near &= lateral < FRAGMENT_OFFSET_RADII * radius + FRAGMENT_OFFSET_SLOPE * axial
    index = np.flatnonzero(near)
    if len(index) < MIN_FRAGMENT_POINTS:
        return None
    index = index[np.argsort(axial[index], kind="stable")]
    gap = np.flatnonzero(np.diff(axial[index]) > radius)
    index = index[: gap[0] + 1] if len(gap) else index
    start, stop = float(axial[index[0]]), float(axial[index[-1]])
    assert visibility.camera is not None
    pitch = tip[2] / visibility.camera.fx
    area = 2 * radius * (stop - start) / pitch**2
    if stop - start < MIN_FRAGMENT_RADII * radius or points_per_sample * len(index) < MIN_FRAGMENT_FILL * area:
        return None
    seen = visibility.classify(tip + np.linspace(0, start, GAP_CHECKS + 2)[1:-1, None] * tangent)
    if (seen == PointVisibility.FREE).any() or (seen == PointVisibility.HIDDEN).mean() < MIN_GAP_HIDDEN:
        return None
    at = axial[index]
    near_end, far_end = free[index[at < start + 0.7 * radius]].mean(axis=0), free[index[at > stop - 0.7 * radius]].mean(axis=0)
    direction = unit(far_end - near_end) if stop - start > radius else tangent
    offset = start + 2 * float(lateral[index].mean())
    return _Fragment(p, first, near_end, far_end + 0.3 * radius * direction, index, offset)


def _with_fragment(path: Path, fragment: _Fragment) -> Path:
    filled = np.zeros(len(path.points) - 1, dtype=bool) if path.filled is None else path.filled
    if fragment.first:
        joins = tuple((step + 2, confidence) for step, confidence in path.joins)
        points = np.concatenate(([fragment.stop, fragment.start], path.points))
        return Path(points, False, np.concatenate(([False, True], filled)), joins)
    points = np.concatenate((path.points, [fragment.start, fragment.stop]))
    return Path(points, False, np.concatenate((filled, [True, False])), path.joins)

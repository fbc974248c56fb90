"""Free ends extended along the seen surface to where the object ends."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .. import kernels
from ..geometry.polyline import unit
from ..geometry.radii import OWN_RADII
from ..scene.samples import Samples
from ..types import Floats, Path

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
    tip
        (D,) m (px in 2-D), D = 2 or 3, position of the end.
    tangent
        (D,) unit, tangent at the end, pointing out of the path.
    """

    axial: Floats
    lateral: Floats
    tip: Floats
    tangent: Floats

    @property
    def length(self) -> float:
        """The position along the tangent of the farthest point, m (px in 2-D); negative behind the end, 0 without points."""
        return float(self.axial[-1]) if len(self.axial) else 0.0

    @property
    def farthest(self) -> Floats:
        """The position on the tangent line beside the farthest point: (D,) m (px in 2-D)."""
        return np.asarray(self.tip + self.length * self.tangent)


def surface_ahead(samples: Samples, points: Floats, spacing: float) -> list[tuple[SurfaceAhead, SurfaceAhead] | None]:
    """Find the surface points near the tangent line at each free end of paths, up to the first stretch ahead without points.

    That stretch is a radius long, or two `spacing` if that is more. Points are taken up to 6 radii from the end along each
    coordinate axis and up to 1.5 radii from the tangent line. Points that are nearer to another path, or to a part of the path
    far from the end, are left out.

    Parameters
    ----------
    samples
        samples along all paths.
    points
        (N, D) m, D = 3 (in 2-D: px, D = 2), the N surface points.
    spacing
        m (px in 2-D), distance up to which gaps between neighboring surface points are normal.

    Returns
    -------
    For each path the points at its first end and at its last; None for a ring.
    """
    is_open = ~samples.curves.closed
    first, last = samples.curves.bounds[:-1][is_open], samples.curves.bounds[1:][is_open] - 1
    radius = samples.radius[first]
    inside = np.maximum(1, np.rint(2 * radius / samples.spacing).astype(int))
    ends = np.column_stack((first, last)).ravel()
    inner = np.column_stack((np.minimum(first + inside, last), np.maximum(last - inside, first))).ravel()
    tangents, radius = unit(samples.curves.points[ends] - samples.curves.points[inner]), np.repeat(radius, 2)
    window = 3 * samples.window_half + 3
    max_gap = np.maximum(radius, 2 * spacing)
    axial, lateral, bounds = kernels.surface_ahead(
        points, samples.curves.points, ends, tangents, MAX_END_EXTENSION * radius, OWN_RADII * radius, max_gap, window
    )
    found = (
        SurfaceAhead(axial[a:b], lateral[a:b], tip, tangent)
        for (a, b), tip, tangent in zip(itertools.pairwise(bounds.tolist()), samples.curves.points[ends], tangents, strict=True)
    )
    return [None if closed else (next(found), next(found)) for closed in samples.curves.closed.tolist()]


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
    ahead = surface_ahead(samples, points, spacing)
    return [path if ends is None else _extended(path, *ends) for path, ends in zip(paths, ahead, strict=True)]


def _extended(path: Path, first: SurfaceAhead, last: SurfaceAhead) -> Path:
    """Return a path with a point more at each end that surface lies ahead of."""
    points, filled, joins = path.points, path.filled, path.joins
    if first.length > 0:
        points, joins = np.concatenate(([first.farthest], points)), tuple((step + 1, confidence) for step, confidence in joins)
        filled = None if filled is None else np.concatenate(([False], filled))
    if last.length > 0:
        points = np.concatenate((points, [last.farthest]))
        filled = None if filled is None else np.concatenate((filled, [False]))
    return Path(points, path.closed, filled, joins)

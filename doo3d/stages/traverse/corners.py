"""Cut paths at corners that the object cannot have: where the end of one strand touches another from the side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d

from ...geometry.polyline import angle, arc_length, resample, steps, unit
from ...types import Camera, Floats, Ints, Path
from .. import FrameContext

SAMPLE_RADII = 0.5
"""Radii between the samples at which the turn of a path is measured."""

ARM_RADII = 2.5
"""Radii of path before and after a sample whose directions are compared: the skeleton rounds the corner of a T over so much, and
turns by 60 degrees there instead of 90."""

MIN_ARM_VOXELS = 5.0
"""Voxels (pixels in 2-D) of an arm at least: over less, the steps of the skeleton are turns."""

MIN_CORNER_DEGREES, MAX_CORNER_DEGREES = 45.0, 95.0
"""Degrees; no smaller turn over the arms is the corner of a T: a bend of a radius of 3 radii has 48. No larger one is either:
it is the fork of two strands that run on side by side, where `fit` ends a chain."""

BENDING_PERCENTILE, CORNER_RATIO = 90.0, 1.8
"""Percentile of the turns of all paths that stands for the object's own bending, and how many times that a corner turns by."""

MAX_WAIT_RADII = 15.0
"""Radii from the corner up to which the end of a path may wait that continues an arm: the width of a few strands."""

MAX_WAIT_DEGREES = 25.0
"""Degrees at most between an arm and the straight line from it to the end that waits, and between that and its path."""

CLEARANCE_RADII = 2.2
"""Radii between the two arms of a corner up to which both are cut, since their surfaces touch there."""

MAX_CUT_RADII = 2.0
"""Radii cut at most of each arm."""

CLEAR_STEP_RADII = 0.25
"""Radii of the arms between the places where their distance is measured."""


class CutPaths(NamedTuple):
    """Paths without corners.

    Attributes
    ----------
    paths
        the given paths in their order, those with corners in parts.
    corners
        number of corners cut.
    length
        m (px in 2-D), length cut off at the corners.
    """

    paths: list[Path]
    corners: int
    length: float


def cut_corners(paths: list[Path], context: FrameContext) -> CutPaths:
    """Cut paths at sharp corners beyond which the end of a path continues one of the arms straight.

    The end of a strand that touches another from the side may hide the rest of that strand, and the skeleton then runs round the
    corner as one path. The turn at a sample is the angle between the straight lines over 2.5 radii of path before and after it.
    It is measured in space and, in a frame, in the image too, and the smaller turn counts: depth noise bends paths along the line
    of sight, and a slope bends them in the image. A corner is a turn of 45 to 95 degrees that is over 1.8 times what the paths of
    the frame turn by elsewhere (90th percentile), so a soft object keeps its tight bends. Merging decides how the parts go on.

    Parameters
    ----------
    paths
        polylines along the skeleton, m (px in 2-D).
    context
        the data of the frame; radius, voxel size and camera are used.
    """
    radius, camera = context.radius, context.foreground.camera
    arm = max(ARM_RADII * radius, MIN_ARM_VOXELS * context.voxel)
    spacing = SAMPLE_RADII * radius
    views = [_view(path.points, camera) for path in paths]
    turns = [_turns(path, view, spacing, arm) for path, view in zip(paths, views, strict=True)]
    every = np.concatenate([np.zeros(0), *turns])
    if not len(every) or every.max() <= np.radians(MIN_CORNER_DEGREES):
        return CutPaths(paths, 0, 0.0)
    limit = max(np.radians(MIN_CORNER_DEGREES), CORNER_RATIO * float(np.percentile(every, BENDING_PERCENTILE)))
    cut: list[Path] = []
    corners, length = 0, 0.0
    ends = _Ends.of(views, [path.closed for path in paths], arm)
    for path, view, turn in zip(paths, views, turns, strict=True):
        at = _peaks(turn, limit, math.ceil(arm / spacing), path.closed) * spacing
        reach = MAX_WAIT_RADII * radius
        at = at[[any(ends.wait_beyond(*two, reach) for two in _arms(view, corner, arm, path.closed)) for corner in at]]
        parts = [path]
        if len(at):
            ring = [*range(len(view)), *([0] if path.closed else [])]
            in_view, in_space = arc_length(view[ring]), arc_length(path.points[ring])
            parts = _without_corners(path, np.asarray(np.interp(at, in_view, in_space)), radius)
        cut += parts
        corners += len(at)
        length += _length(path) - sum(map(_length, parts)) if len(at) else 0.0
    return CutPaths(cut, corners, length)


def _length(path: Path) -> float:
    return float(steps(path.points, path.closed).sum())


def _view(points: Floats, camera: Camera | None) -> Floats:
    """Return the points (P, 3) m as they are seen, (P, 2) m at their median depth; without a camera the points themselves."""
    if camera is None:
        return points
    return np.asarray(points[:, :2] / points[:, 2:] * np.median(points[:, 2]))


def _turns(path: Path, view: Floats, spacing: float, arm: float) -> Floats:
    """Return the turn in radians at samples so far apart along a path in the view, the first at its start; 0 near an end."""
    ring = [*range(len(view)), *([0] if path.closed else [])]
    along = arc_length(view[ring])
    total = float(along[-1])
    at = np.arange(0.0, total, spacing)
    if total < 4 * arm:
        return np.zeros(len(at))
    before, after = (at - arm) % total, (at + arm) % total
    inside = np.ones(len(at), dtype=bool) if path.closed else (at >= 2 * arm) & (at + 2 * arm <= total)
    turns = []
    for line in (path.points,) if view is path.points else (path.points, view):
        start, middle, end = (
            np.column_stack([np.interp(position, along, column) for column in line[ring].T]) for position in (before, at, after)
        )
        turns.append(angle(middle - start, end - middle))
    return np.where(inside, np.min(turns, axis=0), 0.0)


class _Ends(NamedTuple):
    """The ends of all open paths in the view: (E, D) positions, and unit directions out of the path."""

    points: Floats
    outward: Floats

    @classmethod
    def of(cls, views: Sequence[Floats], closed: Sequence[bool], arm: float) -> _Ends:
        """Collect the ends of the paths whose points in the view are given; directions are those of so long an arm."""
        none = np.zeros((0, views[0].shape[1]))
        points: list[Floats] = [none]
        inner: list[Floats] = [none]
        for view, is_closed in zip(views, closed, strict=True):
            if not is_closed:
                total = float(arc_length(view)[-1])
                points.append(view[[0, -1]])
                inner.append(resample(view, np.array([arm, total - arm])))
        return cls(np.concatenate(points), unit(np.concatenate(points) - np.concatenate(inner)))

    def wait_beyond(self, first: Floats, last: Floats, reach: float) -> bool:
        """Tell whether an end within reach continues straight an arm that runs from one point (D,) to another."""
        offset = self.points - last
        distance = np.linalg.norm(offset, axis=1)
        straight = np.radians(MAX_WAIT_DEGREES)
        in_line = (angle(offset, last - first) < straight) & (angle(self.outward, -offset) < straight)
        return bool((in_line & (distance > 0) & (distance < reach)).any())


def _arms(view: Floats, corner: float, arm: float, closed: bool) -> list[tuple[Floats, Floats]]:
    """Return for both arms of a corner two points (D,) of their straight part, which ends an arm's length before the corner."""
    line = view[[*range(len(view)), *([0] if closed else [])]]
    at = corner + arm * np.array([-2.0, -1.0, 2.0, 1.0])
    first, last, other_first, other_last = resample(line, at % float(arc_length(line)[-1]) if closed else at)
    return [(first, last), (other_first, other_last)]


def _peaks(turn: Floats, limit: float, apart: int, closed: bool) -> Ints:
    """Return the samples with the largest turn within so many samples on either side, of those that turn by over the limit."""
    highest = maximum_filter1d(turn, 2 * apart + 1, mode="wrap" if closed else "nearest")
    at = np.flatnonzero((turn > limit) & (turn < np.radians(MAX_CORNER_DEGREES)) & (turn == highest))
    return np.asarray(at[np.diff(at, prepend=-apart - 1) > apart])


def _without_corners(path: Path, corners: Floats, radius: float) -> list[Path]:
    """Return the parts of a path between its corners, at so many m (px in 2-D) from its first point, where its arms are clear."""
    points = path.points
    if path.closed:  # begin and end at the first corner
        points = np.concatenate((points, points[:1]))
        along = arc_length(points)
        first = resample(points, corners[:1])
        later = along[:-1] > corners[0]
        points = np.concatenate((first, points[:-1][later], points[:-1][~later], first))
        corners = np.concatenate((corners - corners[0], [float(along[-1])]))
    along = arc_length(points)
    bounds, cuts = [0.0, *corners, float(along[-1])], [0.0, *(_clear(points, at, radius) for at in corners), 0.0]
    if path.closed:
        bounds, cuts = bounds[1:-1], [cuts[1], *cuts[2:-2], cuts[1]]
    parts = []
    for i in range(len(bounds) - 1):
        low, high = bounds[i] + cuts[i], bounds[i + 1] - cuts[i + 1]
        if low < high:
            ends = resample(points, np.array([low, high]))
            parts.append(Path(np.concatenate((ends[:1], points[(along > low) & (along < high)], ends[1:]))))
    return parts


def _clear(points: Floats, corner: float, radius: float) -> float:
    """Return the length of the arms on both sides of a corner where they are nearer to each other than `CLEARANCE_RADII`."""
    reach = np.arange(0.0, MAX_CUT_RADII, CLEAR_STEP_RADII) * radius
    apart = np.linalg.norm(resample(points, corner + reach) - resample(points, corner - reach), axis=1)
    return float(reach[min(int(np.searchsorted(apart, CLEARANCE_RADII * radius)), len(reach) - 1)])

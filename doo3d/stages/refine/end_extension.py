"""Ends that go on behind what hides them: a bit of surface there that is too short for a chain of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...config import RefineConfig
from ...geometry.polyline import unit
from ...kernels.nearest import nearest
from ...types import Bools, Floats, Ints, Path
from ...visibility import PointVisibility, Visibility
from .cross_sections import thinned
from .samples import Stations

NEAR = 1.5  # radii from a path within which surface belongs to it
ASIDE, SPREAD = 0.9, 0.25  # radii beside the way straight on in which it may lie, and how much more for each radius ahead
SHORTEST, BASE = 0.6, 3.0  # radii, of a stub; and from which an end's direction is taken
FILLED = 0.25  # share of its area that must have been read
COVERED = 0.3  # share of the gap in front of which something must have been seen


MAX_FRAGMENT_GAP = 8.0
"""Radii beyond a hidden end within which a visible fragment of surface is attached to it."""


@dataclass(frozen=True)
class _Stub:
    """What an end goes on to: the end's path and whether it is the path's first, where the stub begins and ends (D,) m, which of
    the free points it is, and how far off it lies, m.
    """

    path: int
    first: bool
    begin: Floats
    end: Floats
    points: Ints
    off: float


def carried_on(
    paths: list[Path], stations: Stations, config: RefineConfig, points: Floats, visibility: Visibility | None
) -> list[Path]:
    """The paths with the stubs that their free ends go on to, where something nearer hides the way there.

    stations : laid along the paths. points : (N, 3) m, the surface.
    """
    if visibility is None or visibility.depth is None:
        return paths
    some = thinned(points)
    radius = float(stations.radius[0])
    free = some[np.isinf(nearest(some, stations.places, NEAR * radius, True)[0])]
    share = len(points) / max(1, len(some))
    left = np.ones(len(free), dtype=bool)
    ends = [(p, first) for p, path in enumerate(paths) if not path.closed for first in (True, False)]
    while left.any():
        found = [stub for end in ends if (stub := _stub(*end, stations, config, free, left, share, visibility)) is not None]
        if not found:
            break
        best = min(found, key=lambda stub: stub.off)
        left[best.points] = False
        ends.remove((best.path, best.first))
        paths = [_longer(path, best) if p == best.path else path for p, path in enumerate(paths)]
    return paths


def _stub(
    p: int, first: bool, stations: Stations, config: RefineConfig, free: Floats, left: Bools, share: float, visibility: Visibility
) -> _Stub | None:
    part = stations.of(p)
    end, inwards = (part.start, 1) if first else (part.stop - 1, -1)
    tip, radius = stations.places[end], float(stations.radius[end])
    heading = unit(tip - stations.inside(end, inwards, BASE * radius))
    along = (free - tip) @ heading
    aside = np.linalg.norm(free - tip - along[:, None] * heading, axis=1)
    ok = left & (along > radius / 2) & (along < MAX_FRAGMENT_GAP * radius) & (aside < ASIDE * radius + SPREAD * along)
    index = np.flatnonzero(ok)
    if len(index) < 4:
        return None
    index = index[np.argsort(along[index], kind="stable")]
    gap = np.flatnonzero(np.diff(along[index]) > radius)
    index = index[: gap[0] + 1] if len(gap) else index
    begin, stop = float(along[index[0]]), float(along[index[-1]])
    assert visibility.camera is not None
    pitch = tip[2] / visibility.camera.fx
    if stop - begin < SHORTEST * radius or share * len(index) < FILLED * 2 * radius * (stop - begin) / pitch**2:
        return None
    said = visibility.classify(tip + np.linspace(0, begin, 12)[1:-1, None] * heading)
    if (said == PointVisibility.FREE).any() or (said == PointVisibility.HIDDEN).mean() < COVERED:
        return None
    at = along[index]
    near, far = free[index[at < begin + 0.7 * radius]].mean(axis=0), free[index[at > stop - 0.7 * radius]].mean(axis=0)
    way = unit(far - near) if stop - begin > radius else heading
    return _Stub(p, first, near, far + 0.3 * radius * way, index, begin + 2 * float(aside[index].mean()))


def _longer(path: Path, stub: _Stub) -> Path:
    filled = np.zeros(len(path.points) - 1, dtype=bool) if path.filled is None else path.filled
    if stub.first:
        joins = tuple((step + 2, confidence) for step, confidence in path.joins)
        return Path(np.concatenate(([stub.end, stub.begin], path.points)), False, np.concatenate(([False, True], filled)), joins)
    return Path(np.concatenate((path.points, [stub.begin, stub.end])), False, np.concatenate((filled, [True, False])), path.joins)

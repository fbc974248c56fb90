"""Strands beneath others: which ends continue each other there, and which leave the view.

Where strands have layers by color, a strand that dives under another one ends in its own layer, though nothing says that the
cable ends. The middle lines of the whole mask, all colors together, lead on from such an end: along the strands on top, through
places where strands meet by the line straight ahead. The end continues to the first end of its own layer that faces it; if there
is none, and the lines lead out of the image, it leaves the view beneath the others.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.curves import Curves
from ..geometry.polyline import arc_length, unit
from ..geometry.radii import ACROSS_RADII, NODE_RADII, TOUCHING_RADII
from ..scene.scene import Scene
from ..types import Floats, Ints
from .depth_gaps import Gaps

LEAST_COSINE = 0.8
"""Cosine of the largest angle between a strand and the line that it follows from there: 37 degrees. At larger ones it crosses."""

MAX_LINES = 6
"""Lines, each from one place where strands meet to the next, that are followed from an end at most."""

AHEAD_RADII = (2.0, 4.0)
"""Radii ahead of an end at one of which another strand must cover it; a tip that is seen has the background ahead."""

OUT, NOWHERE = -1, -2

Exits: TypeAlias = "dict[int, Floats]"
"""Row of an end -> (P, 2) px, the way from it out of the image."""


@dataclass(frozen=True)
class _View:
    """The ends of chains in the image, px: where they are, which way they point, and the layer of each; and the mask's lines."""

    ends: Floats
    ahead: Floats
    layer: Ints
    lines: Curves
    radius: float
    size: Floats

    def follow(self, row: int) -> tuple[Floats, int]:
        """Return the way (P, 2) px on from an end, and the row of the end that it leads to.

        The row is OUT if the way leads out of the image, and NOWHERE if no line leads on, or to no end that faces this one.
        """
        facing = np.flatnonzero((self.layer == self.layer[row]) & (np.arange(len(self.ends)) // 2 != row // 2))
        reach = 2 * TOUCHING_RADII * self.radius
        way: list[Floats] = []
        at, heading = self.ends[row], self.ahead[row]
        for _ in range(MAX_LINES):
            part = self._next(at, heading)
            if not len(part):
                break
            distance, index = cKDTree(part).query(self.ends[facing], distance_upper_bound=reach)
            near = np.flatnonzero(np.isfinite(distance))
            if len(near):
                first = near[np.argmin(index[near])]
                steps = part[min(index[first] + 1, len(part) - 1)] - part[max(index[first] - 1, 0)]
                is_faced = unit(steps) @ self.ahead[facing[first]] < -LEAST_COSINE
                found = np.concatenate([*way, part[: index[first]]])
                return found, int(facing[first]) if is_faced and len(found) else NOWHERE
            way.append(part)
            at, heading = part[-1], unit(part[-1] - part[max(0, len(part) - 1 - round(2 * self.radius))])
            if min(at.min(), (self.size - 1 - at).min()) < 2 * self.radius:
                return np.concatenate(way), OUT
        return np.zeros((0, 2)), NOWHERE

    def _next(self, at: Floats, heading: Floats) -> Floats:
        """Return the line, or the part of one, that leads straight on from a place (2,) px; (0, 2) if there is none."""
        away = np.linalg.norm(self.lines.points - at, axis=1)
        best, found = LEAST_COSINE, self.lines.points[:0]
        for number in np.unique(self.lines.owner[away < 2 * TOUCHING_RADII * self.radius]).tolist():
            own = self.lines.parts[number]
            nearest = own.start + int(away[own].argmin())
            for line in (self.lines.points[nearest : own.stop], self.lines.points[own.start : nearest + 1][::-1]):
                far = np.flatnonzero(np.linalg.norm(line - at, axis=1) > 2 * NODE_RADII * self.radius)
                if len(far) and (cosine := float(unit(line[far[0]] - at) @ heading)) > best:
                    best, found = cosine, line[far[0] :]
        return found


def hidden_strands(points: Floats, tangents: Floats, chains: Curves, scene: Scene) -> tuple[Gaps, Exits]:
    """Return how ends continue beneath strands of other layers.

    Parameters
    ----------
    points, tangents
        (E, D) m (px in 2-D) and unit, the ends, and out of the chains: row 2 c and 2 c + 1 of chain c.
    chains
        the joints of the chains.
    scene
        what was captured; without layers nothing is hidden so.

    Returns
    -------
    gaps : rows of two ends, the lower first -> (P, D) m (px in 2-D), the points from the first to the second.
    exits : row of an end -> (P, 2) px, the points from the end to where the strand leaves the image; in 2-D only, since nothing
    says at what depth it does.
    """
    if len(scene.each_layer) == 1:
        return {}, {}
    (lines, radius, intrinsics), _ = scene.strand_lines(float(np.median(points[:, -1])))
    if not len(lines):
        return {}, {}
    seen = scene.in_image(points)
    ahead = unit(scene.in_image(points + scene.radius * tangents) - seen)
    view = _View(seen, ahead, np.repeat(scene.layer_of(chains), 2), lines, radius, np.array(scene.mask.shape[::-1]))
    is_open = ~(np.repeat(chains.closed, 2) | scene.exits_view(points, tangents, 2 * TOUCHING_RADII * scene.radius))
    side = ahead[:, ::-1] * (-1, 1)
    beyond = [seen + radius * (at * ahead + across * side) for at in AHEAD_RADII for across in ACROSS_RADII]
    is_covered = np.logical_or.reduce(scene.in_mask(np.stack(beyond)))
    ways = {row: view.follow(row) for row in np.flatnonzero(is_open).tolist()}
    gaps, exits = {}, {}
    for row, (way, other) in ways.items():
        back = ways[other][1] if other in ways else OUT
        if other >= 0 and (back == NOWHERE or (back == row and other > row)):
            line = _lifted(way, points[row], points[other], intrinsics)
            gaps[min(row, other), max(row, other)] = line if row < other else line[::-1]
        elif other == OUT and is_covered[row] and scene.dim == 2:
            exits[row] = way
    return gaps, exits


def _lifted(way: Floats, start: Floats, end: Floats, intrinsics: Floats) -> Floats:
    """Return the points (P, D) of a way (P, 2) px between two ends (D,), whose inverse depth changes evenly along it."""
    if len(start) == 2:
        return np.concatenate((start[None], way, end[None]))
    along = arc_length(way)
    share = (along / along[-1] if along[-1] else along)[:, None]
    z = 1 / ((1 - share) / start[2] + share / end[2])
    fx, fy, cx, cy = intrinsics
    return np.concatenate((start[None], np.hstack(((way - (cx, cy)) * z / (fx, fy), z)), end[None]))

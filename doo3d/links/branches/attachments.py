"""Decide for each free end near a strand whether it branches off, or is a tip that touches, overlaps or ends nearby."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.polyline import unit
from ...geometry.radii import NODE_RADII
from ...scene.scene import Scene
from ...types import Floats
from .clouds import hidden_attachment
from .costs import MISFIT_COST, MISS_COST, TIP_COST
from .necks import neck_share
from .strands import FreeEnds, Meeting, SampledChain, box_distances

FREE_COST, UNKNOWN_COST = 20.0, 2.0
"""Cost units per mm (per px in 2-D) of the straight path from an end to a strand: in free space or over bare surface, and where
depth is missing."""

MISS_FREE = 0.4
"""Sums of radii by which the continuation of an end may miss a strand's axis without cost; from one sum of radii on up to two it
grows in proportion to the distance."""

DEPTH_SLOPE = 0.5
"""Depth between an end and a strand that does not count, as a share of the way to it beyond the sum of radii: it is the least
certain at ends, above all its slope, which does not count at all."""

NECK_COST = 500.0
"""Cost units of a branch that narrows to nothing before it reaches its trunk, as a tip that only touches does."""

NORMAL_SHORTFALL = 2.2
"""Radii of a branch between its end and the surface of its trunk without cost: chains end 1.2 to 1.8 radii short."""


@dataclass(frozen=True)
class End:
    """A free end of a strand, with what its continuation is extrapolated from.

    Attributes
    ----------
    line
        (S, D) m (px in 2-D), the axis of the strand, beginning with this end.
    tangent
        (D,) outward unit tangent, across the view.
    towards
        (D,) unit, from the viewpoint to the end; None without a viewpoint.
    radius
        m (px in 2-D), radius of the strand at this end.
    """

    line: Floats
    tangent: Floats
    towards: Floats | None
    radius: float

    @property
    def point(self) -> Floats:
        """The position of the end, (D,) m (px in 2-D)."""
        return np.asarray(self.line[0])


def _ends(ends: FreeEnds, strands: Sequence[SampledChain], viewpoint: Floats | None) -> list[End]:
    """Return the free ends of the strands."""
    made = []
    for row, number in enumerate(ends.strand.tolist()):
        own, side = strands[number], int(ends.side[row])
        radius = own.radius_near(0.0 if side == 0 else own.length, 1 if side == 0 else -1)
        line = own.points if side == 0 else own.points[::-1]
        tangent: Floats = ends.tangents[row]
        towards = None if viewpoint is None else unit(line[0] - viewpoint)
        if towards is not None:
            tangent = unit(tangent - (tangent @ towards) * towards)
        made.append(End(line, tangent, towards, radius))
    return made


def end_meetings(ends: FreeEnds, strands: Sequence[SampledChain], scene: Scene) -> list[Meeting]:
    """Return the possible junctions of free ends with strands.

    Parameters
    ----------
    ends
        the free ends of all strands.
    strands
        all strands.
    scene
        what was captured, with the settings: the longest gap.

    Returns
    -------
    A meeting for each end and strand that fit. Its gain is the cost of leaving the end free minus the cost of the attachment.
    """
    meetings = []
    max_gap = scene.config.merge.gap * scene.gap_unit
    reach = (1 + DEPTH_SLOPE) * max_gap + 2 * max(float(strand.radii.max()) for strand in strands)
    near = box_distances(ends.points, strands) <= reach
    near[np.arange(len(near)), ends.strand] = False
    made = _ends(ends, strands, scene.viewpoint)
    for row, host in np.argwhere(near).tolist():
        end, strand = made[row], strands[host]
        found = [attachment(end, strand, scene, max_gap)]
        if scene.shows_surface:
            found.append(hidden_attachment(end.point, ends.tangents[row], strand, max_gap))
        gain, at = max((each for each in found if each is not None), default=(0.0, 0.0))
        if gain > 0:
            meetings.append(Meeting(gain, strand.at(at), ((host, at),), (row,)))
    return meetings


def attachment(end: End, strand: SampledChain, scene: Scene, max_gap: float) -> tuple[float, float] | None:
    """Find the position on a strand at which attaching an end costs least.

    Costs are its miss of the strand's axis, its distance, free space on the way, and
    a neck before the strand. Differences in depth count less than those across the view.

    Parameters
    ----------
    end
        the free end.
    strand
        the strand that it may branch off.
    scene
        what was captured.
    max_gap
        m (px in 2-D), longest distance from an end to a strand.

    Returns
    -------
    Gain of the junction in cost units, and arc length on the strand, m (px in 2-D). None if leaving the end free costs less.
    """
    point, radius = end.point, end.radius
    offset: Floats = strand.points - point
    both = strand.radii + radius
    if end.towards is not None:
        offset = _without_small_depth(offset, end.towards, both)
    distance = np.linalg.norm(offset, axis=1)
    if distance.min() > max_gap:
        return None
    ahead = offset @ end.tangent
    miss = np.linalg.norm(offset - ahead[:, None] * end.tangent, axis=1)
    shortfall = np.clip(distance - strand.radii - NORMAL_SHORTFALL * radius, 0, None)
    unit_cost = 1000.0 if len(point) == 3 else 1.0  # per m in space, per px in an image
    behind = np.clip(-ahead - both, 0, None)
    # in an image an end beyond a strand crossed it
    behind_cost = 2 * unit_cost * behind if len(point) == 3 else MISFIT_COST * behind / both
    too_far = np.clip(miss - MISS_FREE * np.clip(distance, both, 2 * both), 0, None)
    cost = (MISFIT_COST * too_far + MISS_COST * miss) / both + unit_cost * shortfall + behind_cost
    possible = cost < TIP_COST
    if not strand.chain.closed:
        possible &= np.minimum(strand.along, strand.length - strand.along) > NODE_RADII * strand.radii
    if not possible.any():
        return None
    i = int(np.where(possible, cost, np.inf).argmin())
    at, host_radius = float(strand.along[i]), float(strand.radii[i])
    total = float(cost[i]) + unit_cost * _open_cost(point, strand.points[i], radius, host_radius, scene)
    if total < TIP_COST and scene.sees_space:
        share = neck_share(end.line, radius, strand, at, scene)
        total += NECK_COST * share
    return (TIP_COST - total, at) if total < TIP_COST else None


def _without_small_depth(offset: Floats, towards: Floats, both: Floats) -> Floats:
    """Return offsets (S, 3) from an end to a strand with the part along the view direction less what depth leaves open there."""
    depth = offset @ towards
    beside = offset - depth[:, None] * towards
    free = DEPTH_SLOPE * np.clip(np.linalg.norm(beside, axis=1) - both, 0, None)
    return np.asarray(beside + (np.sign(depth) * np.clip(np.abs(depth) - free, 0, None))[:, None] * towards)


def _open_cost(start: Floats, end: Floats, radius: float, host_radius: float, scene: Scene) -> float:
    """Return the cost of the straight way from an end to an axis, outside both surfaces, m (px in 2-D) times weights."""
    gap = float(np.linalg.norm(end - start))
    if gap <= host_radius + radius:
        return 0.0
    if not scene.sees_space:
        return UNKNOWN_COST * max(0.0, gap - host_radius - NORMAL_SHORTFALL * radius)
    t = np.linspace(radius / gap, 1 - host_radius / gap, max(3, math.ceil(gap / (0.5 * radius))))
    free, unknown, bare = scene.gap_lengths([start + t[:, None] * (end - start)])[0]
    return float(FREE_COST * (free + bare) + UNKNOWN_COST * unknown)

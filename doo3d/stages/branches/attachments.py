"""Decide for each free end near a strand whether it branches off, or is a tip that touches, overlaps or ends nearby."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.polyline import unit
from ...types import Bools, Floats
from ...visibility import Visibility
from .clouds import hidden_place
from .costs import MISFIT_COST, MISS_COST, NEARNESS_COST, TIP_COST
from .necks import neck_share
from .readings import JunctionContext, Meeting
from .strands import NODE_RADII, FreeEnds, SampledChain, box_distances

FREE_COST, UNKNOWN_COST = 20.0, 2.0
"""Cost units per mm (per px in 2-D) of the straight path from an end to a strand: in free space or over bare surface, and where
depth is missing."""

MISS_FREE, CLOUD_MISS_FREE = 0.4, 0.7
"""Sums of radii by which the continuation of an end may miss a strand's axis without cost, in a frame or an image, and in a
cloud, whose axes are less certain; from one sum of radii on up to two it grows in proportion to the distance."""

DEPTH_FREE, DEPTH_SLOPE, MAX_SLOPE = 0.2, 0.5, 0.9
"""Depth between an end and a strand that does not count: in sums of radii, and as a share of the way to it. Depth is the least
certain at ends, above all its slope; only that of ends that run along the view direction, cosine above the third, counts."""

NECK_COST = 680.0
"""Cost units of a branch that narrows to nothing before it reaches its trunk, as a tip that only touches does."""

PLANAR_NECK_FREE = 0.35
"""Share of its diameter by which a branch may narrow without cost in an image, whose mask is ragged; a round tip loses half."""

NORMAL_SHORTFALL = 2.2
"""Radii of a branch between its end and the surface of its trunk without cost: chains end 1.2 to 1.8 radii short."""

HIDDEN_WEIGHT = 0.1
"""Weight of the gain of a junction across a gap of a cloud: it is taken where nothing else connects the end."""


@dataclass(frozen=True)
class End:
    """A free end of a strand, with what its continuation is extrapolated from.

    Attributes
    ----------
    line
        (S, D) m (px in 2-D), the axis of the strand, beginning with this end.
    tangent, curvature
        (D,) outward unit tangent, and (D,) curvature vector, 1/m (1/px).
    radius
        m (px in 2-D), radius of the strand at this end.
    """

    line: Floats
    tangent: Floats
    curvature: Floats
    radius: float

    @property
    def point(self) -> Floats:
        """The end itself, (D,) m (px in 2-D)."""
        return np.asarray(self.line[0])


def end_meetings(
    ends: FreeEnds, strands: Sequence[SampledChain], context: JunctionContext, hidden: bool = False
) -> list[Meeting]:
    """Return the possible junctions of free ends with strands.

    Parameters
    ----------
    ends
        the free ends of all strands.
    strands
        all strands.
    context
        visibility and viewpoint of the frame.
    hidden
        True also attaches ends of a cloud across gaps without points.

    Returns
    -------
    A meeting for each end and strand that fit. Its gain is the cost of leaving the end free minus the cost of the attachment.
    """
    meetings = []
    near = _may_reach(ends, strands, context)
    for row, number in enumerate(ends.strand.tolist()):
        own, side = strands[number], int(ends.side[row])
        radius = own.radius_near(0.0 if side == 0 else own.length, 1 if side == 0 else -1)
        end = End(own.points if side == 0 else own.points[::-1], ends.tangents[row], ends.curvatures[row], radius)
        for host in np.flatnonzero(near[row]).tolist():
            strand = strands[host]
            if host == number:
                continue
            found = [attachment(end, strand, context), _hidden_attachment(end, strand, context) if hidden else None]
            gain, at = max((each for each in found if each is not None), default=(0.0, 0.0))
            if gain > 0:
                meetings.append(Meeting(gain, strand.at(at), ((host, at),), row))
    return meetings


def _may_reach(ends: FreeEnds, strands: Sequence[SampledChain], context: JunctionContext) -> Bools:
    """Tell by the bounding boxes which strands (E, S) may lie within reach of which ends; in a cloud without views all may.

    Depth that does not count makes a strand nearer by DEPTH_SLOPE of the rest and DEPTH_FREE of the sum of radii at most.
    """
    if context.is_cloud:
        return np.ones((len(ends.strand), len(strands)), dtype=bool)
    widest = np.array([max(float(strand.radii.max()), strand.radius) for strand in strands])
    own = np.array([float(strand.widths.max()) for strand in strands])
    own = np.maximum(own, widest)[ends.strand][:, None]
    return np.asarray(box_distances(ends.points, strands) <= (1 + DEPTH_SLOPE) * context.max_gap + DEPTH_FREE * (own + widest))


def attachment(end: End, strand: SampledChain, context: JunctionContext) -> tuple[float, float] | None:
    """Find the position on a strand at which attaching an end costs least.

    The end is extrapolated with its curvature. Costs are its miss of the strand's axis, its distance, free space on the way, and
    a neck before the strand. Differences in depth count less than those across the view.

    Parameters
    ----------
    end
        the free end.
    strand
        the strand that it may branch off.
    context
        visibility and viewpoint of the frame.

    Returns
    -------
    Gain of the junction in cost units, and arc length on the strand, m (px in 2-D). None if leaving the end free costs less.
    """
    point, radius = end.point, end.radius
    tangent: Floats = end.tangent
    curvature: Floats = end.curvature
    offset: Floats = strand.points - point
    both = strand.radii + radius
    if context.viewpoint is not None:
        towards = unit(point - context.viewpoint)
        offset = _without_small_depth(offset, towards, both)
        tangent, curvature = _across(tangent, towards), curvature - (curvature @ towards) * towards
    distance = np.linalg.norm(offset, axis=1)
    if distance.min() > context.max_gap:
        return None
    bend = curvature * min(1.0, 1 / max(6 * radius * float(np.linalg.norm(curvature)), 1e-12)) * context.curvature_persistence
    ahead = offset @ tangent
    expected = np.clip(ahead, 0, None)[:, None] * tangent + 0.5 * np.clip(ahead, 0, None)[:, None] ** 2 * bend
    miss = np.linalg.norm(offset - expected - np.clip(ahead, None, 0)[:, None] * tangent, axis=1)
    shortfall = np.clip(distance - strand.radii - NORMAL_SHORTFALL * radius, 0, None)
    unit_cost = 1000.0 if len(point) == 3 else 1.0
    behind = np.clip(-ahead - both, 0, None)
    # in an image an end beyond a strand crossed it
    behind_cost = 2 * unit_cost * behind if len(point) == 3 else MISFIT_COST * behind / both
    free = CLOUD_MISS_FREE if context.visibility is None else MISS_FREE
    cost = (
        MISFIT_COST * np.clip(miss - free * np.clip(distance, both, 2 * both), 0, None) / both
        + unit_cost * shortfall
        + behind_cost
    )
    cost = cost + NEARNESS_COST * unit_cost * distance + MISS_COST * miss / both
    possible = cost < TIP_COST
    if not strand.closed:
        possible &= np.minimum(strand.along, strand.length - strand.along) > NODE_RADII * strand.radii
    if not possible.any():
        return None
    i = int(np.where(possible, cost, np.inf).argmin())
    at, host_radius = float(strand.along[i]), float(strand.radii[i])
    total = float(cost[i]) + unit_cost * _open_cost(point, strand.points[i], radius, host_radius, context.visibility)
    if total < TIP_COST and context.visibility is not None:
        share = neck_share(end.line, radius, strand, at, context.visibility, context.viewpoint)
        total += NECK_COST * (share if len(point) == 3 else max(0.0, share - PLANAR_NECK_FREE))
    return (TIP_COST - total, at) if total < TIP_COST else None


def _hidden_attachment(end: End, strand: SampledChain, context: JunctionContext) -> tuple[float, float] | None:
    """Return gain and arc length where an end meets a strand of a cloud across a gap; None if leaving the end free costs less."""
    found = hidden_place(end.point, end.tangent, strand, context.max_gap)
    if found is None or found[1] >= TIP_COST:
        return None
    at = float(strand.along[found[0]])
    is_tip = strand.is_near_end(at, NODE_RADII * float(strand.radii[found[0]]))
    return None if is_tip else (HIDDEN_WEIGHT * (TIP_COST - found[1]), at)


def _without_small_depth(offset: Floats, towards: Floats, both: Floats) -> Floats:
    """Return offsets (S, 3) from an end to a strand with the part along the view direction less what depth leaves open there."""
    depth = offset @ towards
    beside = offset - depth[:, None] * towards
    free = DEPTH_FREE * both + DEPTH_SLOPE * np.clip(np.linalg.norm(beside, axis=1) - both, 0, None)
    return np.asarray(beside + (np.sign(depth) * np.clip(np.abs(depth) - free, 0, None))[:, None] * towards)


def _across(tangent: Floats, towards: Floats) -> Floats:
    """Return a tangent turned across the view direction; one that runs along it as it is."""
    slope = float(tangent @ towards)
    return tangent if abs(slope) > MAX_SLOPE else unit(tangent - slope * towards)


def _open_cost(start: Floats, end: Floats, radius: float, host_radius: float, visibility: Visibility | None) -> float:
    """Return the cost of the straight way from an end to an axis, outside both surfaces, m (px in 2-D) times weights."""
    gap = float(np.linalg.norm(end - start))
    if gap <= host_radius + radius:
        return 0.0
    if visibility is None:
        return UNKNOWN_COST * max(0.0, gap - host_radius - NORMAL_SHORTFALL * radius)
    t = np.linspace(radius / gap, 1 - host_radius / gap, max(3, math.ceil(gap / (0.5 * radius))))
    free, unknown, bare = visibility.gap_lengths([start + t[:, None] * (end - start)])[0]
    return float(FREE_COST * (free + bare) + UNKNOWN_COST * unknown)

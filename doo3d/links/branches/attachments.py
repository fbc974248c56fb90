"""Decide for each free end near a strand whether it branches off, or is a tip that touches, overlaps or ends nearby."""

import math
from collections.abc import Sequence

import numpy as np

from ...geometry.polyline import unit
from ...geometry.radii import STEP_RADII
from ...scene.scene import Scene
from ...types import Floats
from ..costs import MISFIT_COST, MISS_COST, TIP_COST, length_costs, unit_cost
from ..ends import End, Ends
from .clouds import hidden_attachment
from .necks import neck_share
from .strands import ContactCandidate, SampledChain, across_view, box_distances, view_direction

MISS_FREE = 0.4
"""Sums of radii by which the continuation of an end may miss a strand's axis without cost, where the end is up to one sum of
radii away; twice as much from two sums of radii on."""

DEPTH_SLOPE = 0.5
"""Difference in depth between an end and a strand that does not count, as a share of the distance across the view beyond the sum
of radii: depth is the least certain at ends, above all its slope, which does not count at all."""

NECK_COST = 500.0
"""Cost units of a branch that narrows to nothing before it reaches its trunk, as a tip that only touches does."""

NORMAL_SHORTFALL = 2.2
"""Radii of a branch between its end and the surface of its trunk without cost: chains end 1.2 to 1.8 radii short."""


def end_contacts(ends: Ends, strands: Sequence[SampledChain], scene: Scene) -> list[ContactCandidate]:
    """Return the possible contacts of free ends with strands.

    Parameters
    ----------
    ends
        the ends of all strands.
    strands
        all strands.
    scene
        what was captured.

    Returns
    -------
    A candidate for each end and strand that fit. Its gain is the cost of leaving the end free minus the cost of the attachment.
    """
    reach = (1 + DEPTH_SLOPE) * ends.max_gap + 2 * max(float(strand.radii.max()) for strand in strands)
    near = (box_distances(ends.points, strands) <= reach) & ~ends.closed[:, None]
    contacts = []
    for row, number in np.argwhere(near).tolist():
        end, host = End.at(row), strands[number]
        if number == end.chain:
            continue
        gain, at = attachment(strands[end.chain], end.side, host, ends.max_gap, scene)
        if scene.shows_surface:
            gain, at = max((gain, at), hidden_attachment(ends, row, host))
        if gain > 0:
            contacts.append(ContactCandidate(gain, host.at(at), ((number, at),), (end,)))
    return contacts


def attachment(strand: SampledChain, side: int, host: SampledChain, max_gap: float, scene: Scene) -> tuple[float, float]:
    """Find the position on a strand at which attaching the end of another costs least.

    The costs are those of the distance by which the continuation of the end misses the axis, of the gap, and of a neck before the
    strand. Differences in depth count less than those across the view.

    Parameters
    ----------
    strand, side
        the strand whose end may be attached, and which end: 0 for its first, 1 for its last.
    host
        the strand that it may branch off.
    max_gap
        m (px in 2-D), longest distance from an end to a strand.
    scene
        what was captured.

    Returns
    -------
    Gain of the contact in cost units, and arc length on the host, m (px in 2-D). Both are 0 if leaving the end free costs less.
    """
    line, radius = strand.points[:: -1 if side else 1], strand.end_radii[side]
    per_length = unit_cost(line.shape[1])
    towards = view_direction(line[0], scene)
    tangent = unit(across_view(strand.ends[side], towards))
    both = host.radii + radius
    offset = _without_small_depth(host.points - line[0], towards, both)
    distance = np.linalg.norm(offset, axis=1)
    ahead = offset @ tangent
    miss = np.linalg.norm(offset - ahead[:, None] * tangent, axis=1)
    shortfall = np.clip(distance - host.radii - NORMAL_SHORTFALL * radius, 0, None)
    behind = np.clip(-ahead - both, 0, None)
    # in an image an end beyond a strand crossed it
    behind_cost = 2 * per_length * behind if line.shape[1] == 3 else MISFIT_COST * behind / both
    too_far = np.clip(miss - MISS_FREE * np.clip(distance, both, 2 * both), 0, None)
    cost = (MISFIT_COST * too_far + MISS_COST * miss) / both + per_length * shortfall + behind_cost
    possible = (cost < TIP_COST) & ~host.near_ends
    if not possible.any() or distance.min() > max_gap:
        return 0.0, 0.0
    i = int(np.where(possible, cost, np.inf).argmin())
    at, host_radius = float(host.along[i]), float(host.radii[i])
    total = float(cost[i]) + _gap_cost(line[0], host.points[i], radius, host_radius, scene)
    if total < TIP_COST and scene.sees_space:
        total += NECK_COST * neck_share(line, radius, host, at, scene)
    return (TIP_COST - total, at) if total < TIP_COST else (0.0, 0.0)


def _without_small_depth(offset: Floats, towards: Floats, both: Floats) -> Floats:
    """Return offsets (S, D) from an end to a strand without the difference in depth that is uncertain there.

    towards : (D,) unit, from the viewpoint to the end; zeros without a viewpoint. both : (S,) m (px in 2-D), the sums of radii.
    """
    depth = offset @ towards
    beside = offset - depth[:, None] * towards
    free = DEPTH_SLOPE * np.clip(np.linalg.norm(beside, axis=1) - both, 0, None)
    return np.asarray(beside + (np.sign(depth) * np.clip(np.abs(depth) - free, 0, None))[:, None] * towards)


def _gap_cost(start: Floats, end: Floats, radius: float, host_radius: float, scene: Scene) -> float:
    """Return the cost of the straight gap between an end and an axis, outside both surfaces, in cost units.

    start, end : (D,) m (px in 2-D), the end, and the position on the axis. radius, host_radius : of both strands, m (px in 2-D).
    """
    gap, config, per_length = float(np.linalg.norm(end - start)), scene.config.merge, unit_cost(len(start))
    if gap <= host_radius + radius:
        return 0.0
    if not scene.sees_space:
        return per_length * config.unknown_weight * max(0.0, gap - host_radius - NORMAL_SHORTFALL * radius)
    t = np.linspace(radius / gap, 1 - host_radius / gap, max(3, math.ceil(gap / (STEP_RADII * radius))))
    return float(length_costs([start + t[:, None] * (end - start)], scene, config, per_length).sum())

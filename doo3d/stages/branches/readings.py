"""Where strands come together, and what each reading of such a place costs: branch, crossing, touch, or an end near a strand.

Costs are in the units of merging: 1 per mm (1 per px in 2-D), 100 per radian. A branch joins axes at one depth, a crossing is two
layers whose axes are a sum of radii apart; strands that cross go on straight and keep their radius.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ...geometry.polyline import unit
from ...types import Floats
from ...visibility import Visibility
from .clouds import Surface, bridged_place, hidden_place
from .necks import neck_share
from .planar import planar_radius_change, planar_turn, radius_change
from .strands import FreeEnds, Strand

LAYER_COST = 300.0
"""Cost units for axes a whole sum of radii from where a reading wants them."""

BODY_LAYER_COST = 100.0
"""The same where two bodies meet: the lower one is hidden there, and stereo cameras do not tell layers of thin strands."""

KINK_COST, SMOOTH_KINK = 300.0, 0.1
"""Cost units per radian by which a strand that should go on smoothly bends at a place, and radians without cost."""

PLANAR_TURN_COST = 100.0
"""Cost units per radian by which one of two strands that cross in an image turns inside the other."""

RADIUS_COST = 150.0
"""Cost units per e-fold by which the radius of a strand changes where it should go on."""

BRANCH_COST = 90.0
"""Cost units of a branch where two strands might cross: crossings are more common than opposite branches."""

TIP_COST = 120.0
"""Cost units of a free end beside a strand: an end is attached if that costs less."""

FREE_COST, UNKNOWN_COST = 20.0, 2.0
"""Cost units per mm (per px in 2-D) of an end's way to a strand through free space or over bare surface, and without depth."""

MISS_FREE, CLOUD_MISS_FREE = 0.4, 0.7
"""Sums of radii by which the continuation of an end may miss a strand's axis without cost, in a frame or an image, and in a
cloud, whose axes are less certain."""

DEPTH_FREE, DEPTH_SLOPE, MAX_SLOPE = 0.2, 0.5, 0.9
"""Depth between an end and a strand that does not count: in sums of radii, and as a share of the way to it. Depth is the least
certain at ends, above all its slope; only that of ends that run along the view direction, cosine above the third, counts."""

MISS_SLOPE = 0.4
"""Tangent of the angle by which the continuation of an end may deviate without cost, from one sum of radii on up to two."""

NECK_COST = 680.0
"""Cost units of a strand that narrows to nothing before it reaches another, as a tip that touches does."""

PLANAR_NECK_FREE = 0.35
"""Share of its diameter by which a branch may narrow without cost in an image, whose mask is ragged; a round tip loses half."""

NORMAL_SHORTFALL = 2.2
"""Radii of a branch between its end and the surface of its trunk without cost: chains end 1.2 to 1.8 radii short."""

NEARNESS_COST, MISS_COST = 0.5, 20.0
"""Cost units per mm (per px in 2-D) from an end to an axis, and per sum of radii by which its continuation misses the axis: of
the places on a strand that fit an end, the nearest and straightest ahead is taken."""

MIN_CROSSING_SINE = 0.2
"""Sine of the angle between two strands from which they count as crossing lines."""

CONTACT_RADII, PLANAR_CONTACT_RADII = 1.35, 0.65
"""Sums of radii between two axes up to which strands touch, in space, and in the image, where they must cross."""

OWN_LENGTH_RADII = 12.0
"""Radii along a strand from which on it may touch itself."""

END_CLEARANCE_RADII = 3.0
"""Radii of the trunk from its own free end within which nothing branches off: there an end meets an end."""

CURVATURE_PERSISTENCE = 0.7
"""Share of its curvature that an end is expected to keep."""

HIDDEN_COST = 120.0
"""Cost units up to which an end is attached across a gap of a cloud."""

HIDDEN_WEIGHT = 0.1
"""Weight of the gain of a junction across a gap of a cloud: it is taken where nothing else connects the end."""

MAX_REACH_RADII = 40.0
"""Radii beyond an end within which a strand is looked for."""


@dataclass(frozen=True)
class Meeting:
    """A place that may be a junction, and by how much that reading is cheaper than the best other.

    Attributes
    ----------
    gain
        cost units; over 0 for a junction.
    position
        (D,) m (px in 2-D), where the axes would meet.
    bodies
        (strand, arc length) of each strand that runs through the place.
    end
        row in `FreeEnds` of the end that meets the strand there; None if two bodies meet.
    """

    gain: float
    position: Floats
    bodies: tuple[tuple[int, float], ...]
    end: int | None = None


def body_meetings(strands: Sequence[Strand], viewpoint: Floats | None) -> list[Meeting]:
    """Return the places where two strands pass each other in contact, away from their ends, with the gain of a junction there."""
    meetings = []
    for a, p, b, q in _contacts(strands):
        first, second = strands[a], strands[b]
        at = (float(first.along[p]), float(second.along[q]))
        both = float(first.radii[p] + second.radii[q])
        if _is_near_end(first, at[0], 2 * both) or _is_near_end(second, at[1], 2 * both):
            continue
        points = first.points[p], second.points[q]
        apart = _distance(first, p, second, q) / both
        towards = None if viewpoint is None else unit(points[0] - viewpoint)
        if len(points[0]) == 3:
            crossing, branch = BODY_LAYER_COST * max(0.0, 1 - apart), BRANCH_COST + BODY_LAYER_COST * min(apart, 1.0)
            for strand, position in ((first, at[0]), (second, at[1])):
                crossing += KINK_COST * max(0.0, strand.kink(position, both, towards) - SMOOTH_KINK)
                crossing += RADIUS_COST * radius_change(strand, position)
        else:
            place = (first, at[0], second, at[1])
            crossing, branch = PLANAR_TURN_COST * planar_turn(*place) + RADIUS_COST * planar_radius_change(*place), BRANCH_COST
        weight = np.array([first.radii[p] ** 2, second.radii[q] ** 2])
        middle = (weight[0] * points[0] + weight[1] * points[1]) / weight.sum()
        meetings.append(Meeting(crossing - branch, middle, ((a, at[0]), (b, at[1]))))
    return meetings


def end_meetings(
    ends: FreeEnds,
    strands: Sequence[Strand],
    visibility: Visibility | None,
    viewpoint: Floats | None,
    max_gap: float,
    surface: Surface | None = None,
    hidden: bool = False,
) -> list[Meeting]:
    """Return for each free end the strands that it may branch off from, with the gain of a junction over a free end there.

    Parameters
    ----------
    ends
        the free ends of all strands.
    strands
        all strands.
    visibility
        tells free from hidden space; None for an image, and for a cloud without camera views.
    viewpoint
        (3,) m, where the camera is; None in 2-D, and where it is unknown.
    max_gap
        m (px in 2-D), longest way from an end to a strand.
    surface
        of a cloud without camera views; None for other data.
    hidden
        True also attaches ends of a cloud across gaps without points.
    """
    meetings = []
    for row, number in enumerate(ends.strand.tolist()):
        own = strands[number]
        radius = own.radius_near(0.0 if ends.side[row] == 0 else own.length, 1 if ends.side[row] == 0 else -1)
        for host, strand in enumerate(strands):
            if host != number:
                found = _attachment(ends, row, radius, own, host, strand, visibility, viewpoint, max_gap)
                if surface is not None:
                    found = max(found, *_cloud_attachments(ends, row, radius, host, strand, surface, max_gap * hidden), key=_gain)
                if found is not None:
                    meetings.append(found)
    return meetings


def _attachment(
    ends: FreeEnds,
    row: int,
    radius: float,
    own: Strand,
    host: int,
    strand: Strand,
    visibility: Visibility | None,
    viewpoint: Floats | None,
    max_gap: float,
) -> Meeting | None:
    """Return the cheapest place at which an end meets a strand, if that costs less than a free end; else None."""
    point, tangent, curvature = ends.points[row], ends.tangents[row], ends.curvatures[row]
    offset, both = strand.points - point, strand.radii + radius
    if viewpoint is not None:
        towards = unit(point - viewpoint)
        offset = _without_small_depth(offset, towards, both)
        tangent, curvature = _across(tangent, towards), curvature - (curvature @ towards) * towards
    distance = np.linalg.norm(offset, axis=1)
    reach = min(max_gap, MAX_REACH_RADII * radius)
    if distance.min() > reach:
        return None
    bend = curvature * min(1.0, 1 / max(6 * radius * float(np.linalg.norm(curvature)), 1e-12)) * CURVATURE_PERSISTENCE
    ahead = offset @ tangent
    expected = np.clip(ahead, 0, None)[:, None] * tangent + 0.5 * np.clip(ahead, 0, None)[:, None] ** 2 * bend
    miss = np.linalg.norm(offset - expected - np.clip(ahead, None, 0)[:, None] * tangent, axis=1)
    shortfall = np.clip(distance - strand.radii - NORMAL_SHORTFALL * radius, 0, None)
    unit_cost = 1000.0 if len(point) == 3 else 1.0
    behind = np.clip(-ahead - both, 0, None)
    # in an image an end beyond a strand crossed it
    behind_cost = 2 * unit_cost * behind if len(point) == 3 else LAYER_COST * behind / both
    free = CLOUD_MISS_FREE if visibility is None else MISS_FREE
    tolerance = free * both + MISS_SLOPE * np.clip(distance - both, 0, both)
    cost = LAYER_COST * np.clip(miss - tolerance, 0, None) / both + unit_cost * shortfall + behind_cost
    cost = cost + NEARNESS_COST * unit_cost * distance + MISS_COST * miss / both
    possible = cost < TIP_COST
    if not strand.closed:
        possible &= np.minimum(strand.along, strand.length - strand.along) > END_CLEARANCE_RADII * strand.radii
    for i in np.flatnonzero(possible)[np.argsort(cost[possible], kind="stable")][:1]:
        total = float(cost[i]) + unit_cost * _open_cost(point, strand.points[i], radius, float(strand.radii[i]), visibility)
        if total < TIP_COST and visibility is not None:
            share = neck_share(
                own.points if ends.side[row] == 0 else own.points[::-1],
                radius,
                strand,
                float(strand.along[i]),
                visibility,
                viewpoint,
            )
            total += NECK_COST * (share if len(point) == 3 else max(0.0, share - PLANAR_NECK_FREE))
        if total < TIP_COST:
            return Meeting(TIP_COST - total, strand.points[i], ((host, float(strand.along[i])),), row)
    return None


def _gain(meeting: Meeting | None) -> float:
    return -math.inf if meeting is None else meeting.gain


def _cloud_attachments(
    ends: FreeEnds, row: int, radius: float, host: int, strand: Strand, surface: Surface, max_gap: float
) -> Iterator[Meeting | None]:
    """Yield the places at which an end meets a strand of a cloud: where points lead to it, and across a gap; None without any."""
    point, tangent = ends.points[row], ends.tangents[row]
    yield None
    for found, weight, limit in (
        (bridged_place(point, tangent, radius, strand, surface), 1.0, TIP_COST),
        (hidden_place(point, tangent, strand, max_gap), HIDDEN_WEIGHT, HIDDEN_COST),
    ):
        if found is not None and found[1] < limit:
            at = float(strand.along[found[0]])
            if not _is_near_end(strand, at, END_CLEARANCE_RADII * float(strand.radii[found[0]])):
                yield Meeting(weight * (limit - found[1]), strand.points[found[0]], ((host, at),), row)


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


def _distance(first: Strand, p: int, second: Strand, q: int) -> float:
    """Return how far apart two axes pass each other, m (px in 2-D), as straight lines at samples p and q, which lie near."""
    offset = first.points[p] - second.points[q]
    if len(offset) == 3:
        normal = np.cross(first.direction(p), second.direction(q))
        if np.linalg.norm(normal) > MIN_CROSSING_SINE:
            return abs(float(offset @ unit(normal)))
    return float(np.linalg.norm(offset))


def _is_near_end(strand: Strand, position: float, limit: float) -> bool:
    return not strand.closed and min(position, strand.length - position) < limit


def _contacts(strands: Sequence[Strand]) -> Iterator[tuple[int, int, int, int]]:
    """Yield (strand, sample, strand, sample) where axes come nearest to each other, one for each stretch of contact."""
    points = np.concatenate([strand.points for strand in strands])
    radii = np.concatenate([strand.radii for strand in strands])
    along = np.concatenate([strand.along for strand in strands])
    number = np.repeat(np.arange(len(strands)), [len(strand.points) for strand in strands])
    first = np.cumsum([0, *(len(strand.points) for strand in strands)])
    factor = CONTACT_RADII if points.shape[1] == 3 else PLANAR_CONTACT_RADII
    pairs = cKDTree(points).query_pairs(2 * factor * float(radii.max()), output_type="ndarray")
    if not len(pairs):
        return
    a, b = pairs.min(axis=1), pairs.max(axis=1)
    distance = np.linalg.norm(points[a] - points[b], axis=1)
    own = (number[a] == number[b]) & (np.abs(along[a] - along[b]) < OWN_LENGTH_RADII * radii[a])
    chosen = (distance < factor * (radii[a] + radii[b])) & ~own
    a, b, distance = a[chosen], b[chosen], distance[chosen]
    if not len(a):
        return
    places = cKDTree(np.column_stack((a, b, number[a] * 1e6, number[b] * 1e6))).query_pairs(6.0, output_type="ndarray")
    links = coo_matrix((np.ones(len(places)), places.T), (len(a), len(a)))
    count, group = connected_components(links, directed=False)
    for k in range(count):
        rows = np.flatnonzero(group == k)
        best = rows[distance[rows].argmin()]
        p, q = int(a[best]), int(b[best])
        yield int(number[p]), p - int(first[number[p]]), int(number[q]), q - int(first[number[q]])

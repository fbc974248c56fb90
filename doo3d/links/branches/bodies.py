"""Decide where two strands pass each other in contact: two branches opposite each other on a trunk, or a crossing.

At a branch the axes meet at one depth, at a crossing they are one sum of radii apart. In an image without depth the turns of the
strands decide: two straight strands cross; where one turns, it is two branches of the other.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.spatial import cKDTree

from ...geometry.curves import Curves
from ...geometry.polyline import angle, unit
from ...scene.scene import Scene
from ..costs import BRANCH_COST, MISFIT_COST
from .strands import ContactCandidate, SampledChain, stretch_inside

CONTACT_RADII, CONTACT_SAMPLES = 0.65, 6
"""Largest distance of two axes at a contact, in sums of radii; and number of samples between two of them up to which both are
one contact."""


def body_contacts(strands: Sequence[SampledChain], scene: Scene) -> list[ContactCandidate]:
    """Return the contacts at which two strands pass each other away from their ends, which may be junctions.

    The gain of each is the cost of a crossing minus that of two opposite branches.
    """
    contacts = []
    for a, p, b, q in _nearest_samples(strands):
        first, second = strands[a], strands[b]
        at = float(first.along[p]), float(second.along[q])
        both = float(first.radii[p] + second.radii[q])
        if first.is_near_end(at[0], 2 * both) or second.is_near_end(at[1], 2 * both):
            continue
        if first.points.shape[1] == 3:
            apart = float(np.linalg.norm(first.points[p] - second.points[q])) / both
            gain = MISFIT_COST * (1 - 2 * apart)
        else:
            gain = scene.config.merge.angle_weights[0] * planar_turn(first, at[0], second, at[1])
        weight = np.array([first.radii[p] ** 2, second.radii[q] ** 2])
        middle = (weight[0] * first.points[p] + weight[1] * second.points[q]) / weight.sum()
        contacts.append(ContactCandidate(gain - BRANCH_COST, middle, ((a, at[0]), (b, at[1]))))
    return contacts


def planar_turn(first: SampledChain, at: float, second: SampledChain, place: float) -> float:
    """Return the larger of the angles in radians by which two strands turn inside each other in an image.

    The thicker strand is the trunk in either case, so its turn is weighted by the ratio of the cross-sections.

    first, at, second, place : each strand, and the arc length on it at the contact, px.
    """
    radii = [max(strand.radius_near(s, -1), strand.radius_near(s, 1)) for strand, s in ((first, at), (second, place))]
    turns = _turn_inside(first, at, second), _turn_inside(second, place, first)
    thinner = min(radii)
    return max(turn * (thinner / radius) ** 2 for turn, radius in zip(turns, radii, strict=True))


def _turn_inside(strand: SampledChain, at: float, other: SampledChain) -> float:
    """Return the sum of the angles in radians by which a strand turns where it enters another one, and where it leaves it."""
    low, high = stretch_inside(strand, at, other)
    line = unit(strand.at(high) - strand.at(low))
    return float(angle(-strand.arm(low, -1, strand.radius), line) + angle(line, strand.arm(high, 1, strand.radius)))


def _nearest_samples(strands: Sequence[SampledChain]) -> Iterator[tuple[int, int, int, int]]:
    """Yield (strand, sample, strand, sample) at the least distance of two axes, once for each contact."""
    curves = Curves.of([strand.points for strand in strands])
    points, number, first = curves.points, curves.owner, curves.bounds
    radii = np.concatenate([strand.radii for strand in strands])
    pairs = cKDTree(points).query_pairs(2 * CONTACT_RADII * float(radii.max()), output_type="ndarray")
    a, b = pairs.min(axis=1), pairs.max(axis=1)
    distance = np.linalg.norm(points[a] - points[b], axis=1)
    near = np.flatnonzero((distance < CONTACT_RADII * (radii[a] + radii[b])) & (number[a] != number[b]))
    strand_pair = number[a] * len(strands) + number[b]
    near = near[np.lexsort((a[near], strand_pair[near]))]
    is_next = (np.diff(strand_pair[near]) == 0) & (np.diff(a[near]) < CONTACT_SAMPLES)
    for stretch in np.split(near, np.flatnonzero(~is_next) + 1) if len(near) else ():
        best = stretch[distance[stretch].argmin()]
        p, q = int(a[best]), int(b[best])
        yield int(number[p]), p - int(first[number[p]]), int(number[q]), q - int(first[number[q]])

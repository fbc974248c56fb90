"""Swap the continuations of two chains after a contact where each was traced into the other.

Strands that cross at an acute angle look like two strands that touch and bend away from each other.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from ...geometry.polyline import angle
from ...types import Chain, Floats
from .bodies import KINK_COST, RADIUS_COST, SMOOTH_KINK, Contact, contacts, view_direction
from .joins import joined
from .strands import SampledChain, free_ends, strands_of
from .tree import stretch_of

EXCHANGE_COST = 60.0
"""Cost units by which another pairing must be cheaper than the one found, which traversal and merging have chosen."""

BRANCH_SHARE = 0.5
"""Largest cost of another pairing as a share of the cost of the one found; above it both pairings bend, as branches do."""

MAX_CONTACTS = 300
"""Most contacts that are examined, for time (about 0.5 s per round): a harness has some tens."""

NOTE = "branches: strands pass each other at {} places; where they swap sides is looked for at {} at most"

MIN_CROSSING_ANGLE = 0.4
"""Smallest angle of a crossing, radians: at less, two strands run side by side."""

Arm = tuple[int, int]
"""Arm of a contact: index of the strand (0 or 1), and side (-1 before the contact, 1 after it)."""

Pairing = tuple[tuple[Arm, Arm], tuple[Arm, Arm]]
"""The four arms of a contact in two pairs, each pair one continuous strand."""

PAIRINGS: tuple[Pairing, ...] = (
    (((0, -1), (0, 1)), ((1, -1), (1, 1))),
    (((0, -1), (1, 1)), ((1, -1), (0, 1))),
    (((0, -1), (1, -1)), ((0, 1), (1, 1))),
)
"""All pairings; the first is the one found."""


def exchanged(chains: Sequence[Chain], viewpoint: Floats | None, length: float) -> tuple[list[Chain], tuple[str, ...]]:
    """Swap the continuations of two chains after a contact if their bends and changes of radius decrease.

    The best swap is applied first, until none is left.

    Parameters
    ----------
    chains
        the chains as they were found.
    viewpoint
        (3,) m, where the camera is; None where it is unknown.
    length
        segment length, m.

    Returns
    -------
    The chains; and a message to the user, if there are more contacts than can be examined.
    """
    result = list(chains)
    known: dict[tuple[object, ...], tuple[float, int]] = {}  # an exchange changes two strands, and the contacts of these alone
    alive = [result]  # as long as chains are, their ids are their own
    for _ in range(len(chains)):
        strands = strands_of(result)
        best: tuple[float, Contact, int] | None = None
        places = contacts(strands)
        if len(places) > MAX_CONTACTS:
            return result, (NOTE.format(len(places), MAX_CONTACTS),)
        for contact in places:
            key = (*(id(result[number]) for number in contact.strands), contact.samples)
            if key not in known:
                known[key] = _best_exchange(contact, strands, viewpoint)
            gain, way = known[key]
            if gain > (0.0 if best is None else best[0]):
                best = gain, contact, way
        if best is None:
            return result, ()
        result = _applied(result, strands, best[1], PAIRINGS[best[2]], length)
        alive.append(result)
    return result, ()


def _best_exchange(contact: Contact, strands: Sequence[SampledChain], viewpoint: Floats | None) -> tuple[float, int]:
    """Return the gain of the better exchange at a contact, and its row in PAIRINGS; a gain of 0 where none is better."""
    best = 0.0, 0
    if contact.strands[0] == contact.strands[1] or any(strands[number].closed for number in contact.strands):
        return best
    headings = _headings(contact, strands, viewpoint)
    if headings is None:
        return best
    found, *others = (_cost(pairing, contact, strands, headings) for pairing in PAIRINGS)
    for way, cost in enumerate(others, 1):
        gain = found - cost - EXCHANGE_COST
        if gain > best[0] and cost < BRANCH_SHARE * found and _cross(PAIRINGS[way], headings):
            best = gain, way
    return best


def _headings(contact: Contact, strands: Sequence[SampledChain], viewpoint: Floats | None) -> dict[Arm, Floats] | None:
    """Return the direction in which each arm comes to a contact; None where one is too short to tell."""
    towards = view_direction(contact, strands, viewpoint)
    headings = {}
    for which, side in itertools.product((0, 1), (-1, 1)):
        heading = strands[contact.strands[which]].heading(contact.at[which], side, contact.both, towards)
        if heading is None:
            return None
        headings[which, side] = heading
    return headings


def _cost(pairing: Pairing, contact: Contact, strands: Sequence[SampledChain], headings: dict[Arm, Floats]) -> float:
    """Return the cost of two strands going on through a contact in one way: by their bends and changes of radius."""
    cost = 0.0
    for pair in pairing:
        one, other = (headings[arm] for arm in pair)
        radii = [strands[contact.strands[which]].radius_near(contact.at[which], side) for which, side in pair]
        cost += RADIUS_COST * abs(math.log(radii[0] / radii[1]))
        cost += KINK_COST * max(0.0, float(angle(-one, other)) - SMOOTH_KINK)
    return cost


def _cross(pairing: Pairing, headings: dict[Arm, Floats]) -> bool:
    """Tell whether two strands that go on in one way cross at an angle, rather than run side by side."""
    slopes = (abs(float(headings[one] @ headings[other])) for one, other in itertools.product(*pairing))
    return max(slopes) < math.cos(MIN_CROSSING_ANGLE)


def _applied(
    chains: Sequence[Chain], strands: Sequence[SampledChain], contact: Contact, pairing: Pairing, length: float
) -> list[Chain]:
    """Return the chains with the two of a contact parted there and joined in another way."""
    parts: list[Chain] = []
    number: dict[Arm, int] = {}
    for which, side in itertools.product((0, 1), (-1, 1)):
        chain, strand = chains[contact.strands[which]], strands[contact.strands[which]]
        at, clear = contact.at[which], contact.both
        low, high = (0.0, at - clear) if side < 0 else (at + clear, strand.length)
        part = stretch_of(chain, strand, low, high, length)
        if part is None:
            return list(chains)
        number[which, side] = len(parts)
        parts.append(part)
    pieces = strands_of(parts)
    ends = free_ends(parts, pieces)
    # the end at the contact is the last one of a part before it (row 2 n + 1), and the first of a part after it (row 2 n)
    rows = {arm: 2 * n + (1 if arm[1] < 0 else 0) for arm, n in number.items()}
    links = [(rows[one], rows[other], EXCHANGE_COST) for one, other in pairing]
    rest = [chain for k, chain in enumerate(chains) if k not in contact.strands]
    return [*rest, *joined(parts, pieces, ends, links, length)]

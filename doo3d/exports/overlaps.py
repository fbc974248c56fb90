"""Find bodies of branched objects that overlap near junctions, whose contacts simulators must exclude."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..errors import require
from ..types import Chain, ChainEnd
from .link_frames import link_frames

CONTACT_FREE_RADII = 3.0
"""Distance along the chain or from a junction, in radii, within which contacts are excluded, since capsules touch at every
bend."""


class Body(NamedTuple):
    """Reference to one segment of one chain as a rigid body."""

    chain: int
    segment: int


def overlapping_bodies(
    chains: Sequence[Chain], radii: Sequence[float], junctions: Sequence[Sequence[ChainEnd]]
) -> list[tuple[Body, Body]]:
    """Return the pairs of bodies of different chains that overlap near junctions.

    These are all pairs within three radii of a junction, and from there on the pairs whose capsules intersect in the detected
    shape, as computed by FCL (package python-fcl), such as along a branch that leaves at an acute angle.

    Parameters
    ----------
    chains
        the chains, 3-D.
    radii
        radius of each chain, m.
    junctions
        for each junction the chain ends that meet there.

    Returns
    -------
    Pairs in ascending order, the smaller reference first.
    """
    if not junctions:
        return []
    fcl = require("fcl")
    capsules = [_capsules(fcl, chain, radius) for chain, radius in zip(chains, radii, strict=True)]
    joined = {end: number for number, ends in enumerate(junctions) for end in ends}
    pairs: set[tuple[Body, Body]] = set()
    for number, ends in enumerate(junctions):
        reach = CONTACT_FREE_RADII * max(radii[end.chain] for end in ends)
        near = sorted(_near(number, reach, chains, junctions, joined))
        pairs |= {(a, b) for a in near for b in near if a.chain < b.chain}
    waiting = sorted(pairs)
    while waiting:
        first, second = waiting.pop()
        steps = [(body, second) for body in _neighbors(first, chains, junctions, joined)]
        steps += [(first, body) for body in _neighbors(second, chains, junctions, joined)]
        for one, other in steps:
            pair = (one, other) if one < other else (other, one)
            if one.chain == other.chain or pair in pairs:
                continue
            if fcl.collide(*(capsules[body.chain][body.segment] for body in pair)):
                pairs.add(pair)
                waiting.append(pair)
    return sorted(pairs)


def _near(
    junction: int, reach: float, chains: Sequence[Chain], junctions: Sequence[Sequence[ChainEnd]], joined: dict[ChainEnd, int]
) -> set[Body]:
    """Return the bodies that begin within `reach` m of a junction, also beyond a short chain's other junction."""
    bodies: set[Body] = set()
    waiting, seen = [(junction, reach)], {junction}
    while waiting:
        at, left = waiting.pop()
        for chain, side in junctions[at]:
            count, length = len(chains[chain].occluded), chains[chain].segment_length
            steps = min(count, 1 + int(np.ceil(left / length)))
            bodies |= {Body(chain, k if side == 0 else count - 1 - k) for k in range(steps)}
            beyond = joined.get(ChainEnd(chain, 1 - side))
            if beyond is not None and beyond not in seen and left > count * length:
                seen.add(beyond)
                waiting.append((beyond, left - count * length))
    return bodies


def _neighbors(
    body: Body, chains: Sequence[Chain], junctions: Sequence[Sequence[ChainEnd]], joined: dict[ChainEnd, int]
) -> list[Body]:
    """Return the bodies that are joined to a body: along its chain, or at a junction."""
    last = len(chains[body.chain].occluded) - 1
    result = [Body(body.chain, k) for k in (body.segment - 1, body.segment + 1) if 0 <= k <= last]
    for side, end in ((0, 0), (1, last)):
        junction = joined.get(ChainEnd(body.chain, side))
        if body.segment == end and junction is not None:
            others = (other for other in junctions[junction] if other.chain != body.chain)
            result += [Body(chain, (len(chains[chain].occluded) - 1) * at) for chain, at in others]
    return result


def _capsules(fcl: Any, chain: Chain, radius: float) -> list[Any]:
    """Return the bodies of a chain as collision objects of FCL: capsules from joint to joint."""
    capsule, middles = fcl.Capsule(radius, chain.segment_length), (chain.joints[1:] + chain.joints[:-1]) / 2
    return [fcl.CollisionObject(capsule, fcl.Transform(*pose)) for pose in zip(link_frames(chain.joints), middles, strict=True)]

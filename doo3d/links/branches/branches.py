"""Find the junctions of branched objects, and return each object as a tree of chains."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.curves import Curves
from ...geometry.polyline import unit
from ...scene.scene import Scene
from ...types import Chain, Floats, Junction, LinearObject
from ...types.display import DOUBTFUL_CONFIDENCE
from ...types.stopwatch import timed
from .attachments import NORMAL_SHORTFALL, end_contacts
from .bodies import body_contacts
from .clouds import gap_links
from .strands import ContactCandidate, SampledChain, ends_of_strands, strands_of
from .tree import choose, cut, linked, nodes_of, parted

MAX_CHAINS = 80
"""Number of chains, the longest, on which junctions are searched, for time: a harness has 10 to 40."""

NOTE = "branches: {} chains were found; junctions are looked for on the {} longest"

MIN_CONTACT_COSINE = 0.5
"""Cosine between an end's tangent and the direction to a chain that it may branch off; at the end of a strand that runs beside
another it is near 0."""


@dataclass(frozen=True)
class Branched:
    """The chains of one frame, cut at junctions, with the junctions and the trees.

    Attributes
    ----------
    chains
        chains from junction to junction or to a tip, ordered by object; in each object the trunk first.
    junctions
        positions at which three or more chains meet.
    objects
        the trees, by descending total length of their chains.
    notes
        messages to the user: there were too many chains to search junctions on all.
    """

    chains: list[Chain]
    junctions: tuple[Junction, ...] = ()
    objects: tuple[LinearObject, ...] = ()
    notes: tuple[str, ...] = ()


def may_branch(chains: Sequence[Chain]) -> bool:
    """Return whether an end of a chain points at another chain so near that it may branch off there.

    It costs far less than `find_branches`, which decides. chains : with joints in m (px in 2-D).
    """
    return any(
        _points_at(joints, chain.radius, other)
        for chain, other in itertools.permutations(chains, 2)
        if not chain.closed
        for joints in (chain.joints, chain.joints[::-1])
    )


def _points_at(joints: Floats, radius: float, other: Chain) -> bool:
    """Return whether the first joint of a chain (N + 1, D) is near another chain and points at it; radius : of the chain."""
    tangent = unit(joints[0] - joints[min(2, len(joints) - 1)])
    offsets = other.joints - joints[0]
    distances = np.linalg.norm(offsets, axis=1)
    nearest = int(distances.argmin())
    reach = other.radius + NORMAL_SHORTFALL * radius + other.segment_length / 2
    points_at_it = offsets[nearest] @ tangent >= MIN_CONTACT_COSINE * distances[nearest]
    return bool(distances[nearest] <= reach and points_at_it)


def branch(chains: list[Chain], scene: Scene) -> Branched:
    """Return the chains cut at their junctions if the settings say that objects may branch; else the chains as they are."""
    return find_branches(chains, scene) if scene.config.merge.branches else Branched(chains)


def branch_notes(chains: Sequence[Chain], scene: Scene) -> tuple[str, ...]:
    """Return the note on chains in space that meet like the branches of one object, if the settings do not search branches."""
    sure = [chain for chain in chains if chain.confidence >= DOUBTFUL_CONFIDENCE]
    if scene.config.merge.branches or scene.config.mode == "2d" or not may_branch(sure):
        return ()
    if not find_branches(sure, scene).junctions:
        return ()
    return ("branches: chains meet as the branches of one object do; if they are, use the preset harness (-c harness)",)


@timed("branches")
def find_branches(chains: Sequence[Chain], scene: Scene) -> Branched:
    """Find the junctions of a frame, cut the chains there, and assemble them to trees.

    At each contact of strands, four explanations compete by cost: a branch (the axes meet at one depth), a crossing (two
    layers, or in an image two strands that are straight there), a touch, or a free end near a strand. In a cloud two ends may
    also be linked across a gap. The junctions and links are the maximum-weight spanning forest of all these: an object is a
    tree, and an end belongs to one junction at most.

    Parameters
    ----------
    chains
        chains along the objects' axes, m (px in 2-D).
    scene
        what was captured, with the settings.

    Returns
    -------
    The chains, cut at the junctions; the junctions; and the objects.
    """
    if not chains:
        return Branched([])
    chains, rest = chains[:MAX_CHAINS], chains[MAX_CHAINS:]
    notes: tuple[str, ...] = (NOTE.format(len(chains) + len(rest), MAX_CHAINS),) if rest else ()
    scene = scene.with_support(Curves.of([chain.joints for chain in chains]))
    strands, chosen = _decided(strands_of(chains), scene)
    strands = [*strands, *strands_of(rest)]
    pieces, junctions, objects = cut(strands, nodes_of(chosen, strands), scene.config.fit.length)
    return Branched(pieces, tuple(junctions), tuple(objects), notes)


def _decided(strands: list[SampledChain], scene: Scene) -> tuple[list[SampledChain], list[ContactCandidate]]:
    """Return the strands, parted and linked, and the contacts chosen, each of one end with one strand.

    The forest is chosen again after opposite branches, which are one strand through their trunk, were parted, and after ends were
    linked.
    """
    bodies = body_contacts(strands, scene)
    chosen = _chosen(bodies, strands, scene)
    while any(len(contact.ends) != 1 for contact in chosen):
        if all(contact.ends for contact in chosen):
            strands = strands_of(linked(strands, chosen), strands)
            bodies = body_contacts(strands, scene)
        else:
            strands, bodies = strands_of(parted(strands, chosen), strands), []
        chosen = _chosen(bodies, strands, scene)
    return strands, chosen


def _chosen(bodies: list[ContactCandidate], strands: list[SampledChain], scene: Scene) -> list[ContactCandidate]:
    """Return the candidates that are junctions or links; bodies : the contacts of two strands away from their ends."""
    ends = ends_of_strands(strands, scene)
    links = gap_links(ends) if scene.shows_surface else []
    return choose([*bodies, *end_contacts(ends, strands, scene), *links], len(strands))

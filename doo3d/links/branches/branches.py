"""Find the junctions of branched objects, and return each object as a tree of chains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.curves import Curves
from ...geometry.polyline import unit
from ...scene.scene import Scene
from ...types import Chain, Junction, LinearObject
from ...types.display import DOUBTFUL_CONFIDENCE
from ...types.stopwatch import timed
from .attachments import NORMAL_SHORTFALL, end_meetings
from .bodies import body_meetings
from .clouds import end_joins
from .strands import free_ends, strands_of
from .tree import choose, cut, joined, nodes_of, parted

MAX_CHAINS = 80
"""Chains at most, the longest, on which junctions are looked for, for time: a harness has 10 to 40."""

NOTE = "branches: {} chains were found; junctions are looked for on the {} longest"


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
        messages to the user: that there were too many chains to look for junctions on all.
    """

    chains: list[Chain]
    junctions: tuple[Junction, ...] = ()
    objects: tuple[LinearObject, ...] = ()
    notes: tuple[str, ...] = ()


MIN_MEETING_COSINE = 0.5
"""Cosine between an end's tangent and the direction to a chain that it may branch off; at the end of a strand that runs beside
another it is near 0."""


def may_branch(chains: Sequence[Chain]) -> bool:
    """Return whether an end of a chain points at another chain so near that it may branch off there.

    It costs far less than `find_branches`, which decides. chains : with joints in m (px in 2-D).
    """
    for chain in chains:
        for joints in () if chain.closed else (chain.joints, chain.joints[::-1]):
            tangent = unit(joints[0] - joints[min(2, len(joints) - 1)])
            for other in chains:
                reach = other.radius + NORMAL_SHORTFALL * chain.radius + other.segment_length / 2
                ways = other.joints - joints[0]
                distances = np.linalg.norm(ways, axis=1)
                nearest = int(distances.argmin())
                if (
                    other is not chain
                    and distances[nearest] <= reach
                    and ways[nearest] @ tangent >= MIN_MEETING_COSINE * distances[nearest]
                ):
                    return True
    return False


def branch(chains: list[Chain], scene: Scene) -> Branched:
    """Return the chains cut at their junctions if the settings say that objects may branch; else the chains as they are."""
    return find_branches(chains, scene) if scene.config.merge.branches else Branched(chains)


def branch_notes(chains: Sequence[Chain], scene: Scene) -> tuple[str, ...]:
    """Return the note on chains in space that meet like the branches of one object, which only some settings look for."""
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
    layers, or in an image two strands that go straight on), a touch, or a free end near a strand. In a cloud two ends may
    also be joined across a gap. The junctions and joins are the maximum-weight spanning forest of all these: an object is a
    tree, and an end belongs to one junction at most. Where branches were joined through their trunk, or ends are joined, the
    forest is chosen anew.

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
    strands = strands_of(chains)
    scene = scene.with_support(Curves.of([chain.joints for chain in chains]))
    config = scene.config
    bodies = body_meetings(strands)
    while True:
        ends = free_ends(strands)
        joins = end_joins(ends, config.merge.gap * scene.gap_unit) if scene.shows_surface else []
        chosen = choose([*bodies, *end_meetings(ends, strands, scene), *joins], strands, ends)
        if any(not meeting.ends for meeting in chosen):
            strands, bodies = strands_of(parted(strands, chosen), strands), []
        elif any(len(meeting.ends) > 1 for meeting in chosen):
            strands = strands_of(joined(strands, ends, chosen), strands)
            bodies = body_meetings(strands)
        else:
            break
    strands = [*strands, *strands_of(rest)]
    pieces, junctions, objects = cut(strands, ends, nodes_of(chosen, strands), config.fit.length)
    return Branched(pieces, tuple(junctions), tuple(objects), notes)

"""Find the junctions of branched objects, and return each object as a tree of chains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...config import MergeConfig
from ...geometry.mask import half_width_in
from ...types import Chain, Crossing, Junction, LinearObject
from .. import FrameContext
from .attachments import end_meetings
from .bodies import body_meetings
from .clouds import gap_links
from .elbows import bridges
from .joins import joined
from .readings import JunctionContext
from .strands import NODE_RADII, free_ends, strands_of
from .tails import without_tails
from .tree import choose, connected, cut, nodes_of, parted

MAX_CHAINS = 80
"""Chains at most, the longest, on which junctions are looked for, for time: a harness has 10 to 40."""

NOTE = "branches: {} chains were found; junctions are looked for on the {} longest"

AXIS_ERROR_RADII = 0.5
"""Radii by which an axis in an image may miss the middle of its strand, where two were followed through one."""


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

    def without_junctions(self, crossings: Sequence[Crossing]) -> tuple[Crossing, ...]:
        """Return the crossings except those at a junction of the two chains, which meet there and do not cross."""
        return tuple(
            each
            for each in crossings
            if not any(
                {each.upper.chain, each.lower.chain} <= {end.chain for end in junction.ends}
                and ((each.point - junction.position) ** 2).sum() < (NODE_RADII * float(junction.radii.max())) ** 2
                for junction in self.junctions
            )
        )


def find_branches(chains: Sequence[Chain], context: FrameContext, config: MergeConfig) -> Branched:
    """Find the junctions of a frame, cut the chains there, and assemble them to trees.

    At each contact of strands, four explanations compete by cost: a branch (the axes meet at one depth), a crossing (two layers,
    each straight on and of constant radius), a touch, or a free end near a strand. The junctions are the maximum-weight spanning
    forest of all contacts: an object is a tree, and an end belongs to one junction at most.

    Parameters
    ----------
    chains
        chains along the objects' axes, m (px in 2-D).
    context
        the data of the frame; visibility and segment length are used.
    config
        section `merge` of the settings: `max_gap`.

    Returns
    -------
    The chains, cut at the junctions; the junctions; and the objects.
    """
    if not chains:
        return Branched([])
    mask = context.foreground.mask
    half_width = (
        half_width_in(mask, AXIS_ERROR_RADII * context.radius)
        if mask is not None and context.foreground.points.shape[1] == 2
        else None
    )
    chains, rest = chains[:MAX_CHAINS], chains[MAX_CHAINS:]
    notes: tuple[str, ...] = (NOTE.format(len(chains) + len(rest), MAX_CHAINS),) if rest else ()
    strands = strands_of(chains, half_width)
    view = JunctionContext.of([chain.joints for chain in chains], context, config)
    strands = strands_of(without_tails(strands, view.viewpoint, context.segment_length), half_width, strands)
    ends = free_ends(strands)
    chosen = choose([*body_meetings(strands, view.viewpoint), *end_meetings(ends, strands, view)], strands, ends)
    if any(meeting.end is None for meeting in chosen):
        strands = strands_of(parted(strands, chosen, view.viewpoint, context.segment_length), half_width, strands)
        ends = free_ends(strands)
        chosen = choose(end_meetings(ends, strands, view), strands, ends)
    if view.is_cloud:
        links = gap_links(ends, *connected(chosen, strands, ends), view.max_gap)
        chains = joined(strands, ends, links, context.segment_length)
        for with_bridges in (False, True):
            if with_bridges:
                found = bridges(strands, connected(chosen, strands, ends)[1], view.max_gap, context.segment_length)
                if not found:
                    break
                chains = [*chains, *found]
            strands = strands_of(chains, None, strands)
            ends = free_ends(strands)
            chosen = choose(end_meetings(ends, strands, view, hidden=True), strands, ends)
    strands = [*strands, *strands_of(rest, half_width)]
    pieces, junctions, objects = cut(strands, ends, nodes_of(chosen, strands), context.segment_length)
    return Branched(pieces, tuple(junctions), tuple(objects), notes)

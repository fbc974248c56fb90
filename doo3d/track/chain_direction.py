"""Reverse the direction of chains, and of the crossings and junctions that refer to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..types import Chain, ChainEnd, Connection, Crossing, Ints, Junction, SegmentRef


def reversed_chain(chain: Chain, backwards: bool, first_joint: int = 0) -> tuple[Chain, Ints]:
    """Return a chain in the opposite direction, or a closed chain from another joint on.

    Parameters
    ----------
    chain
        the chain, of N segments.
    backwards
        True reverses the direction.
    first_joint
        index of the joint of a closed chain to begin with, counted after reversing; 0 for open chains.

    Returns
    -------
    chain : with joints, radii, deviations, occluded and depth-filled segments and connections in the new order.
    segments : (N,) int64; segments[i] is the new index of segment i of the given chain.
    """
    count = len(chain.occluded)
    index = np.arange(count)[::-1] if backwards else np.arange(count)
    index = np.roll(index, -first_joint)
    if not backwards and not first_joint:
        return chain, index
    segments = np.argsort(index)
    if chain.closed:
        joint = np.append(index + backwards, index[0] + backwards) % count
    else:
        joint = np.arange(count + 1)[::-1]
    connections = tuple(sorted(Connection(int(segments[segment]), confidence) for segment, confidence in chain.connections))
    turned = replace(
        chain,
        joints=chain.joints[joint],
        radii=chain.radii[joint],
        occluded=chain.occluded[index],
        depth_filled=chain.depth_filled[index],
        from_time=chain.from_time[index],
        connections=connections,
        deviations=None if chain.deviations is None else chain.deviations[joint],
    )
    return turned, segments


def turn_junction(junction: Junction, backwards: Sequence[bool]) -> Junction:
    """Return a junction after some of the chains were reversed."""
    ends = tuple(ChainEnd(end.chain, 1 - end.end if backwards[end.chain] else end.end) for end in junction.ends)
    return replace(junction, ends=ends)


def renumber_crossings(crossings: Sequence[Crossing], segment_maps: Sequence[Ints]) -> tuple[Crossing, ...]:
    """Return the crossings with the new numbers of their segments, in the order of the chains and along them.

    segment_maps : for each chain, (N,), the new number of each segment, as of `reversed_chain`.
    """

    def renumber(segment: SegmentRef) -> SegmentRef:
        return SegmentRef(segment.chain, int(segment_maps[segment.chain][segment.segment]))

    renumbered = [replace(crossing, upper=renumber(crossing.upper), lower=renumber(crossing.lower)) for crossing in crossings]
    return tuple(sorted(renumbered, key=lambda crossing: sorted((crossing.upper, crossing.lower))))

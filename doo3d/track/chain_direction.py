"""Reverse chains, and update the crossings and junctions that refer to them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..types import Chain, ChainEnd, Connection, Crossing, Ints, Junction, SegmentRef


def reversed_chain(chain: Chain, backwards: bool, first_joint: int = 0) -> tuple[Chain, Ints]:
    """Return a chain in the opposite direction, or a ring started at another joint.

    Parameters
    ----------
    chain
        a chain of N segments.
    backwards
        True reverses the order of the joints.
    first_joint
        for a ring, the index of the joint to start with, counted after reversing; 0 for an open chain.

    Returns
    -------
    chain : with joints, radii, deviations, flags of segments and connections in the new order.
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
    """Return a junction with the ends of reversed chains exchanged.

    backwards : for each chain of the frame, True if it was reversed.
    """
    ends = tuple(ChainEnd(end.chain, 1 - end.end if backwards[end.chain] else end.end) for end in junction.ends)
    return replace(junction, ends=ends)


def renumber_crossings(crossings: Sequence[Crossing], segment_maps: Sequence[Ints]) -> tuple[Crossing, ...]:
    """Return crossings with the new segment numbers, sorted by chain and segment.

    segment_maps : for each chain of N segments, (N,) int, the new number of each segment, as `reversed_chain` returns it.
    """

    def renumber(segment: SegmentRef) -> SegmentRef:
        return SegmentRef(segment.chain, int(segment_maps[segment.chain][segment.segment]))

    renumbered = [replace(crossing, upper=renumber(crossing.upper), lower=renumber(crossing.lower)) for crossing in crossings]
    return tuple(sorted(renumbered, key=lambda crossing: sorted((crossing.upper, crossing.lower))))

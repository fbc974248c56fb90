"""Replace the chains in the detection of a frame by the objects of the sequence."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..geometry.curves import runs
from ..geometry.equal_segments import close_ring
from ..judge.crossings import crossings_of_chains
from ..links.branches import Branched
from ..types import Chain, Connection, Detection
from .junctions import assemble, join_shapes
from .objects import SequenceObject
from .observations import LENGTH_ERROR, Observation
from .registration import exact_lengths
from .shape import Shape

BREAK_NOTE = "sequence: object {id} is not seen here, and for longer than sequence.max_gap: it has no chain in this frame"
"""Note of a frame in which an object is missing between frames that show it."""

CONTRADICTED_NOTE = "sequence: object {id} has no chain in this frame: where it was expected, the camera sees another surface"
"""Note of a frame in which an object is left out because the camera contradicts it."""

MAX_CONTRADICTED = 0.5
"""Fraction of the joints of an object that the camera may contradict; above it, the object is left out."""


def frame_result(
    observation: Observation,
    objects: Sequence[SequenceObject],
    shapes: Sequence[Shape | None],
    followed: set[int],
    is_branched: bool,
    min_confidence: float,
) -> Detection:
    """Return the detection of a frame with the chains of the sequence.

    Parameters
    ----------
    observation
        the observation of the frame by itself.
    objects
        the objects of the capture.
    shapes
        for each object its shape in the frame; None if it is missing.
    followed
        indices of the frame's own chains that are objects, or parts of them. Other rings are kept.
    is_branched
        whether branched objects are searched.
    min_confidence
        smallest confidence of the frame's own chains, unless the caller specified the object or the number of objects.
    """
    single = observation.detection
    least = 0.0 if observation.is_given else min_confidence
    if not objects:
        return single.confident(least)
    seen = [None if shape is not None and shape.contradicted > MAX_CONTRADICTED else shape for shape in shapes]
    missing = tuple(
        (BREAK_NOTE if before is None else CONTRADICTED_NOTE).format(id=item.id)
        for item, before, shape in zip(objects, shapes, seen, strict=True)
        if shape is None
    )
    others = [chain for number, chain in enumerate(single.chains) if chain.closed and number not in followed]
    rings = [replace(chain, id=None) for chain in others if chain.confidence >= least]
    shapes = join_shapes(objects, seen)
    known = [None if shape is None else as_chain(item, shape) for item, shape in zip(objects, shapes, strict=True)]
    if is_branched:
        rings += [chain for chain in known if chain is not None and chain.closed]
        found = assemble(objects, [chain if chain is not None and not chain.closed else None for chain in known], rings)
    else:
        found = Branched(sorted([*(chain for chain in known if chain is not None), *rings], key=lambda chain: -chain.length))
    return replace(
        single,
        chains=tuple(found.chains),
        crossings=crossings_of_chains(found.chains, single.coordinates, found.junctions),
        junctions=found.junctions,
        objects=found.objects,
        notes=(*single.notes, *missing),
    )


def as_chain(item: SequenceObject, shape: Shape) -> Chain:
    """Return an object in one frame as a chain of its number of segments."""
    seen = shape.seen[:-1] & shape.seen[1:]
    length = item.segment_length
    joints = close_ring(shape.joints[:-1], length) if item.closed else exact_lengths(shape.joints, length)
    confidence = float(np.exp(-shape.cost)) * _near(item, shape)
    hidden = runs(~seen)
    if item.closed:  # a gap across the first joint starts before the last joint
        gaps = [first for first, _ in hidden if first > 0 or (seen[-1] and not seen[0])]
    else:
        gaps = [first for first, end in hidden if first > 0 and end < len(seen)]  # a hidden end is no gap
    return Chain(
        joints,
        length,
        item.radius,
        occluded=~seen,
        depth_filled=~(shape.measured[:-1] & shape.measured[1:]),
        from_time=~seen & shape.from_time[:-1],
        connections=tuple(Connection(gap, confidence) for gap in gaps),
        id=item.id,
        confidence=confidence,
        deviations=shape.deviations,
        closed=item.closed,
    )


def _near(item: SequenceObject, shape: Shape) -> float:
    """Return the probability that all joints are nearer to the object than LENGTH_ERROR of its length, 0 to 1.

    It is that of the joint of the largest deviation, which stands for all: 1 - exp(-(limit / deviation)^2). 1 if deviations are
    unknown.
    """
    if shape.deviations is None:
        return 1.0
    largest = float(np.linalg.norm(shape.deviations, axis=1).max())
    return 1 - float(np.exp(-((LENGTH_ERROR * item.length / max(largest, np.finfo(float).tiny)) ** 2)))

"""Carry what is hidden of an object over time, from where it was seen last and is seen next."""

from __future__ import annotations

from ..kernels import carry_hidden
from ..types import Bools, Floats


def carried(joints: Floats, seen: Bools, segment: float) -> Floats:
    """Return the joints (T, M, 3) m of an open object with those that are hidden carried from other frames.

    A hidden joint between seen ones is where it was seen last, moved and turned since as the seen joints beside it; the same from
    when it is seen next, and both averaged by how near they are in time. An error of one place stays there. A hidden part that
    goes on to an end is laid along its segments, whose directions are averaged instead: that keeps its length, which averaged
    places do not. Joints that are never seen keep their shape, and all joints of a frame that shows nothing.

    seen : (T, M) bool, which joints the frames show. segment : m, distance of neighboring joints; a straight part does not turn
    round itself, as if points that far off it had not turned.
    """
    return carry_hidden(joints, seen, segment)

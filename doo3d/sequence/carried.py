"""Carry what is hidden of an object over time, from where it was seen last and is seen next."""

from __future__ import annotations

from ..kernels import carry_hidden
from ..types import Bools, Floats


def carried(joints: Floats, seen: Bools, segment: float) -> Floats:
    """Return the joints (T, M, 3) m of an open object with those that are hidden carried from other frames.

    A hidden segment has the direction of when it was seen last, turned since as the seen joints beside it have; the same from
    when it is seen next, and both averaged by how near they are in time. Hidden joints are laid along these segments between the
    seen joints beside them: averaged directions keep the length of a part that slides along itself, and averaged positions do
    not. Joints that are never seen keep their shape, and all joints of a frame that shows nothing.

    seen : (T, M) bool, which joints the frames show. segment : m, distance of neighboring joints; a straight part does not turn
    round itself, as if points that far off it had not turned.
    """
    return carry_hidden(joints, seen, segment)

"""Carry what is hidden of an object over time, from where it was seen last and is seen next."""

from __future__ import annotations

from ..kernels import carry_hidden
from ..types import Bools, Floats

NEAR = 0.4
"""m of an object whose motion a hidden part beside it follows: less turns with each bend, and more does not turn with the part.
All 480 frames of four dragged cables are right, and 446 with 0.2 m; with 0.6 m fewer frames of stereo cameras are."""


def carried(joints: Floats, seen: Bools, segment: float) -> Floats:
    """Return the joints (T, M, 3) m of an open object with those that are hidden carried from other frames.

    A hidden segment has the direction of when it was seen last, turned since as the seen joints near it have; the same from when
    it is seen next, and both averaged by how near they are in time. Hidden joints are laid along these segments between the seen
    joints beside them: averaged directions keep the length of a part that slides along itself, and averaged positions do not.
    Joints that are never seen keep their shape, and all joints of a frame that shows nothing.

    seen : (T, M) bool, which joints the frames show. segment : m, distance of neighboring joints; a straight part does not turn
    round itself, as if points that far off it had not turned.
    """
    return carry_hidden(joints, seen, segment, round(NEAR / segment))

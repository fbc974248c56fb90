"""The shape of an object in one frame, as the second pass finds it."""

from __future__ import annotations

from dataclasses import dataclass

from ..types import Bools, Floats, Ints


@dataclass(frozen=True)
class Shape:
    """The shape of an object in one frame.

    Attributes
    ----------
    joints
        (M + 1, 3) m, positions.
    seen
        (M + 1,) bool, True for joints seen in the frame.
    age
        (M + 1,) int, frames since each joint was seen last.
    cost
        misfit of the frame's strands to the expected shape, in squared standard deviations; 0 for an anchor.
    from_time
        (M + 1,) bool, True for joints whose positions come from other frames only.
    measured
        (M + 1,) bool, True for seen joints whose depth was measured.
    deviations
        (M + 1, 2) m, as of `types.Chain`; None if unknown.
    """

    joints: Floats
    seen: Bools
    age: Ints
    cost: float
    from_time: Bools
    measured: Bools
    deviations: Floats | None = None

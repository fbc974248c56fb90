"""The shape of an object in one frame, as the second pass determines it."""

from dataclasses import dataclass

from ..types import Bools, Floats, Ints


@dataclass(frozen=True)
class Shape:
    """The shape of an object of M segments in one frame.

    Attributes
    ----------
    joints
        (M + 1, 3) m, positions of the joints.
    seen
        (M + 1,) bool, True for joints that are visible in the frame.
    age
        (M + 1,) int, number of frames since each joint was last visible.
    cost
        misfit between the strands of the frame and the expected shape, in squared standard deviations; 0 for an anchor.
    from_time
        (M + 1,) bool, True for joints whose positions come from other frames only.
    measured
        (M + 1,) bool, True for visible joints with measured depth.
    contradicted
        fraction of the joints where the camera sees another surface in full view, 0 to 1.
    deviations
        (M + 1, 2) m, standard deviations across and along the ray, as in `types.Chain`; None if unknown.
    """

    joints: Floats
    seen: Bools
    age: Ints
    cost: float
    from_time: Bools
    measured: Bools
    contradicted: float = 0.0
    deviations: Floats | None = None

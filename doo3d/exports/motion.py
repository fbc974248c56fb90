"""Compute velocities and accelerations of joints from the frames before and after."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydantic import Field

from ..types import Chain, Detection, Floats
from .base import Export, times


class JointMotion(NamedTuple):
    """The motion of the joints of one chain in one frame.

    Attributes
    ----------
    velocity
        (N + 1, D) m/s (px/s in 2-D), in the coordinates of the joints; NaN if unknown.
    acceleration
        (N + 1, D) m/s² (px/s² in 2-D), likewise.
    """

    velocity: Floats
    acceleration: Floats


class MotionExport(Export):
    """The base class of export formats with the velocity and the acceleration of each joint."""

    rate: float | None = Field(
        None, gt=0, description="frames/s, for velocities in captures without timestamps; default: velocities unknown there"
    )

    def motions_of(self, frames: Sequence[Detection]) -> list[list[JointMotion]]:
        """Return the motion of each chain of each frame: central differences between the frame before and the frame after.

        The frames may be unevenly spaced in time: velocity and acceleration are the derivatives of the parabola through a joint's
        three positions. The motion is NaN if one of the two frames has no chain with the same id, number of joints and
        coordinates; in the first and the last frame; for rings, whose first joint may change; and if timestamps are missing or do
        not increase.

        frames : the frames of a capture, in order.
        """
        if self.rate is None:
            stamps = [math.nan if frame.timestamp is None else frame.timestamp for frame in frames]
        else:
            stamps = times(frames, self.rate)
        motions = []
        for i, frame in enumerate(frames):
            around = [frames[i - 1], frames[i + 1]] if 0 < i < len(frames) - 1 else []
            steps = np.diff(stamps[i - 1 : i + 2])
            motions.append(
                [_motion(chain, [same_chain(chain, frame, other) for other in around], steps) for chain in frame.chains]
            )
        return motions


def same_chain(chain: Chain, frame: Detection, other: Detection) -> Chain | None:
    """Return the chain of another frame with the same id, number of joints and coordinates; None if there is none.

    Parameters
    ----------
    chain
        the chain.
    frame
        the frame that has the chain.
    other
        the frame to search.
    """
    if chain.id is None or other.coordinates != frame.coordinates:
        return None
    alike = (each for each in other.chains if each.joints.shape == chain.joints.shape and each.closed == chain.closed)
    return next((each for each in alike if each.id == chain.id), None)


def _motion(chain: Chain, around: list[Chain | None], steps: Floats) -> JointMotion:
    """Return the motion of a chain from its neighbors in time; steps : (2,) time to each of them, s."""
    known = [each for each in around if each is not None]
    if len(known) < 2 or chain.closed or not (steps > 0).all():
        unknown = np.full(chain.joints.shape, np.nan)
        return JointMotion(unknown, unknown)
    before, after = (chain.joints - known[0].joints) / steps[0], (known[1].joints - chain.joints) / steps[1]
    velocity = (before * steps[1] + after * steps[0]) / steps.sum()
    return JointMotion(velocity, 2 * (after - before) / steps.sum())

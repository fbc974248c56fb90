"""Transform observations of a moving camera to the world frame, and shapes back."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..fusion.camera_at_rest import camera_moves
from ..types import Floats
from ..types.pose import in_frame_of
from .observations import Observation


def in_world(observations: Sequence[Observation]) -> list[Observation]:
    """Return observations in the world frame if the camera moves, else unchanged.

    They also stay unchanged if a frame with chains or strands has no pose.
    """
    known = [observation.pose for observation in observations if observation.pose is not None]
    if not known or any(map(_lacks_pose, observations)) or not camera_moves(np.array(known)):
        return list(observations)
    result, pose = [], known[0]
    for observation in observations:
        pose = pose if observation.pose is None else observation.pose
        result.append(_to_world(observation, pose))
    return result


def _lacks_pose(observation: Observation) -> bool:
    """Return whether an observation has chains or strands but no pose."""
    return observation.pose is None and bool(observation.detection.chains or observation.strands)


def _to_world(observation: Observation, pose: Floats) -> Observation:
    """Return an observation transformed by a pose (4, 4), camera to world, m."""
    strands = (
        replace(strand, points=in_frame_of(pose, strand.points), sight=strand.sight @ pose[:3, :3].T)
        for strand in observation.strands
    )
    return replace(observation, detection=observation.detection.transformed(pose), strands=tuple(strands), pose=pose)


def is_of_camera(observations: Sequence[Observation]) -> bool:
    """Return whether all observations are in a camera frame, with depth along rays."""
    return all(observation.detection.coordinates == "camera" for observation in observations)


def poses_of(observations: Sequence[Observation]) -> Floats:
    """Return the camera poses (T, 4, 4) m of observations transformed by `in_world`.

    (0, 4, 4) for observations in another frame than the world.
    """
    if not observations or observations[0].detection.coordinates != "world" or observations[0].pose is None:
        return np.zeros((0, 4, 4))
    return np.array([observation.pose for observation in observations])


def in_camera(pose: Floats, points: Floats) -> Floats:
    """Return points (N, 3) m of the world in the frame of a camera.

    pose : (4, 4) m, camera to world.
    """
    return np.ascontiguousarray((points - pose[:3, 3]) @ pose[:3, :3])

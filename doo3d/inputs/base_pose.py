"""The pose of the camera in a robot's base frame, in which the results of a capture are then given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from ..errors import InputError
from ..types import Floats
from .capture import Capture, FrameData, FrameRef


class BasePoseCapture:
    """A capture whose results are given in a robot's base frame, or any other frame in which the camera's pose is known.

    Loading a frame that has no pose raises InputError if `pose` is None.

    Parameters
    ----------
    capture
        the frames.
    pose
        (4, 4) m, camera to base: p_base = pose @ p_camera, the same for all frames; None takes each frame's own pose.
    source
        the option or file that the pose comes from, for errors.

    Attributes
    ----------
    base_pose
        the pose as nested lists, or the option ("capture", "tf:base_link"), for the manifest.
    """

    def __init__(self, capture: Capture, pose: Floats | None, source: str) -> None:
        self.path, self.format = capture.path, capture.format
        for name in ("masks", "topics", "notes", "extra_files"):
            if hasattr(capture, name):
                setattr(self, name, getattr(capture, name))
        self.base_pose: Any = source if pose is None else pose.tolist()
        self.frames: Sequence[FrameRef] = [replace(frame, loader=partial(_load, frame, pose, source)) for frame in capture.frames]


def _load(frame: FrameRef, pose: Floats | None, source: str) -> FrameData:
    loaded = frame.load()
    base_pose = loaded.pose if pose is None else pose
    if base_pose is None:
        raise InputError(
            f"frame {frame.name} has no camera pose, which pose={source} needs (doo3d info says whether there are poses): give "
            "the pose itself, as a file or x,y,z,qx,qy,qz,qw",
            code="pose-missing",
        )
    return replace(loaded, base_pose=base_pose)

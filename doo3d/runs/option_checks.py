"""What options of a run can be used together: the pose in the robot's base frame, fused views, sequences."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import ConfigError, InputError

if TYPE_CHECKING:
    from ..config import Config
    from ..inputs import Capture, ReadOptions


def check_one_mode(fuse_views: bool, sequence: bool) -> None:
    """Check that frames are not to be both fused to one cloud and detected as a sequence.

    Raises
    ------
    InputError : they are.
    """
    if fuse_views and sequence:
        raise InputError(
            "--fuse-views is for an object at rest, --sequence for one that moves: give one", code="options-conflict"
        )


def check_rig_use(capture: Capture, fuse_views: bool) -> None:
    """Check that the frames of a rig are not to be fused again.

    Raises
    ------
    InputError : they are.
    """
    if capture.options.cameras is not None and fuse_views:
        raise InputError("--cameras and --fuse-views: frames of a rig are detected each: leave out one", code="options-conflict")


def check_pose_use(options: ReadOptions, config: Config, fuse_views: bool) -> None:
    """Check that the pose of the camera in the robot's base frame, if one is given, can be used with the other options.

    Parameters
    ----------
    options
        the options for reading, with `pose`.
    config
        the configuration of the run.
    fuse_views
        whether the frames are fused to one cloud.

    Raises
    ------
    ConfigError : the config is for images, or one pose is given for views that are fused by poses of their own.
    """
    if options.pose is None:
        return
    if config.mode == "2d":
        raise ConfigError("--pose moves chains in space, and the config is for images (mode: 2d)", code="options-conflict")
    if fuse_views and not isinstance(options.pose, str):
        raise ConfigError(
            "--fuse-views needs a pose per frame and gives chains in the frame of these poses: give --pose tf:FRAME, or the "
            "poses in the base frame by --input-option trajectory=FILE",
            code="options-conflict",
        )

"""Check which options of a run can be combined: pose in the robot's base frame, fused views, sequences, rigs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import ConfigError, InputError

if TYPE_CHECKING:
    from ..config import Config
    from ..inputs import ReadOptions


def check_use(options: ReadOptions, config: Config, fuse_views: bool, sequence: bool, instances: bool, choice: bool) -> None:
    """Check that the options of a run can be used together.

    Parameters
    ----------
    options
        the options for reading, with `pose` and `cameras`.
    config
        the configuration of the run.
    fuse_views
        whether the frames are fused to one cloud.
    sequence
        whether the frames are detected as a sequence.
    instances
        whether instance labels are written.
    choice
        whether points or a box choose objects in the image.

    Raises
    ------
    InputError : frames would be both fused and detected as a sequence, the fused frames of a rig would be fused again, or the
        pixels of fused frames would be labelled or pointed at.
    ConfigError : a pose is given with a config for images, or a single pose for views that are fused by their own poses.
    """
    if fuse_views and sequence:
        raise InputError(
            "--fuse-views is for an object at rest, --sequence for one that moves: give one", code="options-conflict"
        )
    if fuse_views and (instances or choice):
        what = "--instances" if instances else "--points and --box"
        raise InputError(f"--fuse-views makes a cloud, which has no image for {what}: leave out one", code="options-conflict")
    if options.pose is not None and config.mode == "2d":
        raise ConfigError("--pose moves chains in space, and the config is for images (mode: 2d)", code="options-conflict")
    if fuse_views and options.pose is not None and not isinstance(options.pose, str):
        raise ConfigError(
            "--fuse-views needs a pose per frame and gives chains in the frame of these poses: give --pose tf:FRAME, or the "
            "poses in the base frame by --input-option trajectory=FILE",
            code="options-conflict",
        )
    if fuse_views and options.cameras is not None:
        raise InputError("--cameras and --fuse-views: frames of a rig are detected each: leave out one", code="options-conflict")

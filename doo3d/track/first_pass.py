"""Detect in each frame of a sequence by itself: the first pass."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..config import Config
from ..errors import InputError
from ..pipeline import detect_with_stages
from ..types import Array, Cloud, Detection, Frame, View, check_mask
from ..types.pose import as_pose
from .background import BackgroundView
from .image_strands import strands_in_image
from .observations import Observation, observe

SMOOTHING_SHARE = 0.7
"""Fraction of `segment.strand_smoothing_radii` used in the frames of a sequence. Waves of depth that remain change from frame
to frame and are smoothed over time; bends that are smoothed away are lost. For nine moving cables in front of stereo
cameras 48 % of the frames are right with 0.7 and 35 % with 1."""

EMPTY_FRAME_CODES = ("depth-none", "mask-without-depth", "mask-empty", "cloud-without-extent")
"""Error codes of a frame without usable depth on the object: such a frame is filled from other frames. Other errors are
raised."""


def check_mode(config: Config) -> None:
    """Raise an InputError if the config is for images."""
    if config.mode == "2d":
        raise InputError(
            "a sequence is followed in space, and the config is for images (mode: 2d): use a 3-D one (-c default)",
            code="config-mode",
        )


def first_pass_config(config: Config) -> Config:
    """Return the settings for frames of a sequence, with less smoothing along strands."""
    smoothing = SMOOTHING_SHARE * config.segment.strand_smoothing_radii
    return config.model_copy(update={"segment": config.segment.model_copy(update={"strand_smoothing_radii": smoothing})})


def observe_frame(frame: Frame | Cloud, config: Config, mask: Array | None = None, pose: ArrayLike | None = None) -> Observation:
    """Detect in one frame by itself; return the detection with all visible strands.

    A frame that cannot be used by itself, such as one without depth, gives an observation without chains and with a note; its
    strands come from its color image. If neither a mask nor the color of the object is given, `merge.chains` does not force the
    chains of the frame, which is then detected a second time.

    Parameters
    ----------
    frame, config, mask
        as for `detect`.
    pose
        (4, 4) m, camera to world, of a camera that may move; None if unknown.

    Raises
    ------
    InputError : the frame cannot be used, or the pose is not a rigid motion.
    """
    to_world = None if pose is None else as_pose(pose)
    config, is_counted = first_pass_config(config), config.merge.chains is not None
    try:
        detection, stages = detect_with_stages(frame, config, mask)
        if config.merge.chains is not None and not stages.scene.object_given:
            # the number is of objects in the capture: a frame by itself would join them to clutter to reach it
            config = config.model_copy(update={"merge": config.merge.model_copy(update={"chains": None})})
            detection, stages = detect_with_stages(frame, config, mask)
    except InputError as error:
        if error.code not in EMPTY_FRAME_CODES:
            raise
        coordinates = frame.coordinates if isinstance(frame, Cloud) else "camera"
        detection = Detection(
            chains=(), coordinates=coordinates, frame=frame.name, timestamp=frame.timestamp, notes=(str(error),)
        )
        strands = strands_in_image(frame, config, mask) if isinstance(frame, Frame) else ()
        if isinstance(frame, Frame):
            shape = frame.depth.shape
            given = np.zeros(shape, dtype=bool) if mask is None else check_mask(mask, shape)
            detection = replace(detection, view=View.of(given, shape, frame.camera))
        is_masked = mask is not None or bool(config.segment.ranges)
        return Observation(detection, strands, to_world, _background(frame, mask), is_masked or is_counted, is_masked)
    observation = observe(detection, stages, config)
    is_given = observation.is_given or is_counted
    return replace(observation, pose=to_world, background=_background(frame, stages.scene.mask), is_given=is_given)


def _background(frame: Frame | Cloud, mask: Array | None) -> BackgroundView | None:
    """Return a small view of the background of a frame; None for a cloud."""
    if isinstance(frame, Cloud):
        return None
    return BackgroundView.of(frame, None if mask is None else check_mask(mask, frame.depth.shape))

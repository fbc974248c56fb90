"""Cameras of data sets whose folders hold no camera file, by the names of their images."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from .calibration import Pinhole
from .images import Size


class DefaultCamera(NamedTuple):
    """A camera that a data set documents, and the note that says so."""

    pinhole: Pinhole
    note: str


_SIZE = (640, 480)
_SEVEN_SCENES = re.compile(r"frame-\d{6}\.depth\.png")
_SEVEN_SCENES_CAMERA = DefaultCamera(
    # Shotton et al., Scene Coordinate Regression Forests (CVPR 2013): the data set's page
    (585.0, 585.0, 320.0, 240.0),
    "the camera is the default of the data set 7-Scenes, fx = fy = 585 px: give --camera FILE if the recording is of your own",
)


def default_camera(depth: Sequence[Path], size: Size | None) -> DefaultCamera | None:
    """Return the camera of a data set that is recognized by its first depth image and their size; None for any other folder."""
    is_seven_scenes = bool(depth) and size == _SIZE and _SEVEN_SCENES.fullmatch(depth[0].name) is not None
    has_pose = is_seven_scenes and depth[0].with_name(depth[0].name.replace(".depth.png", ".pose.txt")).is_file()
    return _SEVEN_SCENES_CAMERA if has_pose else None

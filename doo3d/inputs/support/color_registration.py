"""Color images of another size than the depth images: aligned where both cameras are known, refused where they are not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import InputError
from ...types import Array, Camera, Floats
from .calibration import Calibration
from .camera_search import fits, search_folders
from .color_alignment import align_color
from .depth_frames import check_pose
from .images import Size
from .roles import words_of

_EXTRINSICS = ("extrinsic_depth.txt", "extrinsic_color.txt")  # of ScanNet's exporter: camera to device, 4x4
_COLOR_WORDS = {"color", "colour", "rgb"}


class ColorCamera(NamedTuple):
    """The camera of color images. extrinsics : (4, 4), depth camera to color camera, x_color = extrinsics @ x_depth, m."""

    camera: Camera
    extrinsics: Floats

    def align(self, color: Array, depth: Array, camera: Camera) -> Array:
        """Return the color of each pixel of a depth image (H, W) m of `camera`; `color` itself if it is not of this camera."""
        if color.shape[:2] != (self.camera.height, self.camera.width):
            return color
        return align_color(color, self.camera, depth, camera, self.extrinsics)


def find_color_camera(root: Path, cameras: Sequence[Calibration], size: Size) -> ColorCamera | None:
    """Return the camera of the color images, if a file beside them describes it and its position; None if not.

    Parameters
    ----------
    root
        the folder of the capture.
    cameras
        the cameras in the files beside the images.
    size
        (width, height) of the color images, px.

    Raises
    ------
    InputError : a file of extrinsics holds no pose.
    """
    named = [camera for camera in cameras if fits(camera, size) and set(words_of(camera.label)) & _COLOR_WORDS]
    files = next((found for folder in search_folders(root) if all(map(Path.is_file, found := _extrinsics_in(folder)))), None)
    if not named or files is None:
        return None
    depth, color = (check_pose(file.read_text(encoding="utf-8-sig", errors="replace").split(), str(file)) for file in files)
    return ColorCamera(Camera(*named[0].pinhole, *size), np.linalg.inv(color) @ depth)


def sizes_differ(root: Path, color: Size, depth: Size) -> InputError:
    """Return the error for color images of another size than the depth images, whose cameras are not both known."""
    return InputError(
        f"{root}: the color images are {color[0]}x{color[1]} px, the depth images {depth[0]}x{depth[1]}: to align them, save "
        "intrinsic_depth.txt, intrinsic_color.txt, extrinsic_depth.txt and extrinsic_color.txt (4x4, camera to device) in "
        "intrinsic/; to read the depth alone, give --input-option color=none",
        code="color-size",
    )


def _extrinsics_in(folder: Path) -> tuple[Path, Path]:
    return folder / _EXTRINSICS[0], folder / _EXTRINSICS[1]

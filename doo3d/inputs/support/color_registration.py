"""Align color images to the pixels of a depth image of another camera."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from ...errors import InputError
from ...types import Array, Bools, Camera, Floats
from .calibration import Calibration
from .camera_search import fits, search_folders
from .depth_frames import read_frame_pose
from .images import Size
from .listing import words_of

_EXTRINSICS = ("extrinsic_depth.txt", "extrinsic_color.txt")  # of ScanNet's exporter: camera to device, 4x4
_COLOR_WORDS = {"color", "colour", "rgb"}
_MAX_ASPECT_ERROR = 0.02  # relative, of a color image against the depth image: sizes are rounded
_OCCLUSION_TOLERANCE = 0.02  # relative depth: a point farther than the nearest by more than this is occluded


def align_color(color: Array, color_camera: Camera, depth: Array, camera: Camera, extrinsics: Floats) -> Array:
    """Return the color of each pixel of a depth image; black where the color camera does not see the surface.

    Each depth pixel is projected into the color image and gets the color of the nearest pixel there. Surfaces occluded from the
    color camera are found with a z-buffer. A pixel without depth is projected at the depth of the nearest pixel with depth, so
    that objects seen by the color camera alone keep their color.

    Parameters
    ----------
    color
        (h, w, 3) uint8 RGB, the image of `color_camera`, h x w px.
    color_camera
        pinhole camera of the color image.
    depth
        (H, W) float m, the image of `camera`, H x W px; 0 or not finite where there is no measurement.
    camera
        pinhole camera of the depth image.
    extrinsics
        (4, 4), depth camera to color camera: x_color = extrinsics @ x_depth, m.

    Returns
    -------
    (H, W, 3) uint8 RGB.
    """
    valid = np.isfinite(depth) & (depth > 0)
    if not valid.any():
        return np.zeros((*depth.shape, 3), np.uint8)
    u, v, z = _projected(_filled(depth, valid), camera, color_camera, extrinsics)
    inside = (u > -0.5) & (v > -0.5) & (u < color_camera.width - 0.5) & (v < color_camera.height - 0.5) & (z > 0)
    visible = inside & _in_front(u, v, z, inside, valid, color_camera, camera)
    result = np.asarray(cv2.remap(color, u, v, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE))
    result[~visible] = 0
    return result


def _projected(distance: Floats, camera: Camera, color_camera: Camera, extrinsics: Floats) -> tuple[Floats, Floats, Floats]:
    """Project each depth pixel: column and row in the color image, px, and depth in the color camera, m; (H, W) float32."""
    x = ((np.arange(camera.width) - camera.cx) / camera.fx)[None].astype(np.float32)
    y = ((np.arange(camera.height) - camera.cy) / camera.fy)[:, None].astype(np.float32)
    rotation, translation = extrinsics[:3, :3].astype(np.float32), extrinsics[:3, 3].astype(np.float32)
    a, b, z = (distance * (rotation[k, 0] * x + rotation[k, 1] * y + rotation[k, 2]) + translation[k] for k in range(3))
    safe = np.where(z > 0, z, np.float32(np.inf))
    return (
        np.float32(color_camera.fx) * a / safe + np.float32(color_camera.cx),
        np.float32(color_camera.fy) * b / safe + np.float32(color_camera.cy),
        z,
    )


def _in_front(u: Floats, v: Floats, z: Floats, inside: Bools, valid: Bools, color_camera: Camera, camera: Camera) -> Bools:
    """Return for each depth pixel whether no measured surface occludes it from the color camera, (H, W) bool.

    The test is a z-buffer whose cells are slightly larger than a projected depth pixel.
    """
    cell = np.float32(max(1.0, 1.5 * color_camera.fx / camera.fx, 1.5 * color_camera.fy / camera.fy))
    rows, columns = int(color_camera.height / cell) + 2, int(color_camera.width / cell) + 2
    cells = np.zeros(z.shape, np.intp)
    cells[inside] = ((v[inside] + 0.5) / cell).astype(np.intp) * columns + ((u[inside] + 0.5) / cell).astype(np.intp)
    nearest = np.full(rows * columns, np.inf, np.float32)
    measured = inside & valid
    np.minimum.at(nearest, cells[measured], z[measured])
    return np.asarray(z <= nearest[cells] * np.float32(1 + _OCCLUSION_TOLERANCE))


def _filled(depth: Array, valid: Bools) -> Floats:
    """Fill pixels without depth with the depth of the nearest pixel that has one: (H, W) m."""
    if valid.all():
        return np.asarray(depth, dtype=np.float32)
    _, labels = cv2.distanceTransformWithLabels((~valid).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    values = np.zeros(labels.max() + 1, np.float32)
    values[labels[valid]] = depth[valid]
    return np.asarray(values[labels])


def scaled_to_depth(color: Array, shape: tuple[int, ...], where: str) -> Array:
    """Scale a color image (h, w, 3) uint8 with the same view to the shape (H, W) of the depth image.

    Raises
    ------
    InputError : the image has another aspect ratio; the message begins with `where`.
    """
    height, width = shape
    if abs(color.shape[1] * height / (color.shape[0] * width) - 1) > _MAX_ASPECT_ERROR:
        sizes = f"color is {color.shape[1]}x{color.shape[0]}, depth {width}x{height}"
        remedy = "the two must have the same aspect ratio, or give --input-option color=none"
        raise InputError(f"{where}: {sizes}: {remedy}", code="color-size")
    return color if color.shape[:2] == shape else np.asarray(cv2.resize(color, (width, height), interpolation=cv2.INTER_AREA))


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
    """Find the camera of the color images and its position in files beside them; None if one is missing.

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
    InputError : a file of extrinsics does not hold a pose.
    """
    named = [camera for camera in cameras if fits(camera, size) and set(words_of(camera.label)) & _COLOR_WORDS]
    folders = [folder for folder in search_folders(root) if all((folder / name).is_file() for name in _EXTRINSICS)]
    if not named or not folders:
        return None
    depth, color = (read_frame_pose(folders[0] / name) for name in _EXTRINSICS)
    if depth is None or color is None:
        return None
    return ColorCamera(Camera(*named[0].pinhole, *size), np.linalg.inv(color) @ depth)


def sizes_differ(root: Path, color: Size, depth: Size) -> InputError:
    """Return the error for color and depth images of different sizes whose cameras are not both known."""
    return InputError(
        f"{root}: the color images are {color[0]}x{color[1]} px, the depth images {depth[0]}x{depth[1]}: to align them, save "
        "intrinsic_depth.txt, intrinsic_color.txt, extrinsic_depth.txt and extrinsic_color.txt (4x4, camera to device) in "
        "intrinsic/; to read the depth alone, give --input-option color=none",
        code="color-size",
    )

"""Select the pixels that differ from a reference image of the scene without the object (background subtraction)."""

import os
from functools import lru_cache

import cv2
import numpy as np

from ...config import SegmentConfig
from ...errors import InputError, unread_code
from ...guard.image_size import announced_size, read_encoded
from ...guard.limits import check_pixels
from ...types import Array, Bools, Cloud, Frame, Image
from .result import require_image

READ_UPRIGHT = cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH
"""OpenCV flags for a reference of photographs: rotated by its EXIF orientation, as photographs are when they are read."""

READ_AS_STORED = cv2.IMREAD_UNCHANGED
"""OpenCV flags for a reference of frames: not rotated, since the depth of a frame would not be rotated with its color."""


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> Bools:
    """Select the pixels that differ from a reference image of the scene without the object.

    With a 16-bit depth image as reference, a pixel of a Frame is selected if it is nearer to the camera than the reference by
    more than `depth_difference` (m). With a color image as reference, a pixel is selected if its color differs by more than
    `color_difference` (distance in 8-bit RGB).

    Parameters
    ----------
    data
        a Frame or an Image.
    config
        section `segment` of the settings: `reference` (path of the image), `reference_depth_scale`, and the two differences.
    seed
        not used.

    Returns
    -------
    (H, W) bool.

    Raises
    ------
    InputError : the data is a cloud; the reference is unreadable, of another size or of another type; the reference is in color
        and the frame has no color.
    """
    data = require_image(data, "background")
    reference = _read_reference(str(config.reference), READ_UPRIGHT if isinstance(data, Image) else READ_AS_STORED)
    height, width = data.color.shape[:2] if isinstance(data, Image) else data.depth.shape
    if reference.shape[:2] != (height, width):
        raise InputError(
            f"segment.reference {config.reference} is {reference.shape[1]}x{reference.shape[0]}, "
            f"the frame {width}x{height}: take it with the same camera mode",
            code="reference-size",
        )
    if reference.ndim == 2 and reference.dtype == np.uint16 and isinstance(data, Frame):
        depth = reference / config.reference_depth_scale
        return np.asarray((data.depth > 0) & (depth > 0) & (depth - data.depth > config.depth_difference))
    if reference.ndim != 3 or reference.shape[2] != 3 or reference.dtype != np.uint8:
        raise InputError(
            f"segment.reference {config.reference} has shape {reference.shape} and type {reference.dtype}: "
            "expected a 16-bit depth image or an 8-bit color image",
            code="reference-type",
        )
    if data.color is None:
        raise InputError(
            "segment.reference is a color image but the frame has no color: give a 16-bit depth image",
            code="method-needs-color",
        )
    difference = data.color.astype(np.float32) - reference[:, :, ::-1]
    return np.asarray((difference**2).sum(axis=2) > config.color_difference**2)


def _read_reference(path: str, flags: int) -> Array:
    """Return the image of a file, BGR if it has color. It is read again only if the file has changed."""
    try:
        status = os.stat(path)
    except OSError as error:
        raise InputError(f"segment.reference {path}: cannot be read ({error.strerror})", code=unread_code(error)) from None
    return _decode(path, flags, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=4)
def _decode(path: str, flags: int, modified: int, size: int) -> Array:
    """Return the image of a file; its time of modification and its size are part of the key of the cache."""
    try:
        data = read_encoded(path, f"segment.reference {path}")
        image = None
        if announced := announced_size(data):
            check_pixels(*announced, f"segment.reference {path}")
            image = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except (OSError, cv2.error) as error:
        raise InputError(f"segment.reference {path}: cannot be read ({error})", code="file-unreadable") from None
    if image is None:
        raise InputError(f"segment.reference {path}: not an image that can be read", code="image-unreadable")
    return np.asarray(image)

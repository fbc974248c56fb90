"""What was not there in a reference frame without the object."""

from __future__ import annotations

import os
from functools import lru_cache

import cv2
import numpy as np

from ....config import SegmentConfig
from ....errors import InputError, unread_code
from ....types import Array, Bools, Cloud, Frame, Image

UPRIGHT = cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH  # turned as EXIF says, as photographs are read
STORED = cv2.IMREAD_UNCHANGED  # as the colour of frames is read, for depth would not follow a turn


def _reference(path: str, flags: int) -> Array:
    """The image, read again only when the file has changed."""
    try:
        found = os.stat(path)
    except OSError as error:
        raise InputError(f"segment.reference {path}: cannot be read ({error.strerror})", code=unread_code(error)) from None
    return _read(path, flags, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=4)
def _read(path: str, flags: int, changed: int, size: int) -> Array:
    try:
        image = cv2.imdecode(np.fromfile(path, dtype=np.uint8), flags)
    except (OSError, cv2.error) as error:
        raise InputError(f"segment.reference {path}: cannot be read ({error})", code="file-unreadable") from None
    if image is None:
        raise InputError(f"segment.reference {path}: not an image that can be read", code="image-unreadable")
    return np.asarray(image)


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> Bools:
    """Pixels nearer than the reference depth, or of another colour than the reference image.

    Raises
    ------
    InputError : a cloud, an unreadable reference, one of another size, or a colour reference for a frame without colour.
    """
    if isinstance(data, Cloud):
        raise InputError(
            "segment.method is background, which needs a frame with an image: for a cloud use plane or everything",
            code="method-needs-image",
        )
    image = _reference(str(config.reference), UPRIGHT if isinstance(data, Image) else STORED)
    height, width = data.color.shape[:2] if isinstance(data, Image) else data.depth.shape
    if image.shape[:2] != (height, width):
        raise InputError(
            f"segment.reference {config.reference} is {image.shape[1]}x{image.shape[0]}, "
            f"the frame {width}x{height}: take it with the same camera mode",
            code="reference-size",
        )
    if image.ndim == 2 and image.dtype == np.uint16 and isinstance(data, Frame):
        reference = image / config.reference_depth_scale
        return np.asarray((data.depth > 0) & (reference > 0) & (reference - data.depth > config.depth_difference))
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
        raise InputError(
            f"segment.reference {config.reference} has shape {image.shape} and type {image.dtype}: "
            "expected a 16-bit depth image or an 8-bit colour image",
            code="reference-type",
        )
    if data.color is None:
        raise InputError(
            "segment.reference is a colour image but the frame has no colour: give a 16-bit depth image",
            code="method-needs-color",
        )
    difference = data.color.astype(np.float32) - image[:, :, ::-1]
    return np.asarray((difference**2).sum(axis=2) > config.color_difference**2)

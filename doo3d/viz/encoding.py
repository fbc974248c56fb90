"""Encode a detection as a picture file: its chains drawn over the input."""

import cv2
import numpy as np

from ..types import Array, Cloud, Detection, Frame, Image
from . import draw

JPEG_QUALITY = 90
"""JPEG quality, of 100: lines stay sharp, and 1280x720 px has 140 kB; PNG has 670 kB and takes ten times as long."""

_PARAMETERS = {".jpg": [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY], ".png": list[int]()}


def encode_jpeg(detection: Detection, data: Frame | Cloud | Image) -> bytes:
    """Return a picture of a detection as the content of a JPEG file: its chains drawn over the input it was made from."""
    return encode_image(draw(data, detection), ".jpg")


def encode_png(detection: Detection, data: Frame | Cloud | Image) -> bytes:
    """Return a picture of a detection as the content of a PNG file: its chains drawn over the input it was made from."""
    return encode_image(draw(data, detection), ".png")


def encode_instances(detection: Detection, data: Frame | Cloud | Image) -> bytes:
    """Return the instance labels of a detection (`Detection.instance_labels`) as the content of a PNG file of 16 bits.

    data : not used; all encoders of a frame's files take the same two arguments.
    """
    return _encoded(detection.instance_labels(), ".png")


def encode_image(image: Array, suffix: str = ".png") -> bytes:
    """Return an image (H, W, 3) uint8 RGB as the content of a PNG (or .jpg: JPEG) file.

    Raises
    ------
    RuntimeError
        OpenCV cannot encode the image.
    """
    return _encoded(cv2.cvtColor(np.ascontiguousarray(image), cv2.COLOR_RGB2BGR), suffix)


def _encoded(image: Array, suffix: str) -> bytes:
    success, encoded = cv2.imencode(suffix, image, _PARAMETERS[suffix])
    if not success:
        raise RuntimeError("OpenCV could not encode the picture")
    return bytes(encoded.tobytes())

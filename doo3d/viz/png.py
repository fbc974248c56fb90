"""A detection as a PNG: its chains drawn over the input."""

from __future__ import annotations

import cv2
import numpy as np

from ..types import Array, Cloud, Detection, Frame, Image
from . import draw


def encode(detection: Detection, data: Frame | Cloud | Image) -> bytes:
    """Return a picture of a detection as the content of a PNG file: its chains drawn over the input.

    Parameters
    ----------
    detection
        the chains to draw.
    data
        the input that the detection was made from.
    """
    return encode_image(draw(data, detection))


def encode_image(image: Array) -> bytes:
    """Return an image (H, W, 3) uint8 RGB as the content of a PNG file.

    Raises
    ------
    RuntimeError
        OpenCV cannot encode the image.
    """
    success, encoded = cv2.imencode(".png", np.ascontiguousarray(image[:, :, ::-1]))
    if not success:
        raise RuntimeError("OpenCV could not encode the picture")
    return bytes(encoded.tobytes())

"""A detection as a PNG: its chains drawn over the input."""

from __future__ import annotations

import cv2
import numpy as np

from ..types import Array, Cloud, Detection, Frame, Image
from . import draw


def encode(detection: Detection, data: Frame | Cloud | Image) -> bytes:
    """Return the content of a PNG file: the chains of a detection drawn over the input that it was made from."""
    return encode_image(draw(data, detection))


def encode_image(image: Array) -> bytes:
    """Return an image (H, W, 3) uint8 RGB as the content of a PNG file."""
    success, encoded = cv2.imencode(".png", np.ascontiguousarray(image[:, :, ::-1]))
    if not success:
        raise RuntimeError("OpenCV could not encode the picture")
    return bytes(encoded.tobytes())

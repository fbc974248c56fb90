"""A detection as a PNG: its chains drawn over the input."""

from __future__ import annotations

import cv2
import numpy as np

from ..types import Array, Cloud, Detection, Frame, Image
from . import draw


def encode(detection: Detection, data: Frame | Cloud | Image) -> bytes:
    """Encode the picture of `viz.draw`."""
    return encode_image(draw(data, detection))


def encode_image(image: Array) -> bytes:
    """Encode an image (H, W, 3) uint8 RGB as PNG."""
    success, encoded = cv2.imencode(".png", np.ascontiguousarray(image[:, :, ::-1]))
    if not success:
        raise RuntimeError("OpenCV could not encode the picture")
    return bytes(encoded.tobytes())

"""A detection as a PNG: its chains drawn over what it was made from."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from ..types import Cloud, Detection, Frame, Image
from ..viz import draw
from .atomic import write_bytes


def write(path: Path, detection: Detection, data: Frame | Cloud | Image) -> None:
    """Write the overlay of `viz.draw` to `path`."""
    good, encoded = cv2.imencode(".png", np.ascontiguousarray(draw(data, detection)[:, :, ::-1]))
    if not good:
        raise RuntimeError(f"{path}: OpenCV could not encode the picture")
    write_bytes(path, encoded.tobytes())

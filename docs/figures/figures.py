"""Helpers of the scripts that draw the pictures of the documentation: cropping, scaling, placing side by side, saving."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from doo3d.types import Cloud, Detection, Frame, Image
from doo3d.viz import draw

IMAGES = Path(__file__).parents[1] / "pages" / "images"
SAMPLES = Path(__file__).parents[2] / "sample_clouds"
GAP_PX = 6  # white space between the panels of a picture
CAPTION_PX = 22  # height of the line of text above a panel
JPEG_QUALITY = 80


def fit(image: np.ndarray, width: int, height: int) -> np.ndarray:
    """Return (height, width, 3) uint8 RGB: the image scaled to cover that size, cut equally on both sides."""
    scale = max(width / image.shape[1], height / image.shape[0])
    size = max(width, round(image.shape[1] * scale)), max(height, round(image.shape[0] * scale))
    scaled = cv2.resize(image, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC)
    left, top = (size[0] - width) // 2, (size[1] - height) // 2
    return scaled[top : top + height, left : left + width]


def box_of(mask: np.ndarray, margin: int, ratio: float) -> tuple[slice, slice]:
    """Return rows and columns of the mask (H, W) and a margin in px, widened to the ratio width / height where there is room."""
    rows, columns = np.nonzero(mask)
    spans = np.array([[rows.min() - margin, rows.max() + margin], [columns.min() - margin, columns.max() + margin]], float)
    size = np.diff(spans)[:, 0]
    wanted = np.maximum(size, [size[1] / ratio, size[0] * ratio])
    middle = np.clip(spans.mean(axis=1), wanted / 2, np.maximum(np.array(mask.shape) - wanted / 2, wanted / 2))
    low = np.maximum(np.round(middle - wanted / 2), 0).astype(int)
    high = np.minimum(np.round(middle + wanted / 2), mask.shape).astype(int)
    return slice(low[0], high[0]), slice(low[1], high[1])


def captioned(image: np.ndarray, text: str) -> np.ndarray:
    """Return the image (H, W, 3) with a line of dark text on white above it."""
    line = np.full((CAPTION_PX, image.shape[1], 3), 255, np.uint8)
    cv2.putText(line, text, (3, CAPTION_PX - 7), cv2.FONT_HERSHEY_SIMPLEX, 0.42, (40, 40, 40), 1, cv2.LINE_AA)
    return np.vstack((line, image))


def beside(*panels: np.ndarray) -> np.ndarray:
    """Return panels (H, W, 3) of one height in a row, with white between them."""
    gap = np.full((panels[0].shape[0], GAP_PX, 3), 255, np.uint8)
    return np.hstack([part for panel in panels for part in (gap, panel)][1:])


def drawn(data: Frame | Cloud | Image, detection: Detection) -> np.ndarray:
    """Return (H, W, 3) uint8 RGB: the chains over the data."""
    return np.asarray(draw(data, detection))


def save(picture: np.ndarray, folder: str, name: str) -> Path:
    """Write the picture (H, W, 3) RGB to `docs/pages/images/<folder>/<name>.jpg` and return its path."""
    path = IMAGES / folder / f"{name}.jpg"
    path.parent.mkdir(exist_ok=True)
    cv2.imwrite(str(path), picture[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return path

"""What was found in a photograph beside its labels."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from ..outputs.atomic import write_bytes
from ..types import Array
from ..viz import draw
from ..viz.palette import DARK, LIGHT, chain_color
from .photos import Row, caption
from .photos_data import Photo

_FONT = cv2.FONT_HERSHEY_DUPLEX
_STRIP = 36  # px, height of the caption
_MISSED = (128, 128, 128)  # the colour of a cable that no chain follows


def picture(row: Row) -> Array:
    """(H, W, 3) uint8 RGB: the chains over the image, and the labels, each in the colour of the chain that was matched."""
    photo = row.entry.load()
    both = np.concatenate((draw(photo.image, row.detection), _labels_picture(photo, row)), axis=1)
    strip = np.full((_STRIP, both.shape[1], 3), DARK, np.uint8)
    size = 0.6
    while size > 0.3 and cv2.getTextSize(caption(row), _FONT, size, 1)[0][0] > both.shape[1] - 20:
        size -= 0.05
    cv2.putText(strip, caption(row), (10, 24), _FONT, size, LIGHT, 1, cv2.LINE_AA)
    return np.concatenate((strip, both))


def write_pictures(folder: Path, rows: list[Row]) -> list[Path]:
    """A PNG per row into `folder`, numbered in order; it is made when it is not there."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for i, row in enumerate(rows):
        good, encoded = cv2.imencode(".png", np.ascontiguousarray(picture(row)[:, :, ::-1]))
        if not good:
            raise RuntimeError(f"{row.name}: OpenCV could not encode the picture")
        paths.append(folder / f"{i:02d}_{row.name.replace('/', '_').replace(' ', '_')}.png")
        write_bytes(paths[-1], encoded.tobytes())
    return paths


def _labels_picture(photo: Photo, row: Row) -> Array:
    """The labels, what is in the mask only a little brighter than the background."""
    labels = photo.labels if row.cable is None else (photo.labels == row.cable).astype(np.uint8)
    mask = photo.mask if row.cable is None else labels > 0
    colors = [DARK, *(_MISSED if chain < 0 else chain_color(int(chain)) for chain in row.score.match)]
    out = np.array(colors, np.uint8)[labels]
    out[mask & (labels == 0)] = (70, 70, 70)
    missing = ~mask & (labels > 0)
    out[missing] //= 2
    return np.asarray(out)

"""What was found in a photograph beside its labels."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...types import Array
from ...viz import draw
from ...viz.palette import DARK, chain_color
from ..benchmark.pictures import captioned, write_png
from .datasets import Photo
from .evaluate import Row, caption

_MISSED = (128, 128, 128)  # the colour of a cable that no chain follows


def picture(row: Row) -> Array:
    """(H, W, 3) uint8 RGB: the chains over the image, and the labels, each in the colour of the chain that was matched."""
    photo = row.entry.load()
    both = np.concatenate((draw(photo.image, row.detection), _labels_picture(photo, row)), axis=1)
    return captioned(both, caption(row))


def write_pictures(folder: Path, rows: list[Row]) -> list[Path]:
    """A PNG per row into `folder`, numbered in order; it is made when it is not there."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for i, row in enumerate(rows):
        paths.append(folder / f"{i:02d}_{row.name.replace('/', '_').replace(' ', '_')}.png")
        write_png(paths[-1], picture(row))
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

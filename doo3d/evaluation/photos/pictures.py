"""Draw the detection in a photograph beside its labels."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...types import Array
from ...viz import draw
from ...viz.palette import DARK, chain_color
from ..benchmark.pictures import with_caption, write_png
from .datasets import Photo
from .evaluate import Row
from .tables import caption

_MISSED = (128, 128, 128)
"""RGB of a cable that no chain follows."""

_UNLABELLED = (70, 70, 70)
"""RGB of the mask where no cable is labelled."""


def picture(row: Row) -> Array:
    """Draw the chains over a photograph of H x W px, with the labels beside it and a caption above: (H + 36, 2 W, 3) uint8 RGB.

    A labelled cable has the color of the chain matched with it, or is gray if there is none. It is darker where the mask does not
    contain it. Unlabelled pixels of the mask are dark gray.

    Parameters
    ----------
    row
        the result for the photograph, or for one of its cables.
    """
    photo = row.ref.load()
    both = np.concatenate((draw(photo.image, row.detection), _labels_picture(photo, row)), axis=1)
    return with_caption(both, caption(row))


def write_pictures(folder: Path, rows: list[Row]) -> list[Path]:
    """Write a PNG for each row into a folder: the chains over the photograph, with the labels beside it.

    A picture is named `<number>_<name>.png`, where rows are numbered from 00. The folder is made if necessary.

    Returns
    -------
    The path of each picture, in the order of the rows.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for i, row in enumerate(rows):
        paths.append(folder / f"{i:02d}_{row.name.replace('/', '_').replace(' ', '_')}.png")
        write_png(paths[-1], picture(row))
    return paths


def _labels_picture(photo: Photo, row: Row) -> Array:
    """Return the labels as (H, W, 3) uint8 RGB; labels outside the mask are darker."""
    labels = photo.labels if row.cable is None else (photo.labels == row.cable).astype(np.uint8)
    mask = photo.mask if row.cable is None else labels > 0
    colors = [DARK, *(_MISSED if chain < 0 else chain_color(int(chain)) for chain in row.score.match)]
    out = np.array(colors, np.uint8)[labels]
    out[mask & (labels == 0)] = _UNLABELLED
    outside = ~mask & (labels > 0)
    out[outside] //= 2
    return np.asarray(out)

"""Small photographs with labels, drawn from chains that are the truth, and written to disk as the public sets are."""

from __future__ import annotations

import json

import cv2
import numpy as np

from doo3d.evaluation.benchmark.cases import Case
from doo3d.evaluation.photos.datasets import Photo
from doo3d.evaluation.photos.score import drawn_pixels
from doo3d.kernels import lay_equal_chords
from doo3d.types import Chain

WIDTH, HEIGHT = 200, 150
COLORS = ((228, 26, 28), (55, 126, 184), (77, 175, 74))  # RGB, one per cable


def strand(*corners, radius=4.0, length=5.0, radii=()):
    """A chain of equal segments along the corners (x, y) px."""
    return Chain(lay_equal_chords(np.array(corners, dtype=float), length)[0], length, radius, np.asarray(radii, dtype=float))


def cross(radius=4.0):
    """Two cables; the second lies over the first."""
    return [strand((20, 75), (180, 75), radius=radius), strand((100, 15), (100, 135), radius=radius)]


def labelled(chains, shape=(HEIGHT, WIDTH)):
    """(H, W) uint8: the chains drawn one over the other."""
    labels = np.zeros(shape, np.uint8)
    for number, chain in enumerate(chains, start=1):
        labels[drawn_pixels(chain, shape)] = number
    return labels


def painted(labels):
    """(H, W, 3) uint8 RGB: each cable in its color on black."""
    return np.array([(0, 0, 0), *COLORS], np.uint8)[labels]


def photo_ref(chains, subset="S1", name="img0"):
    labels = labelled(chains)
    return Case(name, subset, lambda: Photo(subset, name, painted(labels), labels, labels > 0))


def save(path, image):
    """RGB or grey to disk."""
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), image[:, :, ::-1] if image.ndim == 3 else image)


def write_capture(folder, frames):
    """Write rendered frames as another renderer does, depth in tenths of a millimetre; return the folder."""
    for k, rendered in enumerate(frames):
        name, camera = f"{k:06d}.png", rendered.frame.camera
        save(folder / "color" / name, rendered.frame.color)
        save(folder / "depth" / name, np.round(rendered.frame.depth * 1e4).astype(np.uint16))
        save(folder / "mask" / name, 255 * rendered.mask.astype(np.uint8))
    matrix = [camera.fx, 0, 0, 0, camera.fy, 0, camera.cx, camera.cy, 1]
    values = {"width": camera.width, "height": camera.height, "intrinsic_matrix": matrix, "depth_scale": 10000}
    (folder / "camera_intrinsic.json").write_text(json.dumps(values))
    return folder

"""Colour brought to the pixels of the depth, where the two are different cameras."""

from __future__ import annotations

import cv2
import numpy as np

from ..types import Array, Camera, Floats

_BEHIND = 0.02  # of the distance: what lies behind something by more than this is hidden by it


def align_color(color: Array, colored: Camera, depth: Array, camera: Camera, extrinsics: Floats) -> Array:
    """The colour of each pixel of the depth, black where the colour camera does not see it.

    Each reading is projected into the colour image and takes the nearest pixel there. Of readings that fall on the same
    place the nearest is the one that is seen (z-buffer). A pixel without reading takes the colour that it would have at
    the depth of the reading nearest to it in the image, so that what only the colour camera sees is not lost.

    Parameters
    ----------
    color : (h, w, 3) uint8 RGB of the camera `colored`.
    depth : (H, W) float m of `camera`, 0 or not finite = none.
    extrinsics : (4, 4), from coordinates of the depth camera to those of the colour camera, m.

    Returns
    -------
    (H, W, 3) uint8 RGB.
    """
    good = np.isfinite(depth) & (depth > 0)
    if not good.any():
        return np.zeros((*depth.shape, 3), np.uint8)
    distance = _filled(depth, good)
    rows, columns = np.indices(depth.shape)
    points = camera.unproject(np.column_stack((columns.ravel(), rows.ravel())), distance.ravel())
    moved = points @ extrinsics[:3, :3].T + extrinsics[:3, 3]
    pixels = colored.project(moved)
    inside = (pixels > -0.5).all(axis=1) & (pixels < (colored.width - 0.5, colored.height - 0.5)).all(axis=1)
    seen = inside & _in_front(pixels, moved[:, 2], inside & good.ravel(), colored, camera)
    at = np.rint(pixels[seen]).astype(int)
    result = np.zeros((depth.size, 3), np.uint8)
    result[seen] = color[at[:, 1], at[:, 0]]
    return result.reshape(*depth.shape, 3)


def _in_front(pixels: Floats, z: Floats, surely: Array, colored: Camera, camera: Camera) -> Array:
    """(N,) bool: nothing that was surely measured hides it. Cells are as large as a depth pixel is in the colour image."""
    cell = max(1.0, 1.5 * colored.fx / camera.fx, 1.5 * colored.fy / camera.fy)
    shape = (int(colored.height / cell) + 2, int(colored.width / cell) + 2)
    nearest = np.full(shape, np.inf)
    at = np.floor((pixels[surely] + 0.5) / cell).astype(int)
    np.minimum.at(nearest, (at[:, 1], at[:, 0]), z[surely])
    with np.errstate(invalid="ignore"):
        there = np.where(np.isfinite(pixels), np.floor((pixels + 0.5) / cell), 0).astype(int)
    there = np.clip(there, 0, (shape[1] - 1, shape[0] - 1))
    return np.asarray(z <= nearest[there[:, 1], there[:, 0]] * (1 + _BEHIND))


def _filled(depth: Array, good: Array) -> Floats:
    """(H, W) m, where there is no reading that of the nearest pixel with one."""
    if good.all():
        return np.asarray(depth, dtype=float)
    _, labels = cv2.distanceTransformWithLabels((~good).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    values = np.zeros(labels.max() + 1)
    values[labels[good]] = depth[good]
    return np.asarray(values[labels])

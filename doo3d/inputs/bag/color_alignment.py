"""Colour brought to the pixels of the depth, where the two are different cameras."""

from __future__ import annotations

import cv2
import numpy as np

from ...types import Array, Bools, Camera, Floats

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
    u, v, z = _projected(_filled(depth, good), camera, colored, extrinsics)
    inside = (u > -0.5) & (v > -0.5) & (u < colored.width - 0.5) & (v < colored.height - 0.5) & (z > 0)
    seen = inside & _in_front(u, v, z, inside, good, colored, camera)
    result = np.asarray(cv2.remap(color, u, v, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE))
    result[~seen] = 0
    return result


def _projected(distance: Floats, camera: Camera, colored: Camera, extrinsics: Floats) -> tuple[Floats, Floats, Floats]:
    """(H, W) float32 each: column and row in the colour image, and z in the colour camera, m, of each pixel at its distance."""
    x = ((np.arange(camera.width) - camera.cx) / camera.fx)[None].astype(np.float32)
    y = ((np.arange(camera.height) - camera.cy) / camera.fy)[:, None].astype(np.float32)
    turn, move = extrinsics[:3, :3].astype(np.float32), extrinsics[:3, 3].astype(np.float32)
    a, b, z = (distance * (turn[k, 0] * x + turn[k, 1] * y + turn[k, 2]) + move[k] for k in range(3))
    safe = np.where(z > 0, z, np.float32(np.inf))
    return (
        np.float32(colored.fx) * a / safe + np.float32(colored.cx),
        np.float32(colored.fy) * b / safe + np.float32(colored.cy),
        z,
    )


def _in_front(u: Floats, v: Floats, z: Floats, inside: Bools, good: Bools, colored: Camera, camera: Camera) -> Bools:
    """(H, W) bool: nothing that was measured hides it. Cells are a little larger than a depth pixel is in the colour image."""
    cell = np.float32(max(1.0, 1.5 * colored.fx / camera.fx, 1.5 * colored.fy / camera.fy))
    rows, columns = int(colored.height / cell) + 2, int(colored.width / cell) + 2
    there = np.zeros(z.shape, np.intp)
    there[inside] = ((v[inside] + 0.5) / cell).astype(np.intp) * columns + ((u[inside] + 0.5) / cell).astype(np.intp)
    nearest = np.full(rows * columns, np.inf, np.float32)
    surely = inside & good
    np.minimum.at(nearest, there[surely], z[surely])
    return np.asarray(z <= nearest[there] * np.float32(1 + _BEHIND))


def _filled(depth: Array, good: Bools) -> Floats:
    """(H, W) m, where there is no reading that of the nearest pixel with one."""
    if good.all():
        return np.asarray(depth, dtype=np.float32)
    _, labels = cv2.distanceTransformWithLabels((~good).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    values = np.zeros(labels.max() + 1, np.float32)
    values[labels[good]] = depth[good]
    return np.asarray(values[labels])

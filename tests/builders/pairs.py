"""Stereo pairs drawn from curves in space, with exact truth."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial import cKDTree

from doo3d.inputs.bag.undistortion import Lens
from doo3d.inputs.rig.pair_images import PairImages
from doo3d.inputs.rig.stereo_pair import StereoPair
from doo3d.types import Array, Bools, Camera, Floats

CAMERA = Camera(fx=600.0, fy=600.0, cx=239.5, cy=159.5, width=480, height=320)
BASELINE = 0.1
RADIUS = 0.004
GROUND, STRAND, NOISE = 150.0, 40.0, 2.0


def stereo_pair(baseline: float = BASELINE, camera: Camera = CAMERA) -> StereoPair:
    """Two equal cameras with parallel axes, without distortion."""
    return StereoPair(Lens(camera), Lens(camera), tuple(np.eye(3).ravel()), (-baseline, 0.0, 0.0))


def wave(depth: float = 0.7, rise: float = 0.0, shift: float = 0.0) -> Floats:
    """A wavy strand (P, 3) m from left to right in both views, whose far end is `rise` nearer to the camera."""
    t = np.linspace(0.0, 1.0, 1500)
    x, y = -0.1 + 0.28 * t, 0.07 * np.sin(2 * np.pi * t) + shift
    return np.column_stack((x, y, depth - rise * t))


def view(curves: Sequence[Floats], offset: float, rows: float = 0.0, seed: int = 0) -> tuple[Array, Bools]:
    """Image and mask of dark strands for a camera `offset` m to the right; later strands lie on top of earlier ones."""
    v, u = np.mgrid[0 : CAMERA.height, 0 : CAMERA.width]
    pixels = np.column_stack((u.ravel(), v.ravel())).astype(float)
    gray, mask = np.full(len(pixels), GROUND), np.zeros(len(pixels), dtype=bool)
    for k, curve in enumerate(curves):
        points = CAMERA.project(curve - np.array([offset, 0.0, 0.0])) + np.array([0.0, rows])
        distance, nearest = cKDTree(points).query(pixels)
        radius = CAMERA.fx * RADIUS / curve[nearest, 2]
        share = np.clip(radius - distance + 0.5, 0.0, 1.0)
        gray = gray * (1 - share) + (STRAND + 30 * k) * share
        mask |= distance <= radius
    shape = (CAMERA.height, CAMERA.width)
    noisy = gray.reshape(*shape, 1) + np.random.default_rng(seed).normal(0, NOISE, (*shape, 3))
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8), mask.reshape(shape)


def drawn_pair(curves: Sequence[Floats], rows: float = 0.0, name: str = "pair") -> PairImages:
    """Both images of strands, with masks; the right camera's rows are off by `rows` px."""
    (left, left_mask), (right, right_mask) = view(curves, 0.0), view(curves, BASELINE, rows, seed=1)
    return PairImages(left, right, left_mask, right_mask, name)


def write_image(path: Path, image: Array) -> Path:
    """Write an RGB image or a mask as PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    stored = image.astype(np.uint8) * 255 if image.dtype == bool else cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    assert cv2.imwrite(str(path), stored)
    return path

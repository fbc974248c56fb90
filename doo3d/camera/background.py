"""Reduce the background of a frame to a small view, for estimating camera motion."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from ..types import Array, Bools, Camera, Floats, Frame

VIEW_PIXELS = 96
"""Largest length of the longer side of a view, px. Alignment finds a motion to a few hundredths of such a pixel, a fifth of a
millimetre at 0.6 m (`python -m doo3d.evaluation.sequences.moving_views`), and a view is made in less than half a
millisecond."""


@dataclass(frozen=True)
class BackgroundView:
    """Brightness and inverse depth of the background of a frame, at low resolution.

    Attributes
    ----------
    gray
        (H, W) uint8, mean brightness; 0 on an object.
    inverse
        (H, W) float16, inverse depth, 1/m; 0 where unknown.
    intrinsics
        (4,) px: fx, fy, cx, cy of these pixels.
    """

    gray: Array
    inverse: Array
    intrinsics: Floats

    def to_dict(self) -> dict[str, Any]:
        """Return the view as JSON values, with images as Base64 of their bytes."""
        images = {"gray": self.gray, "inverse": self.inverse.astype("<f2")}
        encoded = {name: base64.b64encode(image.tobytes()).decode("ascii") for name, image in images.items()}
        return encoded | {"shape": list(self.gray.shape), "intrinsics": self.intrinsics.tolist()}

    @staticmethod
    def from_dict(values: Mapping[str, Any]) -> BackgroundView:
        """Return the view from the values of `to_dict`.

        Raises
        ------
        KeyError, TypeError, ValueError : a value is missing or invalid.
        """
        height, width = values["shape"]
        gray = np.frombuffer(base64.b64decode(values["gray"]), dtype=np.uint8).reshape(height, width)
        inverse = np.frombuffer(base64.b64decode(values["inverse"]), dtype="<f2").reshape(height, width)
        return BackgroundView(gray, inverse, np.array(values["intrinsics"], dtype=float).reshape(4))


def background_view(frame: Frame, mask: Bools | None) -> BackgroundView:
    """Return a small view of the background of a frame.

    frame : color and depth; without color the brightness is uniform. mask : (H, W) bool, pixels of objects, which are left out
    with their neighbors; None if unknown.
    """
    height, width = frame.depth.shape
    factor = min(-(-max(height, width) // VIEW_PIXELS), height, width)
    rows, columns = height // factor, width // factor
    within, size = (slice(0, rows * factor), slice(0, columns * factor)), (columns, rows)
    if frame.color is None:
        gray = np.full((rows, columns), 128, dtype=np.uint8)
    else:
        bright = cv2.cvtColor(frame.color[within], cv2.COLOR_RGB2GRAY)
        gray = np.maximum(cv2.resize(bright, size, interpolation=cv2.INTER_AREA), 1)
    if mask is not None:
        in_rows = np.logical_or.reduce(mask[within].reshape(rows, factor, columns * factor), axis=1)
        shown = np.logical_or.reduce([in_rows[:, k::factor] for k in range(factor)]).view(np.uint8)
        gray[cv2.dilate(shown, np.ones((3, 3), dtype=np.uint8)) > 0] = 0
    depth = frame.depth[factor // 2 :: factor, factor // 2 :: factor][:rows, :columns]
    inverse = np.zeros(depth.shape, dtype=np.float32)
    np.divide(1.0, depth, out=inverse, where=depth > 1 / np.finfo(np.float16).max)
    inverse = inverse.astype(np.float16)
    return BackgroundView(gray, inverse, _reduced(frame.camera, factor))


def _reduced(camera: Camera, factor: int) -> Floats:
    """Return fx, fy, cx, cy in px of an image reduced by a factor.

    One pixel of the reduced image is a square of `factor` x `factor` pixels of the camera.
    """
    middle = (np.array([camera.cx, camera.cy]) + 0.5) / factor - 0.5
    return np.array([camera.fx / factor, camera.fy / factor, *middle])

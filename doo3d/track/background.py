"""Keep a small view of the background of a frame, to see where it contradicts the shape of an object."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from ..types import Array, Bools, Camera, Floats, Frame
from .strand_ends import occluder_margin

VIEW_PIXELS = 96
"""Largest length of the longer side of a view, px. The true cables of 1,020 frames are never contradicted at this resolution."""


@dataclass(frozen=True)
class BackgroundView:
    """Inverse depth of the background of a frame, at low resolution.

    Attributes
    ----------
    inverse
        (H, W) float16, inverse depth, 1/m; 0 where unknown, and on an object or next to one.
    intrinsics
        (4,) px: fx, fy, cx, cy of these pixels.
    """

    inverse: Array
    intrinsics: Floats

    @staticmethod
    def of(frame: Frame, mask: Bools | None) -> BackgroundView:
        """Return the view of a frame.

        mask : (H, W) bool, pixels of objects; None if unknown.
        """
        height, width = frame.depth.shape
        factor = min(-(-max(height, width) // VIEW_PIXELS), height, width)
        rows, columns = height // factor, width // factor
        depth = frame.depth[factor // 2 :: factor, factor // 2 :: factor][:rows, :columns]
        inverse = np.zeros(depth.shape, dtype=np.float32)
        np.divide(1.0, depth, out=inverse, where=depth > 1 / np.finfo(np.float16).max)
        if mask is not None:
            in_rows = np.logical_or.reduce(mask[: rows * factor, : columns * factor].reshape(rows, factor, -1), axis=1)
            shown = np.logical_or.reduce([in_rows[:, k::factor] for k in range(factor)]).view(np.uint8)
            inverse[cv2.dilate(shown, np.ones((3, 3), dtype=np.uint8)) > 0] = 0
        return BackgroundView(inverse.astype(np.float16), _reduced(frame.camera, factor))

    def contradicts(self, joints: Floats, radius: float) -> Bools:
        """Return which joints of an object the view contradicts, (M + 1,) bool.

        These are joints in front of the background, or on it, where no object is seen: neither the cell of the view nor the
        cells next to it are unknown, on an object, or nearer than the joint.

        joints : (M + 1, 3) m, in the camera frame. radius : m, of the object; NaN if unknown.
        """
        height, width = self.inverse.shape
        depth = np.maximum(joints[:, 2], 1e-6)
        pixels = np.clip(
            np.rint(joints[:, :2] / depth[:, None] * self.intrinsics[:2] + self.intrinsics[2:]), -1, (width, height)
        ).astype(int)
        inside = ((pixels >= 0) & (pixels < (width, height))).all(axis=1) & (joints[:, 2] > 0)
        column, row = np.where(inside[:, None], pixels, 0).T
        inverse, around = self.inverse.astype(np.float32), np.ones((3, 3), dtype=np.uint8)
        farthest, nearest = cv2.erode(inverse, around)[row, column], cv2.dilate(inverse, around)[row, column]
        return np.asarray(inside & (farthest > 0) & (nearest * (depth - occluder_margin(radius)) < 1))

    def to_dict(self) -> dict[str, Any]:
        """Return the view as JSON values, with the image as Base64 of its bytes."""
        inverse = base64.b64encode(self.inverse.astype("<f2").tobytes()).decode("ascii")
        return {"inverse": inverse, "shape": list(self.inverse.shape), "intrinsics": self.intrinsics.tolist()}

    @staticmethod
    def from_dict(values: Mapping[str, Any]) -> BackgroundView:
        """Return the view from the values of `to_dict`.

        Raises
        ------
        KeyError, TypeError, ValueError : a value is missing or invalid.
        """
        height, width = values["shape"]
        inverse = np.frombuffer(base64.b64decode(values["inverse"]), dtype="<f2").reshape(height, width)
        return BackgroundView(inverse, np.array(values["intrinsics"], dtype=float).reshape(4))


def _reduced(camera: Camera, factor: int) -> Floats:
    """Return fx, fy, cx, cy in px of an image reduced by a factor.

    One pixel of the reduced image is a square of `factor` x `factor` pixels of the camera.
    """
    middle = (np.array([camera.cx, camera.cy]) + 0.5) / factor - 0.5
    return np.array([camera.fx / factor, camera.fy / factor, *middle])

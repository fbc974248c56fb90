"""Define the calibration of a stereo pair, and rectify it to two pinhole cameras whose rows are epipolar lines."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from ...errors import InputError
from ...types import Array, Bools, Camera, Floats
from ..bag.undistortion import FISHEYE, Lens, rectifying_maps

BASELINE_RANGE_M = (1e-3, 10.0)
"""Least and greatest baseline of a stereo pair in m; outside this range, the unit must be wrong."""

MAX_ROTATION_ERROR = 1e-3
"""Greatest absolute entry of R Rᵀ - 1 for a rotation matrix R, since matrices in text files are rounded."""

MAX_BASELINE_TILT = 1.0
"""Greatest ratio of the baseline's component across the left image's rows to that along them; above it, the cameras are
stacked."""

MASK_LEVEL = 0.5
"""Least fraction of a pixel of the rectified mask that the object must cover."""


@dataclass(frozen=True)
class StereoPair:
    """Two calibrated cameras side by side, without depth.

    Attributes
    ----------
    left, right
        intrinsics, size and distortion of the left and the right camera.
    rotation
        R as nine numbers, row by row, in x_right = R x_left + t between the cameras' optical frames, as from OpenCV's
    stereoCalibrate.
    translation
        t as three numbers, m, in the same equation.
    source
        the calibration file, named in errors.

    Raises
    ------
    InputError : R is not a rotation, the baseline is zero or outside BASELINE_RANGE_M, the right camera is not to the right of
    the
        left one, or a lens cannot be used.
    """

    left: Lens
    right: Lens
    rotation: tuple[float, ...]
    translation: tuple[float, ...]
    source: str = "the calibration"

    def __post_init__(self) -> None:
        turn, shift = np.reshape(self.rotation, (3, 3)), np.array(self.translation)
        if not (np.allclose(turn @ turn.T, np.eye(3), atol=MAX_ROTATION_ERROR) and np.linalg.det(turn) > 0):
            raise InputError(f"{self.source}: R, from the left to the right camera, is no rotation matrix", code="pose-invalid")
        x, y, z = -turn.T @ shift  # the right camera, seen from the left one
        low, high = BASELINE_RANGE_M
        if not low <= (length := float(np.linalg.norm(shift))) <= high:
            expected = f"expected {1000 * low:g} mm to {high:g} m: check the translation and its unit"
            raise InputError(f"{self.source}: the cameras are {1000 * length:.4g} mm apart, {expected}", code="baseline-invalid")
        if np.hypot(y, z) > MAX_BASELINE_TILT * abs(x):
            sentence = "the cameras are not side by side: only pairs of a left and a right camera can be triangulated"
            raise InputError(f"{self.source}: {sentence}", code="baseline-invalid")
        if x < 0:
            sentence = "the second camera is to the left of the first: exchange them, or invert the transform"
            raise InputError(f"{self.source}: {sentence}", code="baseline-invalid")
        for side in (self.left, self.right):
            side.check()

    @property
    def baseline(self) -> float:
        """Distance between the cameras, m."""
        return float(np.linalg.norm(self.translation))

    def rectified(self) -> RectifiedPair:
        """Return the two pinhole cameras to which the pair's images are rectified; computed once."""
        return _rectified(self)


@dataclass(frozen=True)
class RectifiedPair:
    """Two pinhole cameras, rotated so that a point is in the same row of both images.

    A point at the pixel (u, v) of the left image is at (u - d, v) of the right one, with the disparity d = fx baseline / z.

    Attributes
    ----------
    pair
        the calibration that it was made from.
    camera
        the intrinsics and the size of both images.
    turns
        (3, 3) rotations from the optical frames of the left and of the right camera to the rectified ones.
    maps
        columns and rows in the camera's image of each pixel of the rectified image, (H, W) float32 px, left and right.
    """

    pair: StereoPair
    camera: Camera
    turns: tuple[Floats, Floats]
    maps: tuple[tuple[Array, Array], tuple[Array, Array]]

    def images(self, left: Array, right: Array) -> tuple[Array, Array]:
        """Return both images (H, W, 3) uint8 rectified; pixels that the camera did not see are black.

        Raises
        ------
        InputError : the size of an image differs from that of its camera.
        """
        return self._rectify(left, 0), self._rectify(right, 1)

    def mask(self, mask: Bools, side: int) -> Bools:
        """Rectify a mask (H, W) bool of the left (side 0) or right (side 1) image."""
        return np.asarray(self._rectify(mask.astype(np.float32), side) > MASK_LEVEL)

    def pixels(self, points: Floats, side: int) -> Floats:
        """Project points to the unrectified, distorted image of the left (side 0) or right (side 1) camera: (N, 2) px.

        points : (N, 3) m, in the rectified left camera's optical frame, the frame of results.
        """
        own = points - np.array([side * self.pair.baseline, 0.0, 0.0])
        lens = (self.pair.left, self.pair.right)[side]
        local, none = np.ascontiguousarray((own @ self.turns[side])[:, None]), np.zeros((3, 1))
        if lens.model in FISHEYE:
            return np.asarray(cv2.fisheye.projectPoints(local, none, none, lens.matrix, lens.opencv[:4])[0][:, 0])
        return np.asarray(cv2.projectPoints(local, none, none, lens.matrix, lens.opencv)[0][:, 0])

    def _rectify(self, image: Array, side: int) -> Array:
        camera = (self.pair.left, self.pair.right)[side].camera
        if image.shape[:2] != (camera.height, camera.width):
            sizes = f"is {image.shape[1]}x{image.shape[0]} but {self.pair.source} is for {camera.width}x{camera.height}"
            sentence = f"the {('left', 'right')[side]} image {sizes}: give the calibration of this resolution"
            raise InputError(sentence, code="intrinsics-size")
        return np.asarray(cv2.remap(image, *self.maps[side], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0))


@lru_cache(maxsize=4)
def _rectified(pair: StereoPair) -> RectifiedPair:
    """Rectify a pair by Bouguet's method, as in OpenCV's stereoRectify, with both principal points in the same column."""
    turn, shift = np.reshape(pair.rotation, (3, 3)), np.array(pair.translation)
    half = cv2.Rodrigues(-cv2.Rodrigues(turn)[0] / 2)[0]  # each camera is turned half way
    x = -half @ shift / np.linalg.norm(shift)
    y = np.cross(np.array([0.0, 0.0, 1.0]), x)
    y /= np.linalg.norm(y)
    along = np.stack([x, y, np.cross(x, y)])
    turns = along @ half.T, along @ half
    focal = float(np.mean([side.camera.fy for side in (pair.left, pair.right)]))
    center = np.mean([_center(side, own, focal) for side, own in zip((pair.left, pair.right), turns, strict=True)], axis=0)
    width, height = pair.left.camera.width, pair.left.camera.height
    camera = Camera(focal, focal, float(center[0]), float(center[1]), width, height)
    left, right = (rectifying_maps(side, own, camera) for side, own in zip((pair.left, pair.right), turns, strict=True))
    return RectifiedPair(pair, camera, turns, (left, right))


def _center(lens: Lens, turn: Floats, focal: float) -> Floats:
    """Return the principal point that keeps the middle of the camera's image in the middle of the rectified one."""
    camera = lens.camera
    middle = np.array([camera.width - 1, camera.height - 1]) / 2
    ray = turn @ np.append((middle - (camera.cx, camera.cy)) / (camera.fx, camera.fy), 1.0)
    return np.asarray(middle - focal * ray[:2] / ray[2])

"""Lenses: images as a pinhole camera would have seen them, through OpenCV's models."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from ...errors import InputError
from ...types import Array, Camera

# k1 k2 p1 p2 k3 k4 k5 k6, in OpenCV's order. RealSense's SDK projects by this polynomial whatever it calls the model (rsutil.h,
# rs2_project_point_to_pixel); in the modified one p1 and p2 differ in the second order only
_REALSENSE = ("Brown Conrady", "Inverse Brown Conrady", "Modified Brown Conrady")
PLUMB_BOB = ("plumb_bob", "rational_polynomial", *_REALSENSE, "")
FISHEYE = ("equidistant", "fisheye", "Kannala Brandt4")
_COUNTS = (4, 5, 8, 12, 14)  # of coefficients, that OpenCV knows


@dataclass(frozen=True)
class Lens:
    """A pinhole camera and how its images differ from it.

    model, coefficients : as sensor_msgs/CameraInfo and RealSense's SDK name and order them; no coefficients for none.
    """

    camera: Camera
    model: str = ""
    coefficients: tuple[float, ...] = ()

    @property
    def straight(self) -> bool:
        """Whether the images are those of a pinhole camera."""
        return not any(self.coefficients)

    def check(self) -> None:
        """Raise InputError where the lens is of a model that is not known, or has other numbers than the model."""
        if not self.straight and self.model not in (*PLUMB_BOB, *FISHEYE):
            known = ", ".join(name for name in (*PLUMB_BOB, *FISHEYE) if name)
            raise InputError(f"the lens is of model {self.model!r}, those that are known are {known}", code="lens-unknown")
        fits = len(self.coefficients) in ((4,) if self.model in FISHEYE and "Brandt" not in self.model else _COUNTS)
        if not self.straight and not (fits and np.isfinite(self.coefficients).all()):
            raise InputError(
                f"the lens of model {self.model!r} has the coefficients {self.coefficients}, which cannot be", code="lens-invalid"
            )

    def undistorted(self, image: Array, nearest: bool) -> Array:
        """(H, W[, 3]) as the pinhole camera would have it; `nearest` for depth, which must not be mixed."""
        if self.straight:
            return image
        maps = _maps(self)
        how = cv2.INTER_NEAREST if nearest else cv2.INTER_LINEAR
        return np.asarray(cv2.remap(image, maps[0], maps[1], how, borderMode=cv2.BORDER_CONSTANT, borderValue=0))


@lru_cache(maxsize=4)
def _maps(lens: Lens) -> tuple[Array, Array]:
    """Where in the image each pixel of the pinhole camera is: (H, W) float32 columns and rows."""
    lens.check()
    camera, given = lens.camera, np.array(lens.coefficients, dtype=float)
    size = (camera.width, camera.height)
    inner = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    if lens.model in FISHEYE:
        return cv2.fisheye.initUndistortRectifyMap(inner, given[:4], np.eye(3), inner, size, cv2.CV_32FC1)
    return cv2.initUndistortRectifyMap(inner, given, None, inner, size, cv2.CV_32FC1)

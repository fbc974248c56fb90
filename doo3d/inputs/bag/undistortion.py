"""Remove lens distortion: resample images to those of a pinhole camera, with OpenCV's models."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from ...errors import InputError
from ...types import Array, Camera, Floats

# k1 k2 p1 p2 k3 k4 k5 k6, in OpenCV's order. RealSense's SDK projects by this polynomial under all these names (rsutil.h,
# rs2_project_point_to_pixel); in the modified model p1 and p2 differ in the second order only
_REALSENSE = ("Brown Conrady", "Inverse Brown Conrady", "Modified Brown Conrady")
PLUMB_BOB = ("plumb_bob", "rational_polynomial", *_REALSENSE, "")
FISHEYE = ("equidistant", "fisheye", "Kannala Brandt4")
_COEFFICIENT_COUNTS = (4, 5, 8, 12, 14)  # that OpenCV accepts


@dataclass(frozen=True)
class Lens:
    """A pinhole camera and the distortion of its lens.

    Attributes
    ----------
    camera
        intrinsics and image size.
    model
        name of the distortion model as in sensor_msgs/CameraInfo or RealSense's SDK, such as "plumb_bob" or "equidistant".
    coefficients
        coefficients in the order of that model (plumb_bob: k1, k2, p1, p2, k3); empty or all zero without distortion.
    """

    camera: Camera
    model: str = ""
    coefficients: tuple[float, ...] = ()

    @property
    def is_undistorted(self) -> bool:
        """Whether the lens has no distortion: no coefficients, or all of them zero."""
        return not any(self.coefficients)

    @property
    def matrix(self) -> Floats:
        """The (3, 3) camera matrix, px."""
        return np.array([[self.camera.fx, 0, self.camera.cx], [0, self.camera.fy, self.camera.cy], [0, 0, 1]])

    @property
    def opencv(self) -> Floats:
        """The coefficients as OpenCV takes them, at least four."""
        return np.array(self.coefficients or (0.0,) * 4, dtype=float)

    def check(self) -> None:
        """Raise InputError if the distortion model is unknown or its coefficients are impossible.

        Impossible means a number of coefficients that the model does not have, or a value that is not finite. A lens whose
        coefficients are all zero passes with any model.
        """
        if self.is_undistorted:
            return
        if self.model not in (*PLUMB_BOB, *FISHEYE):
            models = ", ".join(name for name in (*PLUMB_BOB, *FISHEYE) if name)
            raise InputError(f"the distortion model {self.model!r} is unknown; known are {models}", code="lens-unknown")
        counts = (4,) if self.model in FISHEYE and "Brandt" not in self.model else _COEFFICIENT_COUNTS
        if len(self.coefficients) not in counts or not np.isfinite(self.coefficients).all():
            sentence = f"the distortion model {self.model!r} has impossible coefficients: {self.coefficients}"
            raise InputError(sentence, code="lens-invalid")

    def undistorted(self, image: Array, nearest: bool) -> Array:
        """Return the image that the pinhole camera would take, from an image distorted by this lens.

        `image` is (H, W) or (H, W, 3) with the size of `camera`; the result has the same shape and type, and the intrinsics of
        `camera`. If `nearest` is true, a pixel of the result is a copy of the nearest pixel of `image`, else it is interpolated.
        Use `nearest` for depth, where the mean of two surfaces lies on neither. Pixels seen outside the distorted image are 0.
        Without distortion `image` itself is returned.

        Raises
        ------
        InputError : the distortion model is unknown, or its coefficients are impossible.
        """
        if self.is_undistorted:
            return image
        interpolation = cv2.INTER_NEAREST if nearest else cv2.INTER_LINEAR
        return np.asarray(cv2.remap(image, *_maps(self), interpolation, borderMode=cv2.BORDER_CONSTANT, borderValue=0))


@lru_cache(maxsize=4)
def _maps(lens: Lens) -> tuple[Array, Array]:
    """Return the position in the image of each pixel of the pinhole camera: columns and rows, (H, W) float32 px."""
    lens.check()
    return rectifying_maps(lens, np.eye(3), lens.camera)


def rectifying_maps(lens: Lens, turn: Floats, camera: Camera) -> tuple[Array, Array]:
    """Return the position in a lens's image of each pixel of a pinhole camera: columns and rows, (H, W) float32 px.

    `turn` is the (3, 3) rotation from the optical frame of the lens's camera to that of the pinhole camera.
    """
    size, matrix, new = (camera.width, camera.height), lens.matrix, Lens(camera).matrix
    if lens.model in FISHEYE:
        return cv2.fisheye.initUndistortRectifyMap(matrix, lens.opencv[:4], turn, new, size, cv2.CV_32FC1)
    return cv2.initUndistortRectifyMap(matrix, lens.opencv, turn, new, size, cv2.CV_32FC1)

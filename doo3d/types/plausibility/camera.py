"""Check the intrinsics of a camera, and the distance between two cameras, against those of real cameras."""

import math

import numpy as np

from .. import Array, Camera

MIN_FOCAL_IMAGE_SIDES = 0.38
"""Least focal length, in longer sides of the image, for a field of view of 105 degrees; the widest depth cameras have 0.4."""

MAX_FOCAL_IMAGE_SIDES = 8.0
"""Greatest focal length, in longer sides of the image, for a field of view of 7 degrees, that of a telescope."""

PRINCIPAL_POINT_RANGE = (0.25, 0.75)
"""Range of plausible principal points, as fractions of the width and of the height."""

MAX_FOCAL_RATIO = 1.1
"""Greatest ratio of the two focal lengths: pixels are square in practice, and calibrations differ by less than a percent."""

MAX_BASELINE_M = 0.5
"""Greatest distance of a depth camera from the color camera in the same device, m: that of a wide stereo camera."""


def camera_notes(camera: Camera) -> list[str]:
    """Return a sentence if no depth camera has the field of view, the pixels or the principal point of these intrinsics."""
    side = max(camera.width, camera.height)
    size = f"{camera.width}x{camera.height} px"
    remedy = f"are the intrinsics of this resolution ({size})? Give those of the depth images (--camera FILE)"
    focal = min(camera.fx, camera.fy) / side
    (low, high), ratio = PRINCIPAL_POINT_RANGE, camera.fx / camera.fy
    if not MIN_FOCAL_IMAGE_SIDES <= focal <= MAX_FOCAL_IMAGE_SIDES:
        degrees = 2 * math.degrees(math.atan(0.5 / focal))
        unlike = "wider" if focal < MIN_FOCAL_IMAGE_SIDES else "narrower"
        return [
            f"check the camera: a focal length of {min(camera.fx, camera.fy):.0f} px for an image {side} px wide is a field of "
            f"view of {degrees:.0f} degrees, {unlike} than that of any depth camera: {remedy}"
        ]
    if not 1 / MAX_FOCAL_RATIO <= ratio <= MAX_FOCAL_RATIO:
        return [
            f"check the camera: its focal lengths fx {camera.fx:.0f} and fy {camera.fy:.0f} px differ by a factor of "
            f"{max(ratio, 1 / ratio):.2f}, but the pixels of cameras are square: {remedy}"
        ]
    if not (low < camera.cx / camera.width < high and low < camera.cy / camera.height < high):
        return [
            f"check the camera: the principal point ({camera.cx:.0f}, {camera.cy:.0f}) lies far from the middle of the "
            f"{size} image: {remedy}"
        ]
    return []


def baseline_notes(extrinsics: Array) -> list[str]:
    """Return a sentence if a color camera is farther from its depth camera than in any device.

    extrinsics : (4, 4), depth camera to color camera, m.
    """
    baseline = float(np.linalg.norm(np.asarray(extrinsics, dtype=float)[:3, 3]))
    if baseline <= MAX_BASELINE_M:
        return []
    millimetres = " (as if the transform were in millimetres)" if baseline > 1 else ""
    return [
        f"check the baseline: the color camera is {baseline:.3g} m from the depth camera, farther than in any "
        f"device{millimetres}: give the transform between the two in metres, or images aligned by the camera's driver"
    ]

"""The camera of depth images among several of a file, and what is said about it."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import InputError
from .calibration import Calibration, Pinhole
from .images import Size
from .roles import words_of

REMEDY = "give --camera FILE (JSON or YAML with fx, fy, cx, cy) or --input-option 'camera=[fx, fy, cx, cy]'"
_PX = 0.01  # cameras whose intrinsics differ by less are one


def choose_camera(cameras: Sequence[Calibration], size: Size, aligned: bool) -> tuple[Calibration, str]:
    """Return the camera of the depth images among those of a file, with a note if there was a choice.

    Parameters
    ----------
    cameras
        the cameras, at least one.
    size
        (width, height) of the depth images in px.
    aligned
        whether color images belong to the depth images: these are then pixels of the color camera, as a rule.

    Raises
    ------
    InputError : no camera is for images of this size, or several are and their names do not tell which.
    """
    distinct, where = _distinct(cameras), cameras[0].file
    if len(distinct) == 1:
        return cameras[0], ""
    fitting = [camera for camera in distinct if camera.size in (None, size)]
    if not fitting:
        sizes = ", ".join(sorted({f"{c.size[0]}x{c.size[1]}" for c in cameras if c.size}))
        sentence = f"has cameras for images of {sizes} px, but the depth images are {size[0]}x{size[1]}: {REMEDY}"
        raise InputError(f"{where}: {sentence}", code="intrinsics-size")
    if len(fitting) > 1:
        words = {"color", "rgb", "colour"} if aligned else {"depth"}
        fitting = [camera for camera in fitting if set(words_of(camera.label)) & words] or fitting
    if len(fitting) > 1:
        listed = "; ".join(f"{c.label}: [{', '.join(f'{value:g}' for value in c.pinhole)}]" for c in fitting[:5])
        raise InputError(
            f"{where}: has several cameras for images of {size[0]}x{size[1]} px ({listed}): choose one, with --input-option "
            "'camera=[fx, fy, cx, cy]'",
            code="intrinsics-ambiguous",
        )
    return fitting[0], f"the camera is {fitting[0].label!r} of {where.name}, which has {len(distinct) - 1} more"


def describe_camera(camera: Calibration) -> list[str]:
    """Return the notes about a camera that was read from a file: that a distortion is not removed."""
    if not camera.distorted:
        return []
    return [f"{camera.file.name} has a lens distortion, which is not removed: undistort the images if they are not yet"]


def check_size(camera: Calibration, size: Size) -> None:
    """Check that a camera is for images of a size (width, height) in px.

    Raises
    ------
    InputError : it is for another size; if that has the same shape, the message has the scaled intrinsics.
    """
    if camera.size is None or camera.size == size:
        return
    (width, height), remedy = camera.size, REMEDY
    factor = size[0] / width
    if abs(factor - size[1] / height) < 1e-3 * factor:
        values = ", ".join(f"{value:.2f}" for value in scaled(camera.pinhole, factor, factor))
        remedy = f"if the images were scaled down or up as a whole, give --input-option 'camera=[{values}]'"
    sizes = f"is the camera of images of {width}x{height} px, but the depth images are {size[0]}x{size[1]}"
    raise InputError(f"{camera.file}: {sizes}: {remedy}", code="intrinsics-size")


def scaled(pinhole: Pinhole, x: float, y: float) -> Pinhole:
    """Return fx, fy, cx, cy of images that are wider and higher by factors; a pixel's center has whole coordinates."""
    fx, fy, cx, cy = pinhole
    return fx * x, fy * y, (cx + 0.5) * x - 0.5, (cy + 0.5) * y - 0.5


def _distinct(cameras: Sequence[Calibration]) -> list[Calibration]:
    """Return the cameras without those that equal an earlier one in intrinsics and size."""
    kept: list[Calibration] = []
    for camera in cameras:
        same_size = [other.pinhole for other in kept if other.size == camera.size]
        if not any(max(abs(a - b) for a, b in zip(camera.pinhole, other, strict=True)) < _PX for other in same_size):
            kept.append(camera)
    return kept

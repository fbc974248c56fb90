"""The camera of depth images among several of a file, and what is said about it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ...errors import InputError
from .calibration import Calibration
from .roles import words_of

REMEDY = "give --camera FILE (JSON or YAML with fx, fy, cx, cy) or --input-option 'camera=[fx, fy, cx, cy]'"
_PX = 0.01  # cameras whose intrinsics differ by less are one


def choose_camera(cameras: Sequence[Calibration], size: Callable[[], tuple[int, int]], aligned: bool) -> tuple[Calibration, str]:
    """Return the camera of the depth images among those of a file, with a note if there was a choice.

    Parameters
    ----------
    cameras
        the cameras, at least one.
    size
        function that returns the (width, height) of the depth images in px; called if the cameras differ.
    aligned
        whether color images belong to the depth images: these are then pixels of the color camera, as a rule.

    Raises
    ------
    InputError : no camera is for images of this size, or several are and their names do not tell which.
    """
    if len(_distinct(cameras)) == 1:
        return cameras[0], ""
    width, height = size()
    where = cameras[0].file
    fitting = _distinct([camera for camera in cameras if camera.size in (None, (width, height))])
    if not fitting:
        sizes = ", ".join(sorted({f"{c.size[0]}x{c.size[1]}" for c in cameras if c.size}))
        raise InputError(
            f"{where}: has cameras for images of {sizes} px, but the depth images are {width}x{height}: {REMEDY}",
            code="intrinsics-size",
        )
    if len(fitting) > 1:
        words = {"color", "rgb", "colour"} if aligned else {"depth"}
        fitting = _distinct([camera for camera in fitting if set(words_of(camera.label)) & words]) or fitting
    if len(fitting) > 1:
        listed = "; ".join(f"{c.label}: [{', '.join(f'{value:g}' for value in c.pinhole)}]" for c in fitting[:5])
        raise InputError(
            f"{where}: has several cameras for images of {width}x{height} px ({listed}): choose one, with --input-option "
            "'camera=[fx, fy, cx, cy]'",
            code="intrinsics-ambiguous",
        )
    others = len(_distinct(cameras)) - 1
    return fitting[0], f"the camera is {fitting[0].label!r} of {where.name}, which has {others} more"


def describe_camera(camera: Calibration) -> list[str]:
    """Return the notes about a camera that was read from a file: that a distortion is not removed."""
    if not camera.distorted:
        return []
    return [f"{camera.file.name} has a lens distortion, which is not removed: undistort the images if they are not yet"]


def check_size(camera: Calibration, size: tuple[int, int]) -> None:
    """Check that a camera is for images of a size (width, height) in px.

    Raises
    ------
    InputError : it is for another size; if that has the same shape, the message has the scaled intrinsics.
    """
    if camera.size in (None, size):
        return
    assert camera.size is not None
    factor = size[0] / camera.size[0]
    remedy = REMEDY
    if abs(factor - size[1] / camera.size[1]) < 1e-3 * factor:
        fx, fy, cx, cy = camera.pinhole
        # a pixel's center has whole coordinates, so that the image begins at -0.5
        scaled = (fx * factor, fy * factor, (cx + 0.5) * factor - 0.5, (cy + 0.5) * factor - 0.5)
        values = ", ".join(f"{value:.2f}" for value in scaled)
        remedy = f"if the images were scaled down or up as a whole, give --input-option 'camera=[{values}]'"
    raise InputError(
        f"{camera.file}: is the camera of images of {camera.size[0]}x{camera.size[1]} px, but the depth images are "
        f"{size[0]}x{size[1]}: {remedy}",
        code="intrinsics-size",
    )


def _distinct(cameras: Sequence[Calibration]) -> list[Calibration]:
    """Return the cameras without those that equal an earlier one in intrinsics and size."""
    kept: list[Calibration] = []
    for camera in cameras:
        if not any(
            camera.size == other.size and max(abs(a - b) for a, b in zip(camera.pinhole, other.pinhole, strict=True)) < _PX
            for other in kept
        ):
            kept.append(camera)
    return kept

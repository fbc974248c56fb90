"""The camera of depth images: looked for in files beside the images, and chosen if a file has several."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

from ...errors import InputError
from .calibration import Calibration
from .camera_files import MAX_FILE_BYTES, read_camera_file
from .depth_frames import DepthSensor
from .images import read_depth
from .listing import natural_key
from .roles import words_of

RECORDER_FILE = "camera_intrinsic.json"  # of Open3D's recorder; takes precedence over other files
REMEDY = "give --camera FILE (JSON or YAML with fx, fy, cx, cy) or --input-option 'camera=[fx, fy, cx, cy]'"
_CAMERA_WORDS = {"camera", "cameras", "cam", "intrinsic", "intrinsics", "calib", "calibration", "k", "cameraintrinsic"}
_FOLDERS = ("calib", "calibration", "camera", "intrinsics", "intrinsic")  # sub-folders that are searched, too
_SUFFIXES = (".json", ".yaml", ".yml")
_MAX_OTHER_FILES = 20  # JSON and YAML files without a camera's name that are looked into; more are annotations
_PX = 0.01  # cameras whose intrinsics differ by less are one


def cameras_beside(folders: Iterable[Path], parent: Path | None = None) -> list[Calibration]:
    """Return the cameras described in files beside the images; empty if there are none.

    Of the folders, in order, the first with a camera is used. `camera_intrinsic.json` takes precedence over other JSON, YAML and
    text files whose names speak of a camera, and these over JSON and YAML files of other names. In `parent`, the folder above,
    only files whose names speak of a camera count.

    Raises
    ------
    InputError : the only files named like a camera file cannot be read as one.
    """
    files = {folder: _files(folder) for folder in dict.fromkeys(folders)}
    for found in [*files.values(), _files(parent) if parent else []]:
        recorder = [file for file in found if file.name == RECORDER_FILE]
        named = recorder or [file for file in found if set(words_of(file.stem)) & _CAMERA_WORDS]
        cameras, errors = _read_all(named)
        if cameras:
            return cameras
        if errors and any(file.suffix.lower() in _SUFFIXES for file in named):
            raise errors[0]
    for found in files.values():
        others = [file for file in found if file.suffix.lower() in _SUFFIXES]
        if len(others) <= _MAX_OTHER_FILES and (cameras := _read_all(others)[0]):
            return cameras
    return []


def has_camera_file(folder: Path) -> bool:
    """Return whether there is a file beside the images of a folder that is named like a camera file."""
    return any(set(words_of(file.stem)) & _CAMERA_WORDS for file in _files(folder))


def search_folders(root: Path) -> list[Path]:
    """Return the folders in which the camera of images below `root` is looked for."""
    return [root, *(root / name for name in _FOLDERS)]


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


def sensor_beside(root: Path, depth: Path, scale: float) -> tuple[DepthSensor, list[str]] | None:
    """Return the camera and the unit that a camera file beside the images gives, with notes; None if there is no camera file.

    Parameters
    ----------
    root
        the folder of the capture.
    depth
        a depth image, read if the file has several cameras.
    scale
        units per metre if the file has none.

    Raises
    ------
    InputError : a camera file cannot be read, or its cameras are for images of other sizes.
    """
    found = cameras_beside(search_folders(root))
    if not found:
        return None
    chosen, note = choose_camera(found, partial(depth_size, depth), aligned=True)
    notes = [note] * bool(note) + describe_camera(chosen) + [f"the camera is read from {chosen.file.name}"]
    return DepthSensor(chosen.pinhole, chosen.scale or scale, chosen.size), notes


def depth_size(file: Path) -> tuple[int, int]:
    """Return (width, height) of a depth image, px."""
    height, width = read_depth(file, 1.0, math.inf).shape
    return width, height


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


def _files(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    files = [file for file in folder.iterdir() if file.suffix.lower() in (*_SUFFIXES, ".txt") and not file.name.startswith(".")]
    small = [file for file in files if file.is_file() and file.stat().st_size <= MAX_FILE_BYTES]
    return sorted(small, key=lambda file: natural_key(file.name))


def _read_all(files: Iterable[Path]) -> tuple[list[Calibration], list[InputError]]:
    cameras, errors = list[Calibration](), list[InputError]()
    for file in files:
        try:
            cameras += read_camera_file(file)
        except InputError as error:
            errors.append(error)
    return cameras, errors


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

"""The search for the camera of depth images in files beside them: a file is only taken if it fits the size of the images."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from ...errors import InputError
from .calibration import Calibration
from .camera_choice import REMEDY, check_size, choose_camera, describe_camera
from .camera_files import MAX_FILE_BYTES, read_camera_file
from .images import Size
from .listing import natural_key
from .roles import words_of

RECORDER_FILE = "camera_intrinsic.json"  # of Open3D's recorder; takes precedence over other files
_CAMERA_WORDS = {"camera", "cameras", "cam", "intrinsic", "intrinsics", "calib", "calibration", "k", "cameraintrinsic"}
_FOLDERS = ("calib", "calibration", "camera", "intrinsics", "intrinsic")  # sub-folders that are searched, too
_SUFFIXES = (".json", ".yaml", ".yml")
_MAX_OTHER_FILES = 20  # JSON and YAML files without a camera's name that are looked into; more are annotations
_PRINCIPAL_POINT_RANGE = (0.4, 0.6)
"""Share of width and height in which the principal point lies. Depth cameras have 0.46 to 0.54; a camera at its next resolution,
which is a third larger or smaller, is outside."""


class FoundCamera(NamedTuple):
    """The camera of depth images that a file beside them describes.

    Attributes
    ----------
    camera
        the camera.
    notes
        the path of the file, unless it is that of Open3D's recorder, and what else is to be said.
    others
        all cameras in the files of that folder, such as that of the color images.
    """

    camera: Calibration
    notes: list[str]
    others: list[Calibration]


def find_camera(
    root: Path, size: Size | None, aligned: bool, images: Path | None = None, parent: Path | None = None
) -> FoundCamera | None:
    """Return the camera of depth images that a file beside them describes; None if there is none.

    Of the folders, in order, the first with a camera that fits is used. `camera_intrinsic.json` takes precedence over other JSON,
    YAML and text files whose names speak of a camera, and these over JSON and YAML files of other names.

    Parameters
    ----------
    root
        the folder of the capture; sub-folders called calib, intrinsic and the like are searched, too.
    size
        (width, height) of the depth images in px; None if it is unknown: then every camera fits.
    aligned
        whether color images have the pixels of the depth images: these are then pixels of the color camera, as a rule.
    images
        the folder of the depth images, if that is another one.
    parent
        the folder above, in which only files whose names speak of a camera count.

    Raises
    ------
    InputError : the only files named like a camera file cannot be read as one, their cameras are for images of another size, or
        several cameras fit and their names do not tell which.
    """
    misfits = list[Calibration]()
    for group, is_own in _groups(dict.fromkeys([root, *([images] if images else [])]), parent):
        plausible = [camera for camera in group if fits(camera, size)]
        if plausible:
            rest = [camera for camera in group if camera.size is not None and camera not in plausible]
            chosen, note = choose_camera([*plausible, *rest], size, aligned) if size else (plausible[0], "")
            notes = [note] * bool(note) + describe_camera(chosen)
            if chosen.file != root / RECORDER_FILE:
                notes.append(f"the camera is read from {_below(chosen.file, root)}")
            return FoundCamera(chosen, notes, group)
        misfits += group if is_own else []
    if misfits and size is not None:
        raise _misfit(misfits, size)
    return None


def _below(file: Path, root: Path) -> Path:
    return file.relative_to(root) if file.is_relative_to(root) else file


def fits(camera: Calibration, size: Size | None) -> bool:
    """Return whether a camera can be that of images of a size: the size that it states is this one, or the center is likely."""
    if size is None or camera.size is not None:
        return size is None or camera.size == size
    low, high = _PRINCIPAL_POINT_RANGE
    return all(low <= (at + 0.5) / side <= high for at, side in zip(camera.pinhole[2:], size, strict=True))


def has_camera_file(folder: Path) -> bool:
    """Return whether there is a file beside the images of a folder that is named like a camera file."""
    return any(_is_named(file) for base in search_folders(folder) for file in _files(base))


def search_folders(root: Path) -> list[Path]:
    """Return the folders in which the camera of images below `root` is looked for."""
    return [root, *(root / name for name in _FOLDERS)]


def _groups(bases: Iterable[Path], parent: Path | None) -> Iterator[tuple[list[Calibration], bool]]:
    """Yield the cameras of each folder that has some, and whether the folder belongs to the capture."""
    own = {folder: _files(folder) for base in bases for folder in search_folders(base)}
    for found in [*own.values(), *([_files(parent)] if parent else [])]:
        is_own = any(found is each for each in own.values())
        named = [file for file in found if file.name == RECORDER_FILE] or list(filter(_is_named, found))
        cameras, errors = _read_all(named)
        if cameras:
            yield cameras, is_own
        elif errors and is_own and any(file.suffix.lower() in _SUFFIXES for file in named):
            raise errors[0]
    for found in own.values():
        others = [file for file in found if file.suffix.lower() in _SUFFIXES]
        if len(others) <= _MAX_OTHER_FILES and (cameras := _read_all(others)[0]):
            yield cameras, False


def _misfit(cameras: Sequence[Calibration], size: Size) -> InputError:
    """Return the error for cameras none of which fits images of a size."""
    stated = next((camera for camera in cameras if camera.size is not None), None)
    if stated is not None:
        try:
            choose_camera(cameras, size, aligned=False)
            check_size(stated, size)
        except InputError as error:
            return error
    file, (_, _, cx, cy) = cameras[0].file, cameras[0].pinhole
    return InputError(
        f"{file}: the principal point ({cx:g}, {cy:g}) is far from the middle of the depth images of {size[0]}x{size[1]} px, so "
        f"this is the camera of others: {REMEDY}; --camera {file} takes this one all the same",
        code="intrinsics-size",
    )


def _is_named(file: Path) -> bool:
    return bool(set(words_of(file.stem)) & _CAMERA_WORDS)


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

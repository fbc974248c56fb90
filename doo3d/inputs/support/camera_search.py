"""Search the camera of depth images in files beside them; a camera is only used if it fits the size of the images."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from ...errors import InputError
from .calibration import Calibration, Pinhole
from .camera_files import MAX_FILE_BYTES, read_camera_file
from .images import Size
from .listing import natural_key, words_of

RECORDER_FILE = "camera_intrinsic.json"  # of Open3D's recorder; takes precedence over other files
_CAMERA_WORDS = {"camera", "cameras", "cam", "intrinsic", "intrinsics", "calib", "calibration", "k", "cameraintrinsic"}
_AMBIGUOUS_WORDS = {"k"}  # in the name of a file above the capture, where it may stand for anything, such as k7.json
_FOLDERS = ("calib", "calibration", "camera", "intrinsics", "intrinsic", "camera_params")  # sub-folders that are searched, too
_SUFFIXES = (".json", ".yaml", ".yml")
_MAX_OTHER_FILES = 20  # JSON and YAML files without a camera's name that are looked into; more are annotations
_PRINCIPAL_POINT_RANGE = (0.4, 0.6)
"""Range of the principal point, as a fraction of width and height. Depth cameras have 0.46 to 0.54; the values of the next
resolution, a third larger or smaller, are outside."""
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
        whether color images belong to the depth images, which then usually have the pixels of the color camera.

    Raises
    ------
    InputError : no camera is for images of this size, or several are and their names do not identify one.
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
        fault = f"has several cameras for images of {size[0]}x{size[1]} px ({listed})"
        remedy = "choose one, with --input-option 'camera=[fx, fy, cx, cy]'"
        raise InputError(f"{where}: {fault}: {remedy}", code="intrinsics-ambiguous")
    return fitting[0], f"the camera is {fitting[0].label!r} of {where.name}, which has {len(distinct) - 1} more"


def describe_camera(camera: Calibration) -> list[str]:
    """Return the notes about a camera from a file: a sentence if its distortion is not removed."""
    if not camera.distorted:
        return []
    return [f"{camera.file.name} has a lens distortion, which is not removed: undistort the images if they are not yet"]


def check_size(camera: Calibration, size: Size) -> None:
    """Check that a camera is for images of a size (width, height) in px.

    Raises
    ------
    InputError : the camera is for another size; if the aspect ratio is the same, the message has the scaled intrinsics.
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
    """Scale intrinsics to images that are wider by x and higher by y; a pixel's center has whole coordinates."""
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


class FoundCamera(NamedTuple):
    """The camera of depth images that a file beside them describes.

    Attributes
    ----------
    camera
        the camera.
    notes
        notes: the path of the file, unless it is that of Open3D's recorder, and remarks about the camera.
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

    The first folder with a camera that fits is used. `camera_intrinsic.json` takes precedence over other JSON, YAML and text
    files with a camera word in their names, and these over JSON and YAML files with other names.

    Parameters
    ----------
    root
        the folder of the capture; sub-folders called calib, intrinsic and the like are searched, too.
    size
        (width, height) of the depth images in px; None if it is unknown: then every camera fits.
    aligned
        whether color images have the pixels of the depth images, which are then usually those of the color camera.
    images
        the folder of the depth images, if it is not `root`.
    parent
        the parent folder, which other captures may share: only files count that have a whole camera word in their names and state
        the size of these images.

    Raises
    ------
    InputError : the only files named like a camera file cannot be read as one, their cameras are for images of another size, or
        several cameras fit and their names do not identify one.
    """
    misfits = list[Calibration]()
    for group, is_own in _groups(dict.fromkeys([root, *([images] if images else [])]), parent):
        plausible = [camera for camera in group if fits(camera, size)]
        if plausible:
            rest = [camera for camera in group if camera.size is not None and camera not in plausible]
            chosen, note = choose_camera([*plausible, *rest], size, aligned) if size else (plausible[0], "")
            notes = [note] * bool(note) + describe_camera(chosen)
            if chosen.file != root / RECORDER_FILE:
                below = chosen.file.relative_to(root) if chosen.file.is_relative_to(root) else chosen.file
                notes.append(f"the camera is read from {below}")
            return FoundCamera(chosen, notes, group)
        misfits += group if is_own else []
    if misfits and size is not None:
        raise _misfit(misfits, size)
    return None


def fits(camera: Calibration, size: Size | None) -> bool:
    """Return whether a camera fits images of a size: its stated size is equal, or else its principal point is plausible."""
    if size is None or camera.size is not None:
        return size is None or camera.size == size
    low, high = _PRINCIPAL_POINT_RANGE
    return all(low <= (at + 0.5) / side <= high for at, side in zip(camera.pinhole[2:], size, strict=True))


def has_camera_file(folder: Path) -> bool:
    """Return whether there is a file beside the images of a folder that is named like a camera file."""
    return any(_is_named(file) for base in search_folders(folder) for file in _files(base))


def search_folders(root: Path) -> list[Path]:
    """Return the folders in which the camera of images below `root` is searched."""
    return [root, *(root / name for name in _FOLDERS)]


def _groups(bases: Iterable[Path], parent: Path | None) -> Iterator[tuple[list[Calibration], bool]]:
    """Yield the cameras of each folder that has some, and whether the folder belongs to the capture."""
    own = {folder: _files(folder) for base in bases for folder in search_folders(base)}
    for found in own.values():
        named = [file for file in found if file.name == RECORDER_FILE] or list(filter(_is_named, found))
        cameras, errors = _read_all(named)
        if cameras:
            yield cameras, True
        elif errors and any(file.suffix.lower() != ".txt" for file in named):
            raise errors[0]
    if parent:
        above = [file for file in _files(parent) if _is_named(file, _CAMERA_WORDS - _AMBIGUOUS_WORDS)]
        yield [camera for camera in _read_all(above)[0] if camera.size is not None], False
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
    place = f"the principal point ({cx:g}, {cy:g}) is far from the middle of the depth images of {size[0]}x{size[1]} px"
    remedy = f"{REMEDY}; --camera {file} takes this one all the same"
    return InputError(f"{file}: {place}, so this is the camera of others: {remedy}", code="intrinsics-size")


def _is_named(file: Path, words: Collection[str] = _CAMERA_WORDS) -> bool:
    return any(word in words for word in words_of(file.stem)) or _is_viewers(file)


def _is_viewers(file: Path) -> bool:
    """Return whether a file has the name of a RealSense Viewer snapshot's metadata: <name>_Depth_metadata.csv."""
    return file.suffix.lower() == ".csv" and file.stem.lower().endswith(("depth_metadata", "color_metadata"))


def _files(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    files = [file for file in folder.iterdir() if file.suffix.lower() in (*_SUFFIXES, ".txt") or _is_viewers(file)]
    small = [file for file in files if not file.name.startswith(".") and file.is_file() and file.stat().st_size <= MAX_FILE_BYTES]
    return sorted(small, key=lambda file: natural_key(file.name))


def _read_all(files: Iterable[Path]) -> tuple[list[Calibration], list[InputError]]:
    cameras, errors = list[Calibration](), list[InputError]()
    for file in files:
        try:
            cameras += read_camera_file(file)
        except InputError as error:
            errors.append(error)
    return cameras, errors

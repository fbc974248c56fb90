"""Read calibrations of stereo pairs, in the files of ZED cameras, OpenCV and ROS.

Sources: Stereolabs' zed-open-capture, examples/include/calibration.hpp, and zed-opencv-native's Python (SN*.conf); OpenCV's
samples/cpp/stereo_calib.cpp (M1, D1, M2, D2, R, T); ROS's sensor_msgs/CameraInfo and camera_calibration_parsers (K, D, R, P).
"""

import configparser
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np

from ...errors import InputError
from ...guard.guarding import guarded, read_bytes
from ...guard.parsing import MAX_YAML_BYTES, parse_json, parse_yaml
from ...types import Camera, Floats
from ..bag.undistortion import Lens
from ..support.depth_frames import numbers, pinhole_of
from ..support.images import Size
from .stereo_pair import StereoPair

Unit = Literal["m", "mm"]
Values = dict[str, Any]

UNITS: dict[str, float] = {"m": 1.0, "mm": 1000.0}
"""Unit of a translation -> number of units per metre."""

_CALIBRATION_SUFFIXES = (".conf", ".ini", ".yaml", ".yml", ".xml", ".json")
_ZED_SIZES = {"2K": (2208, 1242), "FHD1200": (1920, 1200), "FHD": (1920, 1080), "HD": (1280, 720), "SVGA": (960, 600)}
_ZED_SIZES |= {"VGA": (672, 376)}
_UNITS: tuple[Unit, ...] = ("mm", "m")
_SIDES = ("left", "right")
_TAGS = (("1", "l", "left"), ("2", "r", "right"))
_MATRICES = ("k", "m", "mtx", "cameramatrix", "intrinsics", "intrinsicmatrix")
_LENSES = ("d", "dist", "distcoeffs", "distortion", "distortioncoefficients", "distcoefs")
_ROTATIONS, _TRANSLATIONS = ("r", "rotation", "rotationmatrix", "rot"), ("t", "translation", "translationvector", "trans")
_SIZES = ("image_size", "imageSize", "size", "img_size", "resolution")


def read_stereo_pair(files: Sequence[Path], size: Size | None, unit: Unit | None, rectified: bool = False) -> StereoPair:
    """Read the calibration of a stereo pair.

    Parameters
    ----------
    files
        one file of ZED (its SN*.conf, or the same as YAML), of OpenCV (YAML, XML or JSON with K1, D1, K2, D2, R, T; also two, the
        intrinsics and the extrinsics), or ROS's camera_info of the left and of the right camera.
    size
        (width, height) px of one camera's images, which chooses among the resolutions of a ZED and has to agree with the
        file; None if unknown.
    unit
        the unit of the translation between the cameras; None for the format's own unit, mm for ZED and m for ROS. OpenCV's format
        has none.
    rectified
        whether the images are rectified already, so that only the projection matrices of ROS, or focal length and baseline of
        OpenCV's P1 and P2, are used.

    Raises
    ------
    InputError : a file cannot be read, keys are missing, a value is impossible, or the images have another size.
    """
    contents = [_content(file) for file in files]
    source = " and ".join(str(file) for file in files)
    merged: Values = {key: value for values in contents for key, value in values.items()}
    if any(str(key).upper().startswith("LEFT_CAM_") for key in merged):
        pair = _zed_pair(merged, source, size, unit or "mm", rectified)
    elif len(contents) == len(_SIDES) and all("projection_matrix" in values or "P" in values for values in contents):
        pair = _ros_pair(contents, [str(file) for file in files], size, unit or "m", rectified)
    elif "projection_matrix" in merged or "P" in merged:
        sentence = "is the camera_info of one camera: give those of both, `calibration: [left.yaml, right.yaml]` in a rig file"
        raise InputError(f"{source}: {sentence}", code="rig-invalid")
    else:
        pair = _opencv_pair(merged, source, size, unit, rectified)
    _check_size(pair, size, source)
    return pair


def find_pair_calibration(folder: Path, size: Size) -> Path | None:
    """Find the calibration file of a stereo pair whose views are side by side in images of a given size.

    size : (width, height) px of an image with both views. None if there is no such file.
    """
    width, height = size
    for file in sorted(folder.iterdir()) if width % 2 == 0 else ():
        if file.suffix.lower() not in _CALIBRATION_SUFFIXES or not file.is_file() or file.stat().st_size > MAX_YAML_BYTES:
            continue
        for unit in _UNITS:
            try:
                read_stereo_pair([file], (width // 2, height), unit)
            except InputError:
                continue
            return file
    return None


def _content(file: Path) -> Values:
    """Read the keys and values of a file of ZED, OpenCV or ROS; matrices are nested or flat lists of numbers."""
    data, where = read_bytes(file, MAX_YAML_BYTES), str(file)
    suffix = file.suffix.lower()
    with guarded(file):
        if suffix in (".conf", ".ini"):
            parser = configparser.ConfigParser(interpolation=None, strict=False)
            parser.optionxform = str  # type: ignore[assignment,method-assign]  # keeps capital letters
            try:
                parser.read_string(data.decode("utf-8-sig", "replace"))
            except configparser.Error:
                raise InputError(f"{file}: expected sections of keys, such as [STEREO] of a ZED", code="file-damaged") from None
            values: Any = {name: dict(parser[name]) for name in parser.sections()}
        elif suffix == ".xml":
            root = ElementTree.fromstring(data)
            values = {node.tag: _xml_value(node) for node in root}
        elif suffix == ".json":
            values = parse_json(data, where)
        else:
            values = parse_yaml(data, where, ignore_tags=True)
    if not isinstance(values, dict) or not values:
        raise InputError(f"{file}: holds no calibration: expected keys and values", code="intrinsics-missing")
    return {str(key): value["data"] if isinstance(value, dict) and "data" in value else value for key, value in values.items()}


def _xml_value(node: ElementTree.Element) -> Any:
    """Return the numbers of a matrix or a list in OpenCV's XML; the text of anything else."""
    text = (node.findtext("data") if node.find("data") is not None else node.text) or ""
    words = text.split()
    return words if len(words) > 1 or node.find("data") is not None else text.strip()


def _zed_pair(values: Values, source: str, size: Size | None, unit: Unit, rectified: bool) -> StereoPair:
    """Return the pair of a ZED's factory calibration for the images' resolution.

    The translation is in mm, the rotation is a rotation vector.
    """
    known = {name: each for name, each in _ZED_SIZES.items() if f"LEFT_CAM_{name}" in values}
    name = next((name for name, each in known.items() if each == size), None)
    if size is None or name is None:
        sizes = ", ".join(f"{width}x{height}" for width, height in known.values())
        shown = "of unknown size" if size is None else f"{size[0]}x{size[1]}"
        raise InputError(f"{source}: the images are {shown}, but it has cameras for {sizes} each", code="intrinsics-size")
    stereo = _object(values, "STEREO", source)

    def number(*keys: str, default: float | None = None) -> float:
        spelled = [each for key in keys for each in (f"{key}_{name}", key)]
        if default is not None and not any(each in stereo for each in spelled):
            return default
        return _number(stereo, spelled, f"{source}: STEREO")

    lenses = []
    for side in _SIDES:
        key = f"{side.upper()}_CAM_{name}"
        entry, where = _object(values, key, source), f"{source}: {key}"
        fx, fy, cx, cy, k1, k2 = (_number(entry, [each], where) for each in ("fx", "fy", "cx", "cy", "k1", "k2"))
        p1, p2, k3 = (_number(entry, [each], where) if each in entry else 0.0 for each in ("p1", "p2", "k3"))
        lenses.append(Lens(Camera(fx, fy, cx, cy, *size), "plumb_bob", (k1, k2, p1, p2, k3)))
    vector = np.array([number("RX"), number("CV", "RY"), number("RZ")])
    # the baseline is a length, TY and TZ (older files lack these) are components of t in x_right = R x_left + t
    shift = np.array([-number("Baseline", "BaseLine"), number("TY", default=0.0), number("TZ", default=0.0)]) / UNITS[unit]
    if rectified:
        raise InputError(f"{source}: a ZED's factory calibration is of its raw images, not of rectified ones", code="rig-invalid")
    return _pair(lenses, cv2.Rodrigues(vector)[0], shift, source)


def _ros_pair(contents: Sequence[Values], names: Sequence[str], size: Size | None, unit: Unit, rectified: bool) -> StereoPair:
    """Return the pair of two CameraInfo messages.

    R is the rectifying rotation of each camera; P of the right camera holds -fx times the baseline.
    """
    lenses, turns, shifts = list[Lens](), list[Floats](), list[Floats]()
    for values, name in zip(contents, names, strict=True):
        matrix = numbers(_first(values, ("projection_matrix", "P"), name), 12, f"{name}: P", "intrinsics-invalid").reshape(3, 4)
        given = [_first(values, keys, name) for keys in (("image_width", "width"), ("image_height", "height"))]
        width, height = (int(each) for each in numbers(given, 2, f"{name}: image size", "intrinsics-invalid"))
        if matrix[0, 0] <= 0:
            raise InputError(f"{name}: P begins with {matrix[0, 0]:g}: the camera is not calibrated", code="intrinsics-invalid")
        shifts.append(matrix[:, 3] / matrix[0, 0] / UNITS[unit])
        if rectified:
            lenses.append(Lens(Camera(*pinhole_of(matrix[:, :3], f"{name}: P"), width=width, height=height)))
            turns.append(np.eye(3))
            continue
        pinhole = pinhole_of(_first(values, ("camera_matrix", "K", "k"), name), f"{name}: K")
        model = str(values.get("distortion_model", "plumb_bob"))
        coefficients = _floats(values.get("distortion_coefficients", values.get("D", values.get("d", ()))), f"{name}: D")
        lenses.append(Lens(Camera(*pinhole, width=width, height=height), model, coefficients))
        rotation = _first(values, ("rectification_matrix", "R", "r"), name)
        turns.append(numbers(rotation, 9, f"{name}: R", "pose-invalid").reshape(3, 3))
    # of a point: turns[1] x_right = turns[0] x_left + (its shift along the row)
    turn, shift = turns[1].T @ turns[0], turns[1].T @ (shifts[1] - shifts[0])
    return _pair(lenses, turn, shift, " and ".join(names))


def _opencv_pair(values: Values, source: str, size: Size | None, unit: Unit | None, rectified: bool) -> StereoPair:
    """Return the pair of results of OpenCV's stereoCalibrate, under the usual names of programs."""
    if rectified:
        sentence = "rectified images have no distortion and no R: give intrinsics and poses of both cameras in the rig file"
        raise InputError(f"{source}: {sentence}", code="rig-invalid")
    if unit is None:
        sentence = "OpenCV's T is in the unit of the calibration board, which it does not say: add `unit: m` or `unit: mm`"
        raise InputError(f"{source}: {sentence} to a rig file with `calibration: {source}`", code="unit-missing")
    given = _size_in(values, source) or size
    if given is None:
        raise InputError(f"{source}: has no image size, and no image was found", code="intrinsics-size")
    lenses = []
    for side, tags in zip(_SIDES, _TAGS, strict=True):
        matrix, lens = (_tagged(values, stems, tags, source) for stems in (_MATRICES, _LENSES))
        pinhole = pinhole_of(matrix, f"{source}: camera matrix of the {side} camera")
        coefficients = _floats(lens, f"{source}: distortion of the {side} camera")
        lenses.append(Lens(Camera(*pinhole, width=given[0], height=given[1]), "plumb_bob", coefficients))
    turn = numbers(_tagged(values, _ROTATIONS, ("",), source), 9, f"{source}: R", "pose-invalid").reshape(3, 3)
    shift = numbers(_tagged(values, _TRANSLATIONS, ("",), source), 3, f"{source}: T", "pose-invalid")
    return _pair(lenses, turn, shift / UNITS[unit], source)


def _size_in(values: Values, source: str) -> Size | None:
    """Return the image size (width, height) px in a file of OpenCV; None if it has none."""
    given: Any = next((values[key] for key in _SIZES if key in values), None)
    if given is None and {"image_width", "image_height"} <= values.keys():
        given = [values["image_width"], values["image_height"]]
    if given is None:
        return None
    width, height = numbers(given, 2, f"{source}: image size", "intrinsics-invalid")
    return int(width), int(height)


def _check_size(pair: StereoPair, size: Size | None, source: str) -> None:
    for side, lens in zip(_SIDES, (pair.left, pair.right), strict=True):
        own = (lens.camera.width, lens.camera.height)
        if size is not None and own != size:
            sizes = f"the {side} camera is calibrated for {own[0]}x{own[1]}, but its images are {size[0]}x{size[1]}"
            raise InputError(f"{source}: {sizes}: give the calibration of this resolution", code="intrinsics-size")
        x, y = lens.camera.cx / own[0], lens.camera.cy / own[1]
        if not (1 / 4 < x < 3 / 4 and 1 / 4 < y < 3 / 4):
            place = f"the principal point of the {side} camera is at {x:.0%} of the width and {y:.0%} of the height"
            raise InputError(f"{source}: {place} of its images ({own[0]}x{own[1]}): is it for others?", code="intrinsics-size")


def _pair(lenses: Sequence[Lens], rotation: Floats, translation: Floats, source: str) -> StereoPair:
    return StereoPair(lenses[0], lenses[1], tuple(rotation.ravel().tolist()), tuple(translation.tolist()), source)


def _object(values: Values, key: str, source: str) -> Mapping[str, Any]:
    found = values.get(key)
    if not isinstance(found, Mapping):
        raise InputError(f"{source}: has no {key}", code="intrinsics-missing")
    return found


def _first(values: Mapping[str, Any], names: Sequence[str], source: str) -> Any:
    """Return the value of the first key in `names` that a file has."""
    for name in names:
        if name in values:
            return values[name]
    raise InputError(f"{source}: has no {' or '.join(names)}", code="intrinsics-missing")


def _tagged(values: Mapping[str, Any], stems: Sequence[str], tags: Sequence[str], source: str) -> Any:
    """Return the value whose key is a stem with a tag before or after it, such as K1 or left_camera_matrix."""
    plain = {re.sub("[^a-z0-9]", "", str(key).lower()): value for key, value in values.items()}
    for stem in stems:
        for name in (name for tag in tags for name in (stem + tag, tag + stem)):
            if name in plain:
                return plain[name]
    first = f"{stems[0]}{tags[0]}".upper()
    raise InputError(f"{source}: has no {first} (nor {stems[-1]}{'_' if tags[-1] else ''}{tags[-1]})", code="intrinsics-missing")


def _number(values: Mapping[str, Any], names: Sequence[str], where: str) -> float:
    return float(numbers([_first(values, names, where)], 1, f"{where}: {names[0]}", "intrinsics-invalid")[0])


def _floats(given: Any, where: str) -> tuple[float, ...]:
    """Return the distortion coefficients of a lens from a list of any nesting."""
    count: Callable[[Any], int] = np.size
    return tuple(numbers(given, count(given), where, "lens-invalid").tolist())

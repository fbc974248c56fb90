"""Define a calibrated camera, and find it in the nested objects of a JSON or YAML file."""

import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...errors import InputError

Pinhole = tuple[float, float, float, float]
"""Intrinsics of a pinhole camera: fx, fy, cx, cy in px."""
_MAX_DEPTH = 6  # nested objects that are searched
_MAX_VALUES = 64  # numbers that are read of one matrix
_MIN_UNITS_PER_M = 50.0  # a depth scale above is units per metre (1000: mm, 5000), one below
_MAX_M_PER_UNIT = 0.02  # is metres per unit (0.001: mm, 0.01: cm), and one in between
_MM_PER_M = 1000.0  # is millimetres per unit, as in BOP's camera.json
_MATRIX_KEYS = ("intrinsicmatrix", "cameramatrix", "camk", "k", "kmatrix", "intrinsics", "intrinsic", "cameraintrinsics")
_SCALE_KEYS = ("depthscale", "depthmapfactor", "depthfactor", "factordepth", "depthunits")
_DISTORTION_KEYS = ("d", "distortioncoefficients", "distortion", "distcoeffs", "dist", "coeffs", "k1", "k2", "p1", "p2", "k3")
_ALIASES = {"ppx": "cx", "ppy": "cy", "flx": "fx", "fly": "fy", "w": "width", "h": "height"}
_ALIASES |= {"imagewidth": "width", "imageheight": "height", "resolutionx": "width", "resolutiony": "height"}
_MIN_APERTURE = 1e-9  # mm, so that a camera of no width is refused as impossible, not divided by zero
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"


class Calibration(NamedTuple):
    """The intrinsics of one camera, read from a file.

    Attributes
    ----------
    pinhole
        the tuple (fx, fy, cx, cy) in px.
    size
        (width, height) of the camera's images in px; None if the file does not state it.
    scale
        units of the depth images per metre; None if the file does not state them.
    label
        file name and keys of the objects around the camera in the file, which distinguish depth and color cameras.
    file
        the file that it was read from.
    distorted
        whether the file has lens distortion, which is not removed.
    """

    pinhole: Pinhole
    size: tuple[int, int] | None = None
    scale: float | None = None
    label: str = ""
    file: Path = Path()
    distorted: bool = False


def cameras_in(values: Any, path: Path, label: str, depth: int = 0) -> Iterator[Calibration]:
    """Yield the camera that an object describes, or else the cameras of the objects within it.

    Parameters
    ----------
    values
        the parsed content of a JSON or YAML file.
    path
        the file, named in errors.
    label
        label of the camera; the keys of the objects around a camera are added.
    depth
        number of objects around `values`.

    Raises
    ------
    InputError : a value is impossible.
    """
    if depth > _MAX_DEPTH:
        return
    if isinstance(values, list):
        for i, value in enumerate(values[:_MAX_VALUES]):
            if isinstance(value, dict):
                yield from cameras_in(value, path, f"{label} {i}", depth + 1)
    if not isinstance(values, dict):
        return
    camera = camera_of(values, path, label)
    if camera is not None:
        yield camera
        return
    scale = _scale_in(_normalized(values), path)
    for key, value in list(values.items())[:_MAX_VALUES]:
        if isinstance(value, dict | list):
            for camera in cameras_in(value, path, f"{label} {key}", depth + 1):
                yield camera if camera.scale is not None else camera._replace(scale=scale)


def camera_of(values: Mapping[Any, Any], path: Path, label: str) -> Calibration | None:
    """Return the camera that the values of an object describe, without those of objects within it; None if they describe none.

    `label` is the camera's label. Raises InputError, which names the file `path`, if a value is impossible.
    """
    keys = _normalized(values)
    pinhole = _pinhole_in(keys, path)
    if pinhole is None:
        return None
    return Calibration(pinhole, _size_in(keys, path), _scale_in(keys, path), label, path, _is_distorted(keys))


def _normalized(values: Mapping[Any, Any]) -> dict[str, Any]:
    return {_normal(key): value for key, value in values.items() if isinstance(key, str)}


def _normal(key: str) -> str:
    """Return a key in lower case without separators and without the words before a dot: Camera.fx and FX become fx."""
    short = re.sub(r"[^a-z0-9]", "", key.rpartition(".")[2].lower())
    return _ALIASES.get(short, short)


def _pinhole_in(keys: Mapping[str, Any], path: Path) -> Pinhole | None:
    if all(key in keys for key in ("fx", "fy", "cx", "cy")):
        return check_pinhole(_flat([keys[key] for key in ("fx", "fy", "cx", "cy")]), f"{path}: fx, fy, cx, cy")
    if {"camerafocallength", "cameraaperture", "renderproductresolution"} <= set(keys):
        width, height, *_ = [*_flat(keys["renderproductresolution"]), math.nan, math.nan]
        aperture, *_ = [*_flat(keys["cameraaperture"]), math.nan]  # mm; the vertical one is not used by the renderer
        focal_px = _flat(keys["camerafocallength"])[0] * width / max(aperture, _MIN_APERTURE)
        return check_pinhole([focal_px, focal_px, width / 2, height / 2], f"{path}: cameraFocalLength, cameraAperture")
    focal, center = keys.get("focallength", keys.get("focal")), keys.get("principalpoint")
    if focal is not None and isinstance(center, list):
        pair = focal if isinstance(focal, list) else [focal, focal]
        return check_pinhole(_flat([*pair, *center]), f"{path}: focal_length, principal_point")
    for key in _MATRIX_KEYS:
        value = keys.get(key)
        value = value.get("data") if isinstance(value, dict) else value
        if isinstance(value, str) or (isinstance(value, list) and not any(isinstance(item, dict) for item in value)):
            numbers = _flat(value)
            is_nested = any(isinstance(row, list) for row in value)
            name = "intrinsic_matrix" if key == "intrinsicmatrix" else key
            return check_pinhole(numbers[:3] if len(numbers) == 4 and is_nested else numbers, f"{path}: {name}")
    return None


def _flat(values: Any) -> list[float]:
    """Return the numbers in nested lists, row by row; NaN for other values, and for lists of unequal lengths."""
    try:
        numbers: list[float] = np.asarray(values, dtype=float).ravel().tolist()  # YAML reads 1e3 as text
        return numbers
    except (TypeError, ValueError, OverflowError):
        return [math.nan]


def check_pinhole(numbers: list[float], where: str) -> Pinhole:
    """Check the numbers of a camera and return its fx, fy, cx, cy in px.

    The input is these 4 numbers, or a matrix of 9 (3x3), 12 (3x4) or 16 (4x4) numbers, row by row; a 3x3 matrix may also be
    column by column. `where` is the file and the name of the matrix in it, for errors.

    Raises
    ------
    InputError : another number of values, a value that is not finite, a matrix of another form, a focal length not above zero.
    """
    count, shown = len(numbers), ", ".join(f"{value:g}" for value in numbers[:9])
    form = "9 numbers of a camera matrix (fx, 0, cx, 0, fy, cy, 0, 0, 1) or 4 (fx, fy, cx, cy)"
    if count not in (4, 9, 12, 16) or not all(map(math.isfinite, numbers)):
        raise InputError(f"{where}: expected {form}, got {count}: {shown}", code="intrinsics-invalid")
    if count == 4:
        fx, fy, cx, cy = numbers
    else:
        width = {9: 3, 12: 4, 16: 4}[count]
        rows = [numbers[i * width : i * width + 3] for i in range(3)]
        if rows[2] != [0, 0, 1]:
            rows = [list(column) for column in zip(*rows, strict=True)]  # Open3D's is column by column
        if rows[2] != [0, 0, 1] or rows[1][0]:
            raise InputError(f"{where} is {shown}: expected {form}", code="intrinsics-invalid")
        fx, fy, cx, cy = rows[0][0], rows[1][1], rows[0][2], rows[1][2]
    if fx <= 0 or fy <= 0:
        values = f"intrinsics fx={fx:g} fy={fy:g} cx={cx:g} cy={cy:g}"
        raise InputError(f"{where}: {values}: expected focal lengths above zero, in pixels", code="intrinsics-invalid")
    return fx, fy, cx, cy


def _size_in(keys: Mapping[str, Any], path: Path) -> tuple[int, int] | None:
    given = [keys[key] for key in ("width", "height") if key in keys]
    if len(given) != 2:
        pairs = (keys.get(key) for key in ("resolution", "imagesize", "size", "renderproductresolution"))
        given = next((each for each in pairs if isinstance(each, list)), [])
    if len(given) != 2 or ("d" in keys and given == [0, 0]):  # a CameraInfo without size
        return None
    numbers = [_flat(value)[0] if not isinstance(value, bool | list) else math.nan for value in given]
    for key, value, number in zip(("width", "height"), given, numbers, strict=True):
        if not 1 <= number < 2**31 or number != int(number):
            sentence = f"{path}: {key} is {value!r}, expected a whole number of pixels, at least 1"
            raise InputError(sentence, code="intrinsics-invalid")
    return int(numbers[0]), int(numbers[1])


def _scale_in(keys: Mapping[str, Any], path: Path) -> float | None:
    """Return the units per metre, also from a file that has metres per unit; None if it has neither."""
    key = next((key for key in _SCALE_KEYS if key in keys), None)
    if key is None:
        return None
    value = keys[key]
    number = math.nan if isinstance(value, bool | list) else _flat(value)[0]
    if not 0 < number < math.inf:
        sentence = f"{path}: depth_scale is {value!r}, expected units per metre above zero (1000 for millimetres)"
        raise InputError(sentence, code="depth-scale-invalid")
    if number >= _MIN_UNITS_PER_M:
        return number
    return 1 / number if number <= _MAX_M_PER_UNIT else _MM_PER_M / number


def _is_distorted(keys: Mapping[str, Any]) -> bool:
    given = [keys[key] for key in _DISTORTION_KEYS if keys.get(key) is not None]
    values = [value.get("data") if isinstance(value, dict) else value for value in given]
    return any(math.isfinite(number) and number != 0 for value in values for number in _flat(value))

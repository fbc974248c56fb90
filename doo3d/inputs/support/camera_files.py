"""Read camera files: the intrinsics of one or several cameras as JSON, YAML or text, as tools and devices write them."""

import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...guard.guarding import check_not_pointer, read_bytes
from ...guard.parsing import parse_json, parse_yaml
from .calibration import NUMBER, Calibration, camera_of, cameras_in, check_pinhole

MAX_FILE_BYTES = 1 << 20  # the calibrations of all modes of a device are 50 kB; a longer file is no camera file
_TEXT_PAIR = re.compile(rf"\b(width|height|resolution [xy]|ppx|ppy|fx|fy|cx|cy)\b[\"']?\s*[:=,]?\s*({NUMBER})", re.IGNORECASE)
_COMPACT = re.compile(  # as pyrealsense2 prints intrinsics: [ 640x480  p[322.1 241.0]  f[383.3 383.3]  Brown Conrady [...] ]
    rf"(\d+)x(\d+)\s+p\[({NUMBER})\s+({NUMBER})\]\s+f\[({NUMBER})\s+({NUMBER})\]"
)
_BLOCK = re.compile(r"^\s*Intrinsic of \"?([^\"/]+)\"?.*$", re.MULTILINE)  # as rs-enumerate-devices -c prints


def read_camera_file(path: Path) -> list[Calibration]:
    """Read the cameras in a JSON, YAML or text file; each camera once, at least one.

    A camera is `fx`, `fy`, `cx`, `cy` (also `ppx`, `ppy`), or a matrix `K`, `intrinsic_matrix` or `camera_matrix`: 9 numbers,
    row by row or column by column, or 4 (fx, fy, cx, cy). This covers Open3D's file, ROS's CameraInfo and calibrations, OpenCV's
    and Kalibr's YAML, BOP's `camera.json`, ORB-SLAM's settings, and the text of RealSense's tools. A text of only 4, 9 or 16
    numbers is a camera, too. The size is `width` and `height`. A `depth_scale` above 50 means units per metre, one below 0.02
    metres per unit, one in between millimetres per unit.

    Raises
    ------
    InputError : the file cannot be read, is damaged, has no camera, or an impossible one.
    """
    data = read_bytes(path, MAX_FILE_BYTES)
    check_not_pointer(path, data)
    suffix = path.suffix.lower()
    if suffix in (".yaml", ".yml"):
        found = list(cameras_in(parse_yaml(data, str(path), ignore_tags=True), path, path.stem))
    elif suffix == ".json" or data.lstrip()[:1] == b"{":
        found = list(cameras_in(_parse_json(path, data), path, path.stem))
    else:
        found = list(_text_cameras(data.decode("utf-8-sig", "replace"), path))
    if not found:
        expected = "fx, fy, cx, cy, or a matrix called K, camera_matrix or intrinsic_matrix, in pixels of the depth images"
        raise InputError(f"{path}: holds no camera: expected {expected}, with width and height", code="intrinsics-missing")
    return list(dict.fromkeys(found))


def _parse_json(path: Path, data: bytes) -> Any:
    values = parse_json(data, str(path))
    if not isinstance(values, dict) and not (isinstance(values, list) and values and isinstance(values[0], dict | list)):
        raise InputError(f"{path}: expected a JSON object, got {type(values).__name__}", code="json-invalid")
    return {"K": values} if isinstance(values, list) and isinstance(values[0], list) else values


def _text_cameras(text: str, path: Path) -> Iterator[Calibration]:
    """Yield the cameras in the text of RealSense's tools, or in a text of numbers alone."""
    starts = [*_BLOCK.finditer(text), None]
    blocks = [
        (f"{path.stem} {start[1].strip()}", text[start.end() : following.start() if following else len(text)])
        for start, following in pairwise(starts)
        if start
    ]
    for label, block in blocks or [(path.stem, text)]:
        for width, height, cx, cy, fx, fy in _COMPACT.findall(block):
            pinhole = check_pinhole([float(v) for v in (fx, fy, cx, cy)], f"{path}: {label}")
            yield Calibration(pinhole, (int(width), int(height)), None, label, path)
        keys: dict[str, Any] = {key.lower(): float(value) for key, value in reversed(_TEXT_PAIR.findall(block))}
        if coefficients := re.search(r"coeffs\W+([-+\d.eE\s,]+)", block, re.IGNORECASE):
            keys["coeffs"] = coefficients[1].replace(",", " ").split()
        if (camera := camera_of(keys, path, label)) is not None:
            yield camera
    words = re.sub(r"#.*", "", text).replace(",", " ").replace("[", " ").replace("]", " ").split()
    if len(words) in (4, 9, 16) and all(re.fullmatch(NUMBER, word) for word in words):
        yield Calibration(check_pinhole([float(word) for word in words], f"{path}: numbers"), label=path.stem, file=path)

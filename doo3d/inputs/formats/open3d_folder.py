"""A folder as Open3D's recorder writes it: `depth/`, `color/`, `mask/` and `camera_intrinsic.json`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ...errors import InputError
from ...types import Camera, Frame
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, ReadOptions
from ..support.depth_frames import Pinhole, camera_for, check_depth_scale, read_json
from ..support.images import SUFFIXES, read_color, read_depth, read_mask
from ..support.listing import images_in, match_images, natural_key, with_file

INTRINSICS = "camera_intrinsic.json"
COLORS = ("color", "rgb", "image")  # sub-folders, the first that exists is read
DEFAULT_DEPTH_SCALE = 1000.0  # units per metre: the recorder's own, millimetres


class FolderCapture:
    """A folder as written by Open3D's recorder, opened as a capture: one frame per depth image.

    The folder has `depth/`, optionally `color/` and `mask/`, and `camera_intrinsic.json`; frames have no times and no poses.
    Images of one frame have the same file name except for the suffix; if no names agree and there are equally many images, they
    are matched by order. Frames come in natural order of their names (9 before 10).

    The options `camera` and `depth_scale` replace the values in `camera_intrinsic.json`. The file may be missing if `camera` is
    given; the depth is then in mm unless `depth_scale` is given too.
    """

    what: ClassVar[str] = (
        f"a folder with depth/ (16-bit PNG), color/ (optional), mask/ (optional) and {INTRINSICS} (width, height, "
        "intrinsic_matrix, depth_scale)"
    )
    format = "folder"

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        depth = images_in(path / "depth")
        if not depth:
            raise InputError(f"{path / 'depth'}: holds no depth images ({', '.join(SUFFIXES)})", code="folder-empty")
        camera, scale = _camera_and_scale(path / INTRINSICS, options)
        color = next((part for part in COLORS if (path / part).is_dir()), COLORS[0])
        others = {part: match_images(images_in(path / part), depth) for part in (color, "mask") if (path / part).is_dir()}
        names = sorted(set(depth).union(*others.values()), key=natural_key)
        self.frames = [
            FrameRef(
                name,
                depth.get(name, path / "depth"),
                partial(
                    _load, path, name, depth.get(name), {part: files.get(name) for part, files in others.items()}, camera, scale
                ),
            )
            for name in names
        ]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is a folder with a sub-folder `depth/` or the file `camera_intrinsic.json`."""
        return path.is_dir() and ((path / "depth").is_dir() or (path / INTRINSICS).is_file())


def _camera_and_scale(path: Path, options: ReadOptions) -> tuple[Camera | Pinhole, float]:
    """Return the camera (without image size if the options give it) and the units per metre."""
    if options.camera is not None and not path.exists():
        return options.camera, options.depth_scale or DEFAULT_DEPTH_SCALE
    camera, scale = read_intrinsics(path)
    return options.camera or camera, options.depth_scale or scale


def _load(
    folder: Path, name: str, depth: Path | None, others: Mapping[str, Path | None], camera: Camera | Pinhole, scale: float
) -> FrameData:
    for part, file in {"depth": depth, **others}.items():
        if file is None:
            raise InputError(
                f"{folder / part}: has no image for frame {name}",
                code=f"{part if part in ('depth', 'mask') else 'color'}-missing",
            )
    assert depth is not None
    mask = others.get("mask")
    color = next((file for part, file in others.items() if part in COLORS), None)
    try:
        metres = read_depth(depth, scale)
        camera = camera if isinstance(camera, Camera) else camera_for(camera, metres.shape)
        frame = Frame(read_color(color) if color else None, metres, camera, name)
    except InputError as error:
        raise with_file(error, depth) from None
    try:
        return FrameData(frame, read_mask(mask, metres.shape) if mask else None)
    except InputError as error:
        raise with_file(error, mask or depth) from None


def read_intrinsics(path: Path) -> tuple[Camera, float]:
    """Read an Open3D file of intrinsics and return (camera, depth_scale), the latter in units of the depth images per metre.

    The JSON file has width and height (px), intrinsic_matrix (nine numbers column by column), and optionally depth_scale; without
    it, depth_scale is 1000 (mm).

    Raises
    ------
    InputError : the file is missing or not JSON, or a value is missing or impossible; the message names file and key.
    """
    if not path.exists():
        raise InputError(
            f"{path}: is missing: write one with width, height and intrinsic_matrix (9 numbers, column by column: "
            "fx, 0, 0, 0, fy, 0, cx, cy, 1), in pixels of the depth images, or give --input-option 'camera=[fx, fy, cx, cy]'",
            code="intrinsics-missing",
        )
    values = read_json(path)
    for key in ("width", "height", "intrinsic_matrix"):
        if key not in values:
            raise InputError(f"{path}: has no {key}", code="intrinsics-missing")
    matrix = _matrix(path, values["intrinsic_matrix"])
    size = {key: _pixel_count(path, key, values[key]) for key in ("width", "height")}
    try:
        camera = Camera(fx=matrix[0, 0], fy=matrix[1, 1], cx=matrix[0, 2], cy=matrix[1, 2], **size)
    except InputError as error:
        raise InputError(f"{path}: {error}", code=error.code) from None
    scale = values.get("depth_scale", DEFAULT_DEPTH_SCALE)
    return camera, check_depth_scale(scale, str(path), "units per metre above zero (1000 for millimetres)")


def _matrix(path: Path, given: Any) -> Any:
    """Return [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], (3, 3) float, from nine numbers column by column or three columns."""
    try:
        values = np.array(given, dtype=float).ravel()
    except (TypeError, ValueError):
        values = np.zeros(0)
    if values.size != 9 or isinstance(given, str):
        got = len(given) if isinstance(given, list) else repr(given)
        raise InputError(
            f"{path}: intrinsic_matrix: expected 9 numbers, column by column (fx, 0, 0, 0, fy, 0, cx, cy, 1), got {got}",
            code="intrinsics-invalid",
        )
    matrix = values.reshape(3, 3).T
    if not np.isfinite(matrix).all():
        raise InputError(f"{path}: intrinsic_matrix: expected finite numbers, got {given}", code="intrinsics-invalid")
    if (matrix[2] != (0, 0, 1)).any():
        raise InputError(
            f"{path}: intrinsic_matrix is {given}: expected column by column (fx, 0, 0, 0, fy, 0, cx, cy, 1); "
            "the numbers seem to be row by row",
            code="intrinsics-invalid",
        )
    return matrix


def _pixel_count(path: Path, key: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 1 <= value < 2**31 or value != int(value):
        raise InputError(f"{path}: {key} is {value!r}, expected a whole number of pixels, at least 1", code="intrinsics-invalid")
    return int(value)

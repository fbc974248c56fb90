"""A recording of the iPhone app Stray Scanner: depth images, a color video, and the camera's path as text.

The format as its authors describe it: github.com/strayrobots/scanner, docs/format.md.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import ClassVar, NamedTuple

import cv2
import numpy as np

from ...errors import InputError
from ...types import Array, Floats, Frame
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, OF_DEPTH, ReadOptions, without_color
from ..support.calibration import Pinhole
from ..support.depth_frames import camera_for, check_unit, numbers, pinhole_of
from ..support.images import first_size, read_depth
from ..support.listing import images_in
from .trajectory import pose_from, read_lines
from .video import VideoCapture

MATRIX, ODOMETRY, VIDEO = "camera_matrix.csv", "odometry.csv", "rgb.mp4"
_SCALE = 1000.0  # units per metre
_VIDEO_SIZE = (1920, 1440)  # px, where the video is missing
_ROW = "timestamp, frame, x, y, z, qx, qy, qz, qw"


class StrayCapture:
    """A recording of the app Stray Scanner, opened as a capture: one frame per image in `depth/`.

    Color comes from the frame of the same number of `rgb.mp4`, scaled to the size of the depth image, and so do the intrinsics of
    `camera_matrix.csv`. Times and poses, camera to world, come from `odometry.csv`.
    """

    what: ClassVar[str] = f"a recording of the app Stray Scanner (depth/, {VIDEO}, {MATRIX}, {ODOMETRY})"
    format = "stray"
    options: ClassVar[frozenset[str]] = OF_DEPTH

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        depth = images_in(path / "depth")
        if not depth:
            raise InputError(f"{path / 'depth'}: holds no depth images", code="folder-empty")
        video = VideoCapture(path / VIDEO) if (path / VIDEO).is_file() and not without_color(options) else None
        pinhole = options.camera or _pinhole(path / MATRIX, first_size([*depth.values()]), _video_size(path / VIDEO))
        rows = _odometry(path / ODOMETRY) if (path / ODOMETRY).is_file() else {}
        self.notes = [] if video or without_color(options) else [f"there is no {VIDEO}, so depth is read alone"]
        self.frames = []
        for index, (name, file) in enumerate(depth.items()):
            row = rows.get(int(name) if name.isdecimal() else index, _Row())
            color = None if video is None else _color_frame(video, int(name) if name.isdecimal() else index)
            load = partial(_load, file, color, path / VIDEO if video else None, name, pinhole, options.depth_scale, row)
            self.frames.append(FrameRef(name, file, load, row.time))

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is a folder with `depth/` and `camera_matrix.csv`."""
        return (path / "depth").is_dir() and (path / MATRIX).is_file()


class _Row(NamedTuple):
    """A row of the camera's path. time : s. pose : (4, 4) camera to world, m."""

    time: float | None = None
    pose: Floats | None = None


def _odometry(path: Path) -> dict[int, _Row]:
    """Return the rows by number of the frame."""
    rows = {}
    for line, words in read_lines(path, 9, _ROW):
        if words[0] == "timestamp":
            continue
        where = f"{path}: line {line}"
        values = numbers([word.strip() for word in words[:9]], 9, f"{where}, {_ROW}", "line-invalid").tolist()
        rows[int(values[1])] = _Row(values[0], pose_from(values[5:9], values[2:5], where))
    return rows


def _pinhole(path: Path, size: tuple[int, int] | None, video: tuple[int, int]) -> Pinhole:
    """Return the intrinsics in px of the depth images; the file has them in px of the video."""
    words = [word for _, row in read_lines(path, 3, "a camera matrix, three numbers a line") for word in row]
    fx, fy, cx, cy = pinhole_of(words, str(path))
    x, y = (a / b for a, b in zip(size or video, video, strict=True))
    return fx * x, fy * y, (cx + 0.5) * x - 0.5, (cy + 0.5) * y - 0.5


def _video_size(path: Path) -> tuple[int, int]:
    if not path.is_file():
        return _VIDEO_SIZE
    video = cv2.VideoCapture(str(path))
    size = int(video.get(cv2.CAP_PROP_FRAME_WIDTH)), int(video.get(cv2.CAP_PROP_FRAME_HEIGHT))
    video.release()
    return size if min(size) > 0 else _VIDEO_SIZE


def _color_frame(video: VideoCapture, index: int) -> FrameRef | None:
    return video.frames[index] if index < len(video.frames) else None


def _load(
    file: Path, color: FrameRef | None, video: Path | None, name: str, pinhole: Pinhole, scale: float | None, row: _Row
) -> FrameData:
    if color is None and video is not None:
        raise InputError(f"{video}: has no frame for {file}", code="color-missing")
    depth = read_depth(file, scale or _SCALE, scale)
    check_unit(depth, file, scale or _SCALE)
    image = None if color is None else _scaled(color, depth.shape)
    return FrameData(Frame(image, depth, camera_for(pinhole, depth.shape), name, row.time), pose=row.pose)


def _scaled(color: FrameRef, shape: tuple[int, ...]) -> Array:
    image = color.load().data.color  # type: ignore[union-attr]
    assert image is not None
    return np.asarray(cv2.resize(image, shape[::-1], interpolation=cv2.INTER_AREA))

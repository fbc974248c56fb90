"""Folders of the Redwood data sets and of ICL-NUIM: `depth/` and colour, without a file of intrinsics.

Choi, Zhou, Koltun, *Robust Reconstruction of Indoor Scenes* (CVPR 2015), redwood-data.org/indoor/fileformat.html; Handa,
Whelan, McDonald, Davison, *A Benchmark for RGB-D Visual Odometry, 3D Reconstruction and SLAM* (ICRA 2014).
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np

from ...errors import InputError
from ...types import Floats
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, OF_DEPTH, ReadOptions, without_color
from ..support.camera_search import has_camera_file
from ..support.depth_frames import DepthSensor, ImageFiles, Pinhole, check_pose, load_files, numbers
from ..support.listing import images_in, match_images
from .open3d_folder import COLORS
from .trajectory import read_lines, read_trajectory
from .tum import DEPTH, PINHOLE, SIZE, associate

SCALE = 1000.0  # units per metre
ICL_SCALE = 5000.0
ICL_PINHOLE = (481.2, 480.0, 319.5, 239.5)  # px; the data set's fy is -480, for its y points up
_STAMPED = re.compile(r"\d+-(\d{6,})")  # file names: number of the image, microseconds
_DEFAULT_NOTE = "the camera is the data set's default, fx = fy = 525 px: give --camera FILE if the recording is of your own"
_FLIP_Y = np.diag([1.0, -1.0, 1.0, 1.0])
_ROWS_PER_POSE = 5  # in a .log file: three numbers, then a 4x4 matrix


class _ListedFrame(NamedTuple):
    """One frame. files : None if the colour is missing. number : of the depth image, from 1. time : s, from the file name."""

    files: ImageFiles | None
    name: str
    number: int
    time: float | None = None


class RedwoodCapture:
    """A folder of a Redwood data set, opened as a capture: one frame per depth image.

    Depth images are in `depth/`, colour images in the first that exists of `color/`, `rgb/` and `image/`. If the file names are
    like `0000001-000000033369` (number, time in microseconds), depth and colour are paired by time within the option `tolerance`,
    each image at most once, and images without a partner are left out. With other names, depth and colour are matched by file
    name without the suffix, else by order. Poses (camera to world) come from a trajectory `.log` if there is one. Defaults are fx
    = fy = 525, cx = 319.5, cy = 239.5 px for 640x480, and 1000 units per metre.
    """

    what: ClassVar[str] = "a folder of a Redwood data set (depth/ with image/ or rgb/, a trajectory .log)"
    format = "redwood"
    options: ClassVar[frozenset[str]] = OF_DEPTH | {"tolerance"}

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        listed = _list_frames(path, options.tolerance, without_color(options))
        log = _find_log(path)
        poses = _read_log(log) if log else {}
        sensor = _sensor(options, PINHOLE, SCALE)
        self.notes = [] if options.camera else [_DEFAULT_NOTE]
        self.frames = [_frame_ref(path, frame, sensor, poses.get(frame.number)) for frame in listed]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is a folder of a Redwood data set.

        Such a folder has `depth/` and no camera file beside it, and at least one of: a sub-folder `image/`, file names with
        times, a trajectory file.
        """
        if not _is_without_intrinsics(path):
            return False
        return (path / "image").is_dir() or _first_is_stamped(path / "depth") or _find_log(path) is not None


class IclCapture:
    """A sequence of the data set ICL-NUIM, opened as a capture: one frame per image in `depth/`.

    Colour images in `rgb/` are matched by name, poses in `*.gt.freiburg` by image number. The data set has y up in left-handed
    frames, hence its negative fy. Frames of the capture have y down, in the camera and in the world: a pose P (camera to world)
    becomes S @ P @ S with S = diag(1, -1, 1, 1).

    Defaults are fx = 481.2, fy = 480, cx = 319.5, cy = 239.5 px for 640x480, and 5000 units per metre.
    """

    what: ClassVar[str] = "a sequence of ICL-NUIM (depth/, rgb/, associations.txt, *.gt.freiburg)"
    format = "icl"
    options: ClassVar[frozenset[str]] = OF_DEPTH

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        truth = next(iter(sorted(path.glob("*.gt.freiburg"))), None)
        poses: dict[int, Floats] = {}
        if truth is not None:
            trajectory = read_trajectory(truth)
            pairs = zip(trajectory.times.tolist(), trajectory.poses, strict=True)
            poses = {round(time): _FLIP_Y @ pose @ _FLIP_Y for time, pose in pairs}
        sensor = _sensor(options, ICL_PINHOLE, ICL_SCALE)
        self.frames = [
            _frame_ref(path, frame, sensor, poses.get(int(frame.name)) if frame.name.isdecimal() else None)
            for frame in _list_frames(path, 0, without_color(options))
        ]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is a folder of an ICL-NUIM sequence.

        Such a folder has `depth/` and either `associations.txt` or a file `*.gt.freiburg`, but neither a camera file nor
        `depth.txt`.
        """
        return (
            _is_without_intrinsics(path)
            and not (path / DEPTH).is_file()
            and ((path / "associations.txt").is_file() or next(path.glob("*.gt.freiburg"), None) is not None)
        )


def _is_without_intrinsics(path: Path) -> bool:
    return (path / "depth").is_dir() and not has_camera_file(path)


def _first_is_stamped(folder: Path) -> bool:
    first = next((file for file in folder.iterdir() if not file.name.startswith(".")), None)
    return first is not None and _STAMPED.fullmatch(first.stem) is not None


def _sensor(options: ReadOptions, pinhole: Pinhole, scale: float) -> DepthSensor:
    return DepthSensor(
        options.camera or pinhole, options.depth_scale or scale, None if options.camera else SIZE, options.depth_scale
    )


def _list_frames(path: Path, tolerance: float, is_depth_alone: bool) -> list[_ListedFrame]:
    """Return a frame for each depth image, with its colour image; paired by time (`tolerance` in s) or matched by name."""
    depth = images_in(path / "depth")
    if not depth:
        raise InputError(f"{path / 'depth'}: holds no depth images", code="folder-empty")
    folder = None if is_depth_alone else next((path / name for name in COLORS if (path / name).is_dir()), None)
    color = images_in(folder) if folder else {}
    depth_times, color_times = _times(depth), _times(color)
    times = depth_times.tolist() if depth_times is not None else [None] * len(depth)
    frames = [
        _ListedFrame(ImageFiles(file), name, number, times[number - 1]) for number, (name, file) in enumerate(depth.items(), 1)
    ]
    if folder is None:
        return frames
    if depth_times is None or color_times is None or not len(color_times):
        color = match_images(color, depth)
        return [
            frame._replace(files=ImageFiles(depth[frame.name], color[frame.name]) if frame.name in color else None)
            for frame in frames
        ]
    depth_indices, color_indices = associate(depth_times, color_times, tolerance)
    if not len(depth_indices):
        raise InputError(
            f"{path}: by the times in the file names no depth and colour image are within {tolerance} s "
            "(--input-option tolerance=...)",
            code="times-apart",
        )
    images = list(color.values())
    pairs = zip(depth_indices.tolist(), color_indices.tolist(), strict=True)
    return [frames[i]._replace(files=ImageFiles(depth[frames[i].name], images[j])) for i, j in pairs]


def _times(images: dict[str, Path]) -> Floats | None:
    """Return the times (N,) s in the file names; None if the names have none or the times do not increase."""
    matches = [_STAMPED.fullmatch(name) for name in images]
    times = np.array([int(match[1]) for match in matches if match]) / 1e6
    return times if len(times) == len(images) and (np.diff(times) > 0).all() else None


def _frame_ref(path: Path, frame: _ListedFrame, sensor: DepthSensor, pose: Floats | None) -> FrameRef:
    if frame.files is None:
        return FrameRef(frame.name, path / "depth", partial(_fail_without_color, path, frame.name), frame.time)
    loader = partial(load_files, frame.files, sensor, frame.name, frame.time, pose)
    return FrameRef(frame.name, frame.files.depth, loader, frame.time)


def _fail_without_color(path: Path, name: str) -> FrameData:
    raise InputError(f"{path}: has no colour image for {path / 'depth' / name}", code="color-missing")


def _find_log(path: Path) -> Path | None:
    """Return the trajectory beside the images: a file in Redwood's layout, preferably with traj in its name; or None."""
    files = [file for file in sorted([*path.glob("*.log"), *path.glob("*traj*.txt")]) if _is_log(file)]
    named = [file for file in files if "traj" in file.name.lower()]
    return next(iter(named or files), None)


def _is_log(file: Path) -> bool:
    with file.open("rb") as opened:
        lines = opened.read(500).decode("utf-8", "replace").splitlines()
    return len(lines) > 1 and len(lines[0].split()) == 3 and len(lines[1].split()) == 4


def _read_log(log: Path) -> dict[int, Floats]:
    """Return the poses (4, 4) by number of the depth image, from 1: the third of the numbers before each matrix."""
    rows = read_lines(log, 3, "three numbers, then a 4x4 matrix")
    poses: dict[int, Floats] = {}
    for start in range(0, len(rows), _ROWS_PER_POSE):
        (line, head), *matrix = rows[start : start + _ROWS_PER_POSE]
        where = f"{log}: line {line}"
        if len(matrix) != _ROWS_PER_POSE - 1 or not head[2].isdecimal():
            raise InputError(
                f"{where}: expected three whole numbers and a 4x4 matrix below: is the file cut off?", code="line-invalid"
            )
        values = numbers([word for _, words in matrix for word in words], 16, where, "line-invalid")
        poses[int(head[2])] = check_pose(values, where)
    return poses

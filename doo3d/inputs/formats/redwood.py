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
from ..read_options import DEFAULT, ReadOptions
from ..support.depth_frames import Files, Pinhole, Sensor, check_pose, load_files, numbers
from ..support.listing import images_in, paired
from .open3d_folder import COLORS, INTRINSICS
from .trajectory import read_lines, read_trajectory
from .tum import DEPTH, PINHOLE, SIZE, associate

SCALE = 1000.0  # units per metre
ICL_SCALE = 5000.0
ICL_PINHOLE = (481.2, 480.0, 319.5, 239.5)  # px; the data set's fy is -480, for its y points up
_STAMPED = re.compile(r"\d+-(\d{6,})")  # number of the image, microseconds
_UP = np.diag([1.0, -1.0, 1.0, 1.0])  # turns y round
_LOG_ROWS = 5  # lines per pose: three numbers, then a matrix


class _Found(NamedTuple):
    """files : of one frame; None where one is missing. number : of its depth image, from 1. time : s, where names tell it."""

    files: Files | None
    name: str
    number: int
    time: float | None = None


class RedwoodCapture:
    """Frames of `depth/` and of `rgb/`, `image/` or `color/`, with the poses of a trajectory `.log` where there is one.

    Names as `0000001-000000033369` tell the number and the time in microseconds: depth and colour then belong together by
    time, each in one pair at most, and those without a partner are left out. Other names pair as in a folder of frames.
    """

    what: ClassVar[str] = "a folder of a Redwood data set (depth/ with image/ or rgb/, a trajectory .log)"
    format = "redwood"

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        found = _found(path, options.tolerance)
        log = _log(path)
        poses = _logged(log) if log else {}
        sensor = _sensor(options, PINHOLE, SCALE)
        self.frames = [_entry(path, each, sensor, poses.get(each.number)) for each in found]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Whether `path` is a folder with `depth/`, without intrinsics, and with names or a trajectory as these sets have."""
        return _bare(path) and ((path / "image").is_dir() or _first_is_stamped(path / "depth") or _log(path) is not None)


class IclCapture:
    """Frames of `depth/` and `rgb/`, paired by name; the poses are those of `*.gt.freiburg`, by the number of the image.

    The set's camera has y up, a left-handed frame, hence its negative fy. Here y points down, in the camera and in the world:
    a pose P becomes S P S with S = diag(1, -1, 1, 1).
    """

    what: ClassVar[str] = "a sequence of ICL-NUIM (depth/, rgb/, associations.txt, *.gt.freiburg)"
    format = "icl"

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        truth = next(iter(sorted(path.glob("*.gt.freiburg"))), None)
        poses: dict[int, Floats] = {}
        if truth is not None:
            found = read_trajectory(truth)
            poses = {round(time): _UP @ pose @ _UP for time, pose in zip(found.times.tolist(), found.poses, strict=True)}
        sensor = _sensor(options, ICL_PINHOLE, ICL_SCALE)
        self.frames = [
            _entry(path, each, sensor, poses.get(int(each.name)) if each.name.isdecimal() else None) for each in _found(path, 0)
        ]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Whether `path` is a folder with `depth/`, without intrinsics or lists, and with a file that only these sets have."""
        return (
            _bare(path)
            and not (path / DEPTH).is_file()
            and ((path / "associations.txt").is_file() or next(path.glob("*.gt.freiburg"), None) is not None)
        )


def _bare(path: Path) -> bool:
    return (path / "depth").is_dir() and not (path / INTRINSICS).exists()


def _first_is_stamped(folder: Path) -> bool:
    first = next((file for file in folder.iterdir() if not file.name.startswith(".")), None)
    return first is not None and _STAMPED.fullmatch(first.stem) is not None


def _sensor(options: ReadOptions, pinhole: Pinhole, scale: float) -> Sensor:
    return Sensor(options.camera or pinhole, options.depth_scale or scale, None if options.camera else SIZE)


def _found(path: Path, tolerance: float) -> list[_Found]:
    """The frames of the depth images, with the colour images that belong to them."""
    depth = images_in(path / "depth")
    if not depth:
        raise InputError(f"{path / 'depth'}: there are no depth images", code="folder-empty")
    folder = next((path / name for name in COLORS if (path / name).is_dir()), None)
    color = images_in(folder) if folder else {}
    times, others = _times(depth), _times(color)
    at = times.tolist() if times is not None else [None] * len(depth)
    found = [_Found(Files(file), name, number, at[number - 1]) for number, (name, file) in enumerate(depth.items(), 1)]
    if folder is None:
        return found
    if times is None or others is None or not len(others):
        color = paired(color, depth)
        return [each._replace(files=Files(depth[each.name], color[each.name]) if each.name in color else None) for each in found]
    one, other = associate(times, others, tolerance)
    if not len(one):
        raise InputError(
            f"{path}: by the times in their names no depth and colour image are within {tolerance} s", code="times-apart"
        )
    images = list(color.values())
    pairs = zip(one.tolist(), other.tolist(), strict=True)
    return [found[i]._replace(files=Files(depth[found[i].name], images[j])) for i, j in pairs]


def _times(images: dict[str, Path]) -> Floats | None:
    """(N,) s by the names; None where they tell no times that rise."""
    found = [_STAMPED.fullmatch(name) for name in images]
    times = np.array([int(match[1]) for match in found if match]) / 1e6
    return times if len(times) == len(images) and (np.diff(times) > 0).all() else None


def _entry(path: Path, found: _Found, sensor: Sensor, pose: Floats | None) -> FrameRef:
    files, name, _, time = found
    if files is None:
        return FrameRef(name, path / "depth", partial(_alone, path, name), time)
    return FrameRef(name, files.depth, partial(load_files, files, sensor, name, time, pose), time)


def _alone(path: Path, name: str) -> FrameData:
    raise InputError(f"{path}: there is no colour image for {path / 'depth' / name}", code="color-missing")


def _log(path: Path) -> Path | None:
    """The trajectory beside the images: a file that starts as Redwood's do; of several the one that is called so."""
    files = [file for file in sorted([*path.glob("*.log"), *path.glob("*traj*.txt")]) if _is_log(file)]
    named = [file for file in files if "traj" in file.name.lower()]
    return next(iter(named or files), None)


def _is_log(file: Path) -> bool:
    with file.open("rb") as opened:
        lines = opened.read(500).decode("utf-8", "replace").splitlines()
    return len(lines) > 1 and len(lines[0].split()) == 3 and len(lines[1].split()) == 4


def _logged(log: Path) -> dict[int, Floats]:
    """Poses by the number of the depth image, from 1, which is the third of the numbers before a matrix."""
    rows = read_lines(log, 3, "three numbers, then a 4x4 matrix")
    poses: dict[int, Floats] = {}
    for start in range(0, len(rows), _LOG_ROWS):
        (line, head), *matrix = rows[start : start + _LOG_ROWS]
        where = f"{log}: line {line}"
        if len(matrix) != _LOG_ROWS - 1 or not head[2].isdecimal():
            raise InputError(
                f"{where}: expected three whole numbers and a 4x4 matrix below: is the file cut off?", code="line-invalid"
            )
        values = numbers([word for _, words in matrix for word in words], 16, where, "line-invalid")
        poses[int(head[2])] = check_pose(values, where)
    return poses

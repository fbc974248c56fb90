"""Define the layouts of images in folders, which `formats.image_folder` reads.

Sources: Sturm et al., *A Benchmark for the Evaluation of RGB-D SLAM Systems* (IROS 2012), cvg.cit.tum.de/data/datasets/
rgbd-dataset/file_formats; Choi, Zhou, Koltun, *Robust Reconstruction of Indoor Scenes* (CVPR 2015),
redwood-data.org/indoor/fileformat.html; Handa et al., *A Benchmark for RGB-D Visual Odometry, 3D Reconstruction and SLAM* (ICRA
2014); Hodaň et al., *BOP: Benchmark for 6D Object Pose Estimation* (ECCV 2018), bop_toolkit, docs/bop_datasets_format.md.
"""

import re
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..guard.guarding import read_bytes, read_head
from ..guard.parsing import MAX_JSON_BYTES
from ..types import Floats
from .formats.image_folder import Files, Layout, Sensor
from .formats.image_with_yaml import can_read_pair, list_pairs
from .formats.trajectory import associate, read_lines, read_trajectory, sort_by_time
from .read_options import OF_DEPTH, ReadOptions, without_color
from .support.camera_search import RECORDER_FILE, has_camera_file
from .support.depth_frames import check_depth_scale, check_pose, json_object, numbers, pinhole_of, pose_of
from .support.image_folders import is_depth_file, is_depth_folder, list_frames
from .support.images import Size
from .support.known_cameras import FREIBURG, ICL_NUIM, REDWOOD, SEVEN_SCENES, TUM, VGA, KnownCamera
from .support.listing import depth_images, first_folder, images_in, match_images

_LISTED_DEPTH, _LISTED_COLOR, _TRUTH = "depth.txt", "rgb.txt", "groundtruth.txt"
_BOP_CAMERAS = "scene_camera.json"
_STAMPED = re.compile(r"\d+-(\d{6,})")  # file names: number of the image, microseconds
_SEVEN_SCENES = re.compile(r"frame-\d{6}\.depth\.png")
_FLIP_Y = np.diag([1.0, -1.0, 1.0, 1.0])
_ROWS_PER_POSE = 5  # in a .log file: three numbers, then a 4x4 matrix
_MM_PER_M = 1000.0


def _frame_pose_file(path: Path, options: ReadOptions, notes: list[str]) -> Callable[[Files], Path | None]:
    """Return a function that finds a frame's pose file: `pose/0.txt` (ScanNet) or `frame-000000.pose.txt` (7-Scenes)."""

    def file_of(files: Files) -> Path | None:
        root = files.root or path
        folder = first_folder(root, "pose", "poses") or root / "pose"
        return next((file for file in (root / f"{files.name}.pose.txt", folder / f"{files.name}.txt") if file.is_file()), None)

    return file_of


def _seven_scenes(path: Path, listed: list[Files], size: Size | None) -> KnownCamera | None:
    depth = next((files.depth for files in listed if files.depth is not None), path)
    named = size == VGA and _SEVEN_SCENES.fullmatch(depth.name) is not None
    return SEVEN_SCENES if named and depth.with_name(depth.name.replace(".depth.png", ".pose.txt")).is_file() else None


FOLDER = Layout(
    "folder",
    "a folder of depth images (16-bit PNG, float TIFF, NPY) in depth/, or named like 000_depth.png, with color images and "
    f"masks (optional), and {RECORDER_FILE} or another camera file (fx, fy, cx, cy, or K, or intrinsic_matrix; depth_scale)",
    can_read=lambda path: (path / RECORDER_FILE).is_file() or is_depth_folder(path) if path.is_dir() else is_depth_file(path),
    frames=list_frames,
    camera=_seven_scenes,
    searched=True,
    poses=_frame_pose_file,
    options=OF_DEPTH | {"color"},
)


def _list_tum(path: Path, options: ReadOptions, notes: list[str]) -> list[Files]:
    """List the frames of TUM RGB-D: depth and color images paired by time; without rgb.txt, each depth image is a frame."""

    def listed(name: str) -> tuple[Floats, list[Path]]:
        times, rows, found = sort_by_time(path / name, read_lines(path / name, 2, "time and file name"))
        notes.extend(found)
        return times, [path / " ".join(words[1:]) for _, words in rows]

    times, depth = listed(_LISTED_DEPTH)
    if not (path / _LISTED_COLOR).is_file() or without_color(options):
        return [Files(file.stem, file, time=time) for file, time in zip(depth, times.tolist(), strict=True)]
    others, color = listed(_LISTED_COLOR)
    pairs = associate(times, others, options.tolerance)
    if not pairs:
        spans = f"the times of {_LISTED_DEPTH} are {times[0]} to {times[-1]} s, of {_LISTED_COLOR} {others[0]} to {others[-1]} s"
        apart = f"no two images are within {options.tolerance} s of each other (--input-option tolerance=...)"
        raise InputError(f"{path}: {spans}: {apart}", code="times-apart")
    return [Files(depth[i].stem, depth[i], color[j], time=float(times[i])) for i, j in pairs]


def _tum_pose(path: Path, options: ReadOptions, notes: list[str]) -> Callable[[Files], Floats | None]:
    if not (path / _TRUTH).is_file():
        return lambda files: None
    truth = read_trajectory(path / _TRUTH)
    notes += truth.notes
    return lambda files: truth.at(files.time or 0.0, options.tolerance)


def _tum_camera(path: Path, listed: list[Files], size: Size | None) -> KnownCamera:
    words = path.resolve().as_posix().lower()
    return next((camera for name, camera in FREIBURG.items() if name in words), TUM)


TUM_RGBD = Layout(
    "tum",
    f"a sequence of the TUM RGB-D benchmark ({_LISTED_DEPTH}, {_LISTED_COLOR}, {_TRUTH})",
    can_read=lambda path: (path / _LISTED_DEPTH).is_file() or ((path / _LISTED_COLOR).is_file() and (path / "depth").is_dir()),
    frames=_list_tum,
    camera=_tum_camera,
    searched=True,
    registered=True,
    unit=5000.0,
    poses=_tum_pose,
    options=OF_DEPTH | {"tolerance"},
)


def _list_redwood(path: Path, options: ReadOptions, notes: list[str]) -> list[Files]:
    """List the frames of Redwood: depth and color images paired by the times in their names, else by name or order."""
    depth = depth_images(path)
    folder = None if without_color(options) else first_folder(path, "color", "rgb", "image")
    color = images_in(folder) if folder else {}
    times, others = _times_in(depth), _times_in(color)
    stamps = [None] * len(depth) if times is None else times.tolist()
    files = [Files(file.stem, file, time=stamps[i], number=i + 1) for i, file in enumerate(depth.values())]
    if folder is None:
        return files
    if times is None or others is None or not len(others):
        color, missing = match_images(color, depth), f"{path}: has no color image for {path / 'depth'}"
        return [each.with_color(color.get(each.name), f"{missing}/{each.name}") for each in files]
    images, pairs = list(color.values()), associate(times, others, options.tolerance)
    if not pairs:
        apart = f"no depth and color image are within {options.tolerance} s (--input-option tolerance=...)"
        raise InputError(f"{path}: by the times in the file names {apart}", code="times-apart")
    return [files[i]._replace(color=images[j]) for i, j in pairs]


def _times_in(images: dict[str, Path]) -> Floats | None:
    """Return the times (N,) s in the file names; None if the names have none or the times do not increase."""
    matches = [_STAMPED.fullmatch(name) for name in images]
    times = np.array([int(match[1]) for match in matches if match]) / 1e6
    return times if len(times) == len(images) and (np.diff(times) > 0).all() else None


def _find_log(path: Path) -> Path | None:
    """Return the trajectory file beside the images, in Redwood's format, preferably with traj in its name; None if missing."""
    files = [file for file in sorted([*path.glob("*.log"), *path.glob("*traj*.txt")]) if file.is_file() and _is_log(file)]
    return next(iter(sorted(files, key=lambda file: "traj" not in file.name.lower())), None)


def _is_log(file: Path) -> bool:
    lines = read_head(file, 500).decode("utf-8", "replace").splitlines()
    return [len(line.split()) for line in lines[:2]] == [3, 4]


def _redwood_pose(path: Path, options: ReadOptions, notes: list[str]) -> Callable[[Files], Floats | None]:
    """Return a function from a frame to its pose in Redwood's trajectory file.

    The third number before each matrix is the number of the depth image, from 1.
    """
    log, poses = _find_log(path), dict[int, Floats]()
    rows = read_lines(log, 3, "three numbers, then a 4x4 matrix") if log else []
    for start in range(0, len(rows), _ROWS_PER_POSE):
        (line, head), *matrix = rows[start : start + _ROWS_PER_POSE]
        where = f"{log}: line {line}"
        if len(matrix) != _ROWS_PER_POSE - 1 or not head[2].isdecimal():
            sentence = f"{where}: expected three whole numbers and a 4x4 matrix below: is the file cut off?"
            raise InputError(sentence, code="line-invalid")
        values = numbers([word for _, words in matrix for word in words], 16, where, "line-invalid")
        poses[int(head[2])] = check_pose(values, where)
    return lambda files: poses.get(files.number)


def _is_redwood(path: Path) -> bool:
    if not (path / "depth").is_dir() or has_camera_file(path):
        return False
    first = next((file for file in (path / "depth").iterdir() if not file.name.startswith(".")), path)
    return (path / "image").is_dir() or _STAMPED.fullmatch(first.stem) is not None or _find_log(path) is not None


REDWOOD_INDOOR = Layout(
    "redwood",
    "a folder of a Redwood data set (depth/ with image/ or rgb/, a trajectory .log)",
    can_read=_is_redwood,
    frames=_list_redwood,
    camera=lambda path, listed, size: REDWOOD,
    poses=_redwood_pose,
    options=OF_DEPTH | {"tolerance"},
)


def _is_icl(path: Path) -> bool:
    if not (path / "depth").is_dir() or has_camera_file(path) or (path / _LISTED_DEPTH).is_file():
        return False
    return (path / "associations.txt").is_file() or next(path.glob("*.gt.freiburg"), None) is not None


def _icl_pose(path: Path, options: ReadOptions, notes: list[str]) -> Callable[[Files], Floats | None]:
    """Return a function from a frame to its pose in ICL-NUIM's trajectory, by number of the image.

    The data set has left-handed frames with y up, hence its negative fy.
    """
    poses = dict[int, Floats]()
    for file in sorted(path.glob("*.gt.freiburg"))[:1]:
        truth = read_trajectory(file)
        pairs = zip(truth.times.tolist(), truth.poses, strict=True)
        poses = {round(time): _FLIP_Y @ pose @ _FLIP_Y for time, pose in pairs}
    return lambda files: poses.get(int(files.name)) if files.name.isdecimal() else None


ICL = Layout(
    "icl",
    "a sequence of ICL-NUIM (depth/, rgb/, associations.txt, *.gt.freiburg)",
    can_read=_is_icl,
    frames=_list_redwood,
    camera=lambda path, listed, size: ICL_NUIM,
    unit=5000.0,
    poses=_icl_pose,
)


def _list_bop(path: Path, options: ReadOptions, notes: list[str]) -> list[Files]:
    cameras, depth = json_object(read_bytes(path / _BOP_CAMERAS, MAX_JSON_BYTES), str(path / _BOP_CAMERAS)), depth_images(path)
    folder = None if without_color(options) else first_folder(path, "rgb", "gray")
    color = images_in(folder) if folder else {}
    masks = defaultdict[str, tuple[Path, ...]](tuple)
    for name, file in images_in(path / "mask_visib").items():
        masks[name.partition("_")[0]] += (file,)
    names = sorted({**depth, **color})
    frames = [Files(name, depth.get(name), color.get(name), masks[name]) for name in names]
    return [each.completed(partial(_bop_frame, path, folder, cameras, options)) for each in frames]


def _bop_frame(path: Path, folder: Path | None, cameras: dict[str, Any], options: ReadOptions, files: Files) -> Files:
    """Return a frame of BOP with its camera and its pose, camera to world, m; the file has world to camera, mm."""
    if files.depth is None:
        raise InputError(f"{path / 'depth'}: has no depth image {files.name}", code="depth-missing")
    if folder is not None and files.color is None:
        raise InputError(f"{folder}: has no image {files.name} for {files.depth}", code="color-missing")
    number = str(int(files.name)) if files.name.isdecimal() else files.name
    camera, where = cameras.get(number), f"{path / _BOP_CAMERAS}: image {number}"
    if not isinstance(camera, dict) or (options.camera is None and "cam_K" not in camera):
        remedy = "add it, or give --input-option 'camera=[fx, fy, cx, cy]'"
        raise InputError(f"{where}: is missing, or has no cam_K: {remedy}", code="intrinsics-missing")
    pinhole, scale = options.camera or pinhole_of(camera["cam_K"], f"{where}: cam_K"), options.depth_scale
    if scale is None:
        meaning = "millimetres per unit, above zero (1 for millimetres)"
        scale = _MM_PER_M / check_depth_scale(camera.get("depth_scale"), where, meaning)
    pose, given = None, (camera.get("cam_R_w2c"), camera.get("cam_t_w2c"))
    if None not in given:
        pose = np.linalg.inv(pose_of(*given, f"{where}: cam_R_w2c, cam_t_w2c"))
        pose[:3, 3] /= _MM_PER_M
    return files._replace(sensor=Sensor(KnownCamera(pinhole), scale, options.depth_scale), pose=pose)


BOP = Layout(
    "bop",
    f"a scene of the BOP benchmark ({_BOP_CAMERAS}, depth/, rgb/, mask_visib/)",
    can_read=lambda path: (path / _BOP_CAMERAS).is_file(),
    frames=_list_bop,
    partial_masks=True,
)


PAIRS = Layout(
    "pairs",
    "a depth image, or a folder of them, with <name>.yaml (camera: [fx, fy, cx, cy], depth_scale, color)",
    can_read=can_read_pair,
    frames=list_pairs,
    options=OF_DEPTH | {"color"},
)

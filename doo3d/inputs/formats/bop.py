"""A scene in the format of the BOP benchmark: `scene_camera.json` with the camera of each image.

Hodaň et al., *BOP: Benchmark for 6D Object Pose Estimation* (ECCV 2018); bop_toolkit, docs/bop_datasets_format.md.
"""

from __future__ import annotations

from collections import defaultdict
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ...errors import InputError
from ...types import Floats
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, OF_DEPTH, ReadOptions, without_color
from ..support.depth_frames import DepthSensor, ImageFiles, Pinhole, check_depth_scale, load_files, pinhole_of, pose_of, read_json
from ..support.listing import images_in

CAMERAS = "scene_camera.json"
_COLORS = ("rgb", "gray")
_MM_PER_M = 1000.0


class BopCapture:
    """A scene folder of the BOP benchmark, opened as a capture: one frame per image number, without times.

    Each image has its own intrinsics, unit of depth and pose in `scene_camera.json`. That file has poses world to camera in mm;
    the frames of the capture have poses camera to world in m. The mask is the union of the visible parts of all annotated objects
    (`mask_visib/`), or None if that union is empty or the whole image.
    """

    what: ClassVar[str] = f"a scene of the BOP benchmark ({CAMERAS}, depth/, rgb/, mask_visib/)"
    format = "bop"
    options: ClassVar[frozenset[str]] = OF_DEPTH

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        cameras = read_json(path / CAMERAS)
        depth = images_in(path / "depth")
        if not depth:
            raise InputError(f"{path / 'depth'}: holds no depth images", code="folder-empty")
        folder = None
        if not without_color(options):
            folder = next((path / name for name in _COLORS if (path / name).is_dir()), None)
        color = images_in(folder) if folder else {}
        masks = defaultdict(list)
        for name, file in images_in(path / "mask_visib").items():
            masks[name.partition("_")[0]].append(file)
        self.frames = [
            FrameRef(
                name,
                depth.get(name, path / "depth"),
                partial(
                    _load,
                    path,
                    name,
                    depth.get(name),
                    color.get(name),
                    folder,
                    tuple(masks.get(name, ())),
                    cameras.get(str(int(name))) if name.isdecimal() else None,
                    options,
                ),
            )
            for name in sorted({**depth, **color})
        ]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is a folder with the file `scene_camera.json`."""
        return (path / CAMERAS).is_file()


def _load(
    path: Path,
    name: str,
    depth: Path | None,
    color: Path | None,
    folder: Path | None,
    masks: tuple[Path, ...],
    camera: Any,
    options: ReadOptions,
) -> FrameData:
    if depth is None:
        raise InputError(f"{path / 'depth'}: has no depth image {name}", code="depth-missing")
    if folder is not None and color is None:
        raise InputError(f"{folder}: has no image {name} for {depth}", code="color-missing")
    where = f"{path / CAMERAS}: image {int(name) if name.isdecimal() else name}"
    if not isinstance(camera, dict):
        raise InputError(f"{where}: is missing or not an object, expected cam_K and depth_scale", code="intrinsics-missing")
    sensor = DepthSensor(_pinhole(camera, options, where), _scale(camera, options, where), array_scale=options.depth_scale)
    return load_files(ImageFiles(depth, color, masks), sensor, name, None, _pose(camera, where))


def _pinhole(camera: dict[str, Any], options: ReadOptions, where: str) -> Pinhole:
    if options.camera is not None:
        return options.camera
    if "cam_K" not in camera:
        raise InputError(
            f"{where}: has no cam_K: add it, or give --input-option 'camera=[fx, fy, cx, cy]'", code="intrinsics-missing"
        )
    return pinhole_of(camera["cam_K"], f"{where}: cam_K")


def _scale(camera: dict[str, Any], options: ReadOptions, where: str) -> float:
    """Return the units per metre; the file has millimetres per unit."""
    if options.depth_scale is not None:
        return options.depth_scale
    scale = camera.get("depth_scale")
    return _MM_PER_M / check_depth_scale(scale, where, "millimetres per unit, above zero (1 for millimetres)")


def _pose(camera: dict[str, Any], where: str) -> Floats | None:
    """Return the pose (4, 4) camera to world, m; the file has world to camera, mm."""
    if camera.get("cam_R_w2c") is None or camera.get("cam_t_w2c") is None:
        return None
    world_to_camera = pose_of(camera["cam_R_w2c"], camera["cam_t_w2c"], f"{where}: cam_R_w2c, cam_t_w2c")
    pose = np.eye(4)
    pose[:3, :3] = world_to_camera[:3, :3].T
    pose[:3, 3] = -world_to_camera[:3, :3].T @ world_to_camera[:3, 3] / _MM_PER_M
    return pose

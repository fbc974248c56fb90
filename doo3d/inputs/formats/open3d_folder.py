"""A folder of depth images, with color images and masks, in the layouts of recorders and of users' own scripts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import ClassVar

from ...errors import InputError
from ...types import Camera, Frame
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, OF_DEPTH, ReadOptions
from ..support.calibration import Pinhole
from ..support.camera_choice import REMEDY
from ..support.camera_files import read_camera_file
from ..support.camera_search import RECORDER_FILE, find_camera
from ..support.color_registration import ColorCamera, find_color_camera, sizes_differ
from ..support.default_cameras import default_camera
from ..support.depth_frames import camera_for, check_unit
from ..support.frame_poses import find_frame_poses, read_frame_pose
from ..support.image_folders import FrameFiles, color_folder, is_depth_file, is_depth_folder, list_frames, with_color
from ..support.images import first_size, read_color, read_depth, read_mask
from ..support.listing import with_file

COLORS = ("color", "rgb", "image")  # sub-folders, the first that exists is read
DEFAULT_DEPTH_SCALE = 1000.0  # units per metre: the recorder's own, millimetres


class FolderCapture:
    """A folder of depth images, opened as a capture: one frame per depth image, without times.

    The images are in sub-folders (`depth/` with `color/` and `mask/`, `depth_images/` with `color_images/`, ...), or side by
    side (`000_depth.png` with `000_color.png`, `depth.png` with `color.png`, ...); see `support.image_folders`. A single depth
    image is a capture of one frame. Frames come in natural order of their names (9 before 10).

    Poses, camera to world, are read from files of one frame each, as ScanNet's exporter and 7-Scenes have them. Color images of
    another size than the depth are aligned if both cameras and their positions are known.

    The camera is read from `camera_intrinsic.json` (Open3D's recorder) or another camera file beside the images that fits their
    size; see `support.camera_search`. The options `camera` and `depth_scale` replace the values of the file, which may be missing
    if `camera` is given; the depth is then in mm unless `depth_scale` is given too.
    """

    what: ClassVar[str] = (
        "a folder of depth images (16-bit PNG, float TIFF, NPY) in depth/, or named like 000_depth.png, with color images and "
        f"masks (optional), and {RECORDER_FILE} or another camera file (fx, fy, cx, cy, or K, or intrinsic_matrix; depth_scale)"
    )
    format = "folder"
    options: ClassVar[frozenset[str]] = OF_DEPTH | {"color"}

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        frames, notes = list_frames(path)
        if options.color is not None:
            frames = with_color(frames, options.color)
        root = path if path.is_dir() else frames[0].folder
        sensor, camera_notes, self.extra_files = _sensor(root, frames, options)
        self.notes = [*notes, *camera_notes]
        poses = find_frame_poses(root, [frame.name for frame in frames])
        self.frames = [
            FrameRef(frame.name, frame.depth or frame.folder, partial(_load, frame, sensor, poses.get(frame.name)))
            for frame in frames
        ]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is a depth image, or a folder with depth images in it or in a sub-folder such as `depth/`.

        A folder with the file `camera_intrinsic.json` counts, too.
        """
        return (path / RECORDER_FILE).is_file() or is_depth_folder(path) if path.is_dir() else is_depth_file(path)


@dataclass(frozen=True)
class _Sensor:
    """The camera of the depth images, without image size if none is known; units per metre; the camera of other color images."""

    camera: Camera | Pinhole
    scale: float
    array_scale: float | None
    color: ColorCamera | None = None


def _sensor(root: Path, frames: list[FrameFiles], options: ReadOptions) -> tuple[_Sensor, list[str], list[Path]]:
    """Return the sensor, notes, and the files that were read."""
    depth = [frame.depth for frame in frames if frame.depth is not None]
    size = first_size(depth)
    color = first_size([file for frame in frames if (file := frame.others.get("color")) is not None])
    is_registered = color is not None and color in (size, None)
    parent = root.parent if depth and depth[0].parent == root else None
    found = None
    if options.camera is None or options.depth_scale is None or (color and not is_registered):
        try:
            found = find_camera(root, size, is_registered, depth[0].parent if depth else None, parent)
        except InputError:
            if options.camera is None:
                raise
    notes, files = (found.notes, [found.camera.file]) if found else ([], [])
    scale = options.depth_scale or (found and found.camera.scale) or DEFAULT_DEPTH_SCALE
    camera: Camera | Pinhole
    if options.camera is not None:
        camera, notes = options.camera, []
    elif found is not None:
        camera = Camera(*found.camera.pinhole, *found.camera.size) if found.camera.size else found.camera.pinhole
    elif (default := default_camera(depth, size)) is not None:
        camera, notes = default.pinhole, [default.note]
    else:
        raise _no_camera(root, len(depth))
    color_camera = None
    if color is not None and size is not None and not is_registered:
        color_camera = find_color_camera(root, found.others if found else [], color)
        if color_camera is None:
            raise sizes_differ(root, color, size)
        notes = [*notes, f"the color images ({color[0]}x{color[1]} px) are aligned to the depth images ({size[0]}x{size[1]})"]
    return _Sensor(camera, scale, options.depth_scale, color_camera), notes, files


def _no_camera(root: Path, count: int) -> InputError:
    return InputError(
        f"{root / RECORDER_FILE}: is missing, and so is any other file with the camera of these {count} depth images: "
        f"{REMEDY}, or write this file with width, height and intrinsic_matrix ([fx, 0, 0, 0, fy, 0, cx, cy, 1]), in "
        "pixels of the depth images; if they are photographs, use -c image",
        code="intrinsics-missing",
    )


def _load(frame: FrameFiles, sensor: _Sensor, pose: Path | None) -> FrameData:
    for part, file in {"depth": frame.depth, **frame.others}.items():
        if file is None:
            place = color_folder(frame.folder) if part == "color" else frame.folder / part
            raise InputError(f"{place}: has no image for frame {frame.name}", code=f"{part}-missing")
    depth = frame.depth
    assert depth is not None
    mask, color = frame.others.get("mask"), frame.others.get("color")
    try:
        metres = read_depth(depth, sensor.scale, sensor.array_scale)
        check_unit(metres, depth, sensor.scale)
        camera = sensor.camera if isinstance(sensor.camera, Camera) else camera_for(sensor.camera, metres.shape)
        image = read_color(color) if color else None
        if image is not None and sensor.color is not None:
            image = sensor.color.align(image, metres, camera)
        data = Frame(image, metres, camera, frame.name)
    except InputError as error:
        raise with_file(error, depth) from None
    try:
        return FrameData(data, read_mask(mask, metres.shape) if mask else None, read_frame_pose(pose) if pose else None)
    except InputError as error:
        raise with_file(error, mask or depth) from None


def read_intrinsics(path: Path) -> tuple[Camera, float]:
    """Read a camera file with an image size and return (camera, depth_scale), the latter in units of the depth images per metre.

    Without a depth_scale in the file, it is 1000 (mm).

    Raises
    ------
    InputError : the file is missing or not JSON, or a value is missing or impossible; the message names file and key.
    """
    found = read_camera_file(path)[0]
    if found.size is None:
        raise InputError(f"{path}: has no width and height", code="intrinsics-missing")
    return Camera(*found.pinhole, *found.size), found.scale or DEFAULT_DEPTH_SCALE

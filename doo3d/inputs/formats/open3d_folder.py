"""A folder of depth images, with color images and masks, in the layouts of recorders and of users' own scripts."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import ClassVar

from ...errors import InputError
from ...types import Camera, Frame
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, ReadOptions
from ..support.calibration import Pinhole
from ..support.camera_choice import (
    RECORDER_FILE,
    REMEDY,
    cameras_beside,
    choose_camera,
    depth_size,
    describe_camera,
    search_folders,
)
from ..support.camera_files import read_camera_file
from ..support.depth_frames import camera_for, check_unit
from ..support.image_folders import FrameFiles, color_folder, is_depth_file, is_depth_folder, list_frames
from ..support.images import read_color, read_depth, read_mask
from ..support.listing import with_file

COLORS = ("color", "rgb", "image")  # sub-folders, the first that exists is read
DEFAULT_DEPTH_SCALE = 1000.0  # units per metre: the recorder's own, millimetres


class FolderCapture:
    """A folder of depth images, opened as a capture: one frame per depth image, without times and poses.

    The images are in sub-folders (`depth/` with `color/` and `mask/`, `depth_images/` with `color_images/`, ...), or side by
    side (`000_depth.png` with `000_color.png`, `depth.png` with `color.png`, ...); see `support.image_folders`. A single depth
    image is a capture of one frame. Frames come in natural order of their names (9 before 10).

    The camera is read from `camera_intrinsic.json` (Open3D's recorder) or another camera file beside the images; see
    `support.camera_files`. The options `camera` and `depth_scale` replace the values of the file, which may be missing if
    `camera` is given; the depth is then in mm unless `depth_scale` is given too.
    """

    what: ClassVar[str] = (
        "a folder of depth images (16-bit PNG, float TIFF, NPY) in depth/, or named like 000_depth.png, with color images and "
        f"masks (optional), and {RECORDER_FILE} or another camera file (fx, fy, cx, cy, or K, or intrinsic_matrix; depth_scale)"
    )
    format = "folder"

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        frames, notes = list_frames(path)
        root = path if path.is_dir() else path.parent
        camera, scale, camera_notes, self.extra_files = _camera_and_scale(root, frames, options)
        self.notes = [*notes, *camera_notes]
        self.frames = [
            FrameRef(
                frame.name,
                frame.depth or frame.folder,
                partial(_load, frame.folder, frame.name, frame.depth, frame.others, camera, scale, options.depth_scale),
            )
            for frame in frames
        ]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is a depth image, or a folder with depth images in it or in a sub-folder such as `depth/`.

        A folder with the file `camera_intrinsic.json` counts, too.
        """
        return (path / RECORDER_FILE).is_file() or is_depth_folder(path) if path.is_dir() else is_depth_file(path)


def _camera_and_scale(
    root: Path, frames: list[FrameFiles], options: ReadOptions
) -> tuple[Camera | Pinhole, float, list[str], list[Path]]:
    """Return the camera (without image size if none is known), the units per metre, notes, and the files that were read."""
    if options.camera is not None and options.depth_scale is not None:
        return options.camera, options.depth_scale, [], []
    depth = [frame.depth for frame in frames if frame.depth is not None]
    folders = dict.fromkeys([root, *(file.parent for file in depth[:1])])
    searched = [folder for base in folders for folder in search_folders(base)]
    found = cameras_beside(searched, root.parent if depth and depth[0].parent == root else None)
    if not found:
        if options.camera is not None:
            return options.camera, options.depth_scale or DEFAULT_DEPTH_SCALE, [], []
        raise InputError(
            f"{root / RECORDER_FILE}: is missing, and so is any other file with the camera of these {len(depth)} depth images: "
            f"{REMEDY}, or write this file with width, height and intrinsic_matrix ([fx, 0, 0, 0, fy, 0, cx, cy, 1]), in "
            "pixels of the depth images; if they are photographs, use -c image",
            code="intrinsics-missing",
        )

    aligned = any(frame.others.get("color") for frame in frames)
    chosen, note = choose_camera(found, partial(depth_size, depth[0]), aligned)
    scale = options.depth_scale or chosen.scale or DEFAULT_DEPTH_SCALE
    if options.camera is not None:
        return options.camera, scale, [], [chosen.file]
    notes = [note] * bool(note) + describe_camera(chosen)
    if chosen.file.name != RECORDER_FILE:
        notes.append(
            f"the camera is read from {chosen.file.relative_to(root) if chosen.file.is_relative_to(root) else chosen.file}"
        )
    if chosen.size is None:
        return chosen.pinhole, scale, notes, [chosen.file]
    return Camera(*chosen.pinhole, *chosen.size), scale, notes, [chosen.file]


def _load(
    folder: Path,
    name: str,
    depth: Path | None,
    others: Mapping[str, Path | None],
    camera: Camera | Pinhole,
    scale: float,
    array_scale: float | None,
) -> FrameData:
    for part, file in {"depth": depth, **others}.items():
        if file is None:
            place = color_folder(folder) if part == "color" else folder / part
            raise InputError(f"{place}: has no image for frame {name}", code=f"{part}-missing")
    assert depth is not None
    mask, color = others.get("mask"), others.get("color")
    try:
        metres = read_depth(depth, scale, array_scale)
        check_unit(metres, depth, scale)
        camera = camera if isinstance(camera, Camera) else camera_for(camera, metres.shape)
        frame = Frame(read_color(color) if color else None, metres, camera, name)
    except InputError as error:
        raise with_file(error, depth) from None
    try:
        return FrameData(frame, read_mask(mask, metres.shape) if mask else None)
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

"""Read all formats that are folders of images; each is a Layout, as in `inputs.layouts`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from ...errors import InputError
from ...guard.guarding import prefixed
from ...types import Array, Bools, Floats, Frame, Image
from ...types.arrays import fit_mask
from ..capture import Capture, FrameData, FrameRef
from ..read_options import DEFAULT, OF_DEPTH, ReadOptions
from ..support.camera_search import RECORDER_FILE, REMEDY, find_camera
from ..support.color_registration import ColorCamera, find_color_camera, sizes_differ
from ..support.depth_frames import camera_for, check_unit, depth_of_distance, read_frame_pose
from ..support.images import Size, first_size, read_color, read_depth, read_mask
from ..support.known_cameras import KnownCamera
from ..support.listing import RAY_DISTANCE, is_distance

DEFAULT_DEPTH_SCALE = 1000.0  # units per metre: millimetres


class Sensor(NamedTuple):
    """Intrinsics and unit of depth images whose size becomes known only when they are read.

    Attributes
    ----------
    camera
        the intrinsics, and the required size of the image if it is known.
    scale
        units of the depth image per metre, such as 1000 for millimetres.
    array_scale
        units per metre of depth images of floats; None: metres.
    color
        the camera of color images of another size; None if their pixels are those of the depth image.
    """

    camera: KnownCamera
    scale: float
    array_scale: float | None = None
    color: ColorCamera | None = None


class Files(NamedTuple):
    """The files and further data of one frame, as listed by its layout.

    Attributes
    ----------
    name
        name of the frame.
    depth
        depth image; None for a photograph.
    color
        color image, or frame of a video; None if there is none.
    masks
        mask images; the object is where any of them is above zero.
    time
        time of the frame, s; None if unknown.
    pose
        (4, 4) camera to world, m, or the file with it; None if unknown.
    sensor
        camera and unit of this frame; None for those of the capture.
    fault
        sentence and code of the error that loading raises; None if nothing is missing.
    number
        number of the frame in the layout's files of poses.
    root
        folder of the capture, if its path is a file.
    source
        a further file that was read for this frame.
    """

    name: str
    depth: Path | None = None
    color: Path | FrameRef | None = None
    masks: tuple[Path, ...] = ()
    time: float | None = None
    pose: Floats | Path | None = None
    sensor: Sensor | None = None
    fault: tuple[str, str] | None = None
    number: int = -1
    root: Path | None = None
    source: Path | None = None

    def with_color(self, color: Path | FrameRef | None, missing: str) -> Files:
        """Return the frame with a color image; if `color` is None, with the fault `missing`."""
        return self._replace(color=color, fault=None if color is not None else (missing, "color-missing"))

    def completed(self, complete: Callable[[Files], Files]) -> Files:
        """Return the frame completed by a function; an InputError of the function becomes its fault."""
        try:
            return complete(self)
        except InputError as error:
            return self._replace(fault=(str(error), error.code))


@dataclass(frozen=True)
class Layout:
    """A format of images in folders; calling it opens a capture.

    Attributes
    ----------
    format, what
        name and short description of the format.
    can_read
        function that returns whether an existing file or folder has this layout.
    frames
        function of path, options and a list to which it adds notes; returns the files of each frame, in order.
    camera
        function of path, frames and size of the depth images; returns the camera if no file beside the images has one. None if
        the format has no such camera.
    searched
        whether to search the camera in files beside the images.
    registered
        whether depth images have the pixels of the color camera even if there are no color images.
    unit
        units of the depth images per metre.
    poses
        function of path, options and a list to which it adds notes; returns a function from a frame to its pose. By default,
        `Files` has the pose.
    partial_masks
        whether masks belong to single objects, so that an empty or full union counts as no mask.
    upright
        function of the path that returns whether photographs are rotated by EXIF.
    options
        names of the reading options that the format supports.
    """

    format: str
    what: str
    can_read: Callable[[Path], bool]
    frames: Callable[[Path, ReadOptions, list[str]], list[Files]]
    camera: Callable[[Path, list[Files], Size | None], KnownCamera | None] | None = None
    searched: bool = False
    registered: bool = False
    unit: float = DEFAULT_DEPTH_SCALE
    poses: Callable[[Path, ReadOptions, list[str]], Callable[[Files], Floats | Path | None]] = lambda path, options, notes: (
        lambda files: files.pose
    )
    partial_masks: bool = False
    upright: Callable[[Path], bool] = lambda path: False
    options: frozenset[str] = OF_DEPTH

    def __call__(self, path: Path, options: ReadOptions = DEFAULT) -> Capture:
        """Open the capture at `path`."""
        notes: list[str] = []
        listed = self.frames(path, options, notes)
        pose_of = self.poses(path, options, notes)
        sensor, extra_files = None, list[Path]()
        if self.camera is not None or self.searched:
            sensor, extra_files = self._sensor(path, listed, options, notes)
        if any(files.depth is not None and is_distance(files.depth) for files in listed):
            notes.append(f"the distances from the camera ({RAY_DISTANCE}) are converted to depth along the optical axis")
        upright = self.upright(path)
        frames = [
            FrameRef(
                files.name,
                files.depth or (files.color if isinstance(files.color, Path) else path),
                partial(_load, files._replace(pose=pose_of(files)), files.sensor or sensor, not self.partial_masks, upright),
                files.time,
            )
            for files in listed
        ]
        return Capture(path, self.format, frames, notes, extra_files=extra_files)

    def _sensor(self, path: Path, listed: list[Files], options: ReadOptions, notes: list[str]) -> tuple[Sensor, list[Path]]:
        """Return the camera and the unit of all depth images, and the files that were read for them."""
        depth = [files.depth for files in listed if files.depth is not None]
        root, folder = listed[0].root or path, depth[0].parent if depth else path
        size = first_size(depth)
        color = first_size([files.color for files in listed if isinstance(files.color, Path)]) if self.searched else None
        is_registered, found = color in (size, None), None
        if self.searched and (options.camera is None or options.depth_scale is None or not is_registered):
            try:
                aligned = is_registered and (color is not None or self.registered)
                found = find_camera(root, size, aligned, folder, root.parent if folder == root else None)
            except InputError:
                if options.camera is None:
                    raise
        if options.camera is not None:
            camera = KnownCamera(options.camera)
        elif found is not None:
            camera = KnownCamera(found.camera.pinhole, found.camera.size)
            notes += found.notes
        elif self.camera is not None and (known := self.camera(root, listed, size)) is not None:
            camera, unit = known, "" if options.depth_scale else f", and the unit {self.unit:g} per metre"
            notes += [known.note.format(unit=unit)] if known.note else []
        else:
            raise _no_camera(root, len(depth))
        scale = options.depth_scale or (found and found.camera.scale) or self.unit
        other = None
        if not is_registered and color is not None and size is not None and camera.size in (None, size):
            other = find_color_camera(root, found.others if found else [], color)
            if other is None:
                raise sizes_differ(root, color, size)
            notes.append(f"the color images ({color[0]}x{color[1]} px) are aligned to the depth images ({size[0]}x{size[1]})")
        return Sensor(camera, scale, options.depth_scale, other), [found.camera.file] if found else []


def _no_camera(root: Path, count: int) -> InputError:
    return InputError(
        f"{root / RECORDER_FILE}: is missing, and so is any other file with the camera of these {count} depth images: "
        f"{REMEDY}, or write this file with width, height and intrinsic_matrix ([fx, 0, 0, 0, fy, 0, cx, cy, 1]), in "
        "pixels of the depth images; if they are photographs, use -c image",
        code="intrinsics-missing",
    )


def _load(files: Files, sensor: Sensor | None, keep_mask: bool, upright: bool) -> FrameData:
    if files.fault is not None:
        raise InputError(files.fault[0], code=files.fault[1])
    if sensor is None or files.depth is None:
        assert isinstance(files.color, Path)
        image = Image(read_color(files.color, upright), files.name)
        return FrameData(image, read_mask(files.masks[0], image.color.shape[:2], upright) if files.masks else None)
    with prefixed(str(files.depth), files.depth.parent.parent):  # the folder of the capture
        depth = read_depth(files.depth, sensor.scale, sensor.array_scale)
        has_floats = sensor.array_scale is None and files.depth.suffix.lower() != ".png"
        check_unit(depth, files.depth, None if has_floats else sensor.scale)
        camera = camera_for(sensor.camera.pinhole, depth.shape, sensor.camera.size)
        depth = depth_of_distance(depth, camera) if is_distance(files.depth) else depth
        color = None if files.color is None else _color(files.color, depth.shape)
        if color is not None and sensor.color is not None:
            color = sensor.color.align(color, depth, camera)
        frame = Frame(color, depth, camera, files.name, files.time)
    masks = [read_mask(mask, depth.shape) for mask in files.masks]
    mask: Bools | None = np.any([fit_mask(each, masks[0].shape)[0] for each in masks], axis=0) if masks else None
    if mask is not None and not keep_mask and mask.all() == mask.any():
        mask = None
    return FrameData(frame, mask, read_frame_pose(files.pose) if isinstance(files.pose, Path) else files.pose)


def _color(color: Path | FrameRef, shape: tuple[int, ...]) -> Array:
    """Return a color image; a frame of a video is scaled to the size of the depth image."""
    if isinstance(color, Path):
        return read_color(color)
    data = color.load().data
    assert isinstance(data, Image)
    return np.asarray(cv2.resize(data.color, shape[::-1], interpolation=cv2.INTER_AREA))

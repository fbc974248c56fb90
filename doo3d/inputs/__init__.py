"""Readers of captures: one file per format; the format is detected from content, not from the file name alone.

To add a format, write a file with one class like `FolderCapture` and give it a line in `FORMATS`; the order of the lines is
the order in which formats are tried. A program of your own adds its class at run time: `FORMATS["mine"] = MyCapture`.
"""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np

from ..errors import InputError, unread_code
from .base_pose import BasePoseCapture
from .capture import Capture, CaptureFormat, FrameData, FrameRef
from .external_masks import MaskedCapture
from .formats.trajectory import PosedCapture
from .read_options import DEFAULT, ReadOptions
from .support.images import is_image
from .support.pose_file import TF, pose_file_beside, read_pose

__all__ = ["FORMATS", "IMAGE_FORMATS", "Capture", "FrameData", "FrameRef", "ReadOptions", "format_class", "open_capture"]

FORMATS: dict[str, str | CaptureFormat] = {
    "bag": "bag.reader:BagCapture",
    "tum": "formats.tum:TumCapture",
    "bop": "formats.bop:BopCapture",
    "icl": "formats.redwood:IclCapture",
    "redwood": "formats.redwood:RedwoodCapture",
    "record3d": "formats.record3d:Record3DCapture",
    "arrays": "formats.npz:ArraysCapture",
    "folder": "formats.open3d_folder:FolderCapture",
    "pairs": "formats.depth_yaml:PairsCapture",
    "cloud": "formats.cloud:CloudCapture",
    "photos": "formats.photos:PhotosCapture",
    "video": "formats.video:VideoCapture",
}
IMAGE_FORMATS = ("photos", "video")  # formats whose frames are images without depth, for the 2-D mode
_MAX_LISTED = 5  # captures that an error lists by name


def format_class(name: str) -> CaptureFormat:
    """Return the class that reads the format `name`, a key of `FORMATS` such as "bag" or "tum".

    The class's module is imported at the first request. KeyError for an unknown name.
    """
    registered = FORMATS[name]
    if not isinstance(registered, str):
        return registered
    module, _, member = registered.partition(":")
    loaded: CaptureFormat = getattr(importlib.import_module(f".{module}", __name__), member)
    return loaded


def open_capture(
    path: str | Path, images_only: bool = False, masks: str | Path | None = None, options: ReadOptions = DEFAULT
) -> Capture:
    """Open a recording, a cloud or an image as a sequence of frames.

    Opening lists the frames and reads what they share (times, intrinsics). `capture.frames[i].load()` reads one frame's data and
    returns a FrameData: `data` (Frame, Cloud or Image), `mask` (bool or None) and `pose` (camera to world, or None).

    Parameters
    ----------
    path
        a folder or a file in any format of `FORMATS`, detected from content: a bag (ROS 1, ROS 2 or RealSense's SDK), TUM
        RGB-D, BOP, ICL-NUIM, Redwood, Record3D, an NPZ of arrays, a folder with depth/ and color/, a depth image with a YAML
        file, clouds (PLY, PCD, XYZ, NPZ, LAS, LAZ, E57), photographs, a video.
    images_only
        if a folder has both depth and color images, open its color images alone, as Image: for a config with `mode: 2d`.
    masks
        masks to use instead of the capture's own: a folder of images named like the frames, or one image for a capture of one
        frame. Pixels above zero are the object. None: the capture's own masks, if it has any.
    options
        values that the capture lacks or has wrong: topics, `camera` (fx, fy, cx, cy in px), `depth_scale` (units per metre),
        values that the capture lacks or has wrong: topics, `camera` (fx, fy, cx, cy in px), `depth_scale` (units per metre),
        `tolerance` (s), `color`, `trajectory` (a file of camera poses), `pose` (of the camera in a robot's base frame; by default
        that in a file pose.yaml or pose.json beside the images). A value given here replaces the capture's.

    Returns
    -------
    Capture : `frames` (a sequence of FrameRef in recording order), `format` (a key of `FORMATS`) and `path`.

    Raises
    ------
    InputError : `path` does not exist, its format is unknown, or something that all frames need is missing or damaged.
        A frame that is damaged alone raises InputError from its `load`.
    MissingDependency : the format needs a package that is not installed; the message has the pip command.

    Examples
    --------
    >>> capture = doo3d.open_capture("sample_clouds/crossing", options=ReadOptions(depth_scale=1000))
    >>> for frame in capture.frames:
    ...     loaded = frame.load()
    ...     detection = doo3d.detect(loaded.data, mask=loaded.mask)
    """
    path = Path(path)
    try:
        if not path.exists():
            raise InputError(f"{path} does not exist", code="file-missing")
        for name in sorted(FORMATS, key=lambda name: images_only and name not in IMAGE_FORMATS):
            reader = format_class(name)
            if reader.can_read(path) or (name == "pairs" and _is_depth_by_options(path, options)):
                capture = reader(path, options)
                if options.trajectory is not None:
                    capture = PosedCapture(capture, options.trajectory, options.tolerance)
                if masks is not None:
                    capture = MaskedCapture(capture, Path(masks))
                return capture if images_only else _in_base_frame(capture, options)
        raise _unknown_format(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})", code=unread_code(error)) from None


def _in_base_frame(capture: Capture, options: ReadOptions) -> Capture:
    """Return the capture with the camera's pose in the robot's base frame, if one is given or lies beside the images."""
    if options.pose is None:
        file = pose_file_beside(capture.path)
        return capture if file is None else BasePoseCapture(capture, read_pose(file), str(file))
    if not isinstance(options.pose, str):
        return BasePoseCapture(capture, np.array(options.pose), "POSE")
    if options.pose.startswith(TF) and capture.format != "bag":
        raise InputError(
            f"pose={options.pose}: names a frame of a bag's tf, and {capture.path} is no bag: give a file or x,y,z,qx,qy,qz,qw",
            code="pose-invalid",
        )
    return BasePoseCapture(capture, None, options.pose)


def _is_depth_by_options(path: Path, options: ReadOptions) -> bool:
    """Return whether `path` is an image that the options make a depth image, by giving its camera."""
    return options.camera is not None and path.is_file() and is_image(path)


def _unknown_format(path: Path) -> InputError:
    """Return the error for a path that no format can read."""
    formats = f"Formats that can be read: {'; '.join(format_class(name).what for name in FORMATS)}"
    if path.is_file():
        return InputError(
            f"{path}: the format of this file is unknown (a depth image alone is not enough, its camera has to be given). "
            f"{formats}",
            code="format-unknown",
        )
    inside = sorted(path.iterdir())
    if not inside:
        return InputError(f"{path}: this folder is empty. {formats}", code="folder-empty")
    captures = [item.name for item in inside if any(format_class(name).can_read(item) for name in FORMATS)]
    if not captures:
        return InputError(f"{path}: this folder holds nothing in a known format. {formats}", code="format-unknown")
    more = len(captures) - _MAX_LISTED
    listed = ", ".join(captures[:_MAX_LISTED]) + (f" and {more} more" if more > 0 else "")
    return InputError(
        f"{path}: this folder is not a capture but holds {len(captures)} captures, give one of these: {listed}",
        code="folder-of-captures",
    )

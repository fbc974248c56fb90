"""Read captures; the format is detected from the content, not from the file name alone.

To add a format, write a file with one class like `VideoCapture`, or a Layout as in `layouts`, and a line in `FORMATS`; the
order of the lines is the order in which formats are tried. A program of your own adds its class at run time:
`FORMATS["mine"] = MyCapture`; such formats are tried first.
"""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ConfigError, InputError
from ..guard.guarding import check_not_pointer, guarded, read_head
from ..guard.limits import DEFAULT as DEFAULT_LIMITS
from ..guard.limits import Limits, limited
from ..plugins import READERS, Registry
from ..types import Frame
from ..types.arguments import file_path, flag, refused
from .capture import Capture, CaptureFormat, FrameData, FrameRef
from .external_data import in_base_frame, with_masks, with_trajectory
from .read_options import DEFAULT, ReadOptions, check_used, intrinsics_of
from .support.calibration import Calibration
from .support.camera_files import read_camera_file
from .support.camera_search import check_size, choose_camera, describe_camera
from .support.images import is_image
from .support.listing import is_depth_content
from .support.pose_file import TF, pose_file_beside, read_pose
from .unknown_format import unknown_format

__all__ = ["FORMATS", "IMAGE_FORMATS", "Capture", "FrameData", "FrameRef", "ReadOptions", "format_class", "open_capture"]

FORMATS: Registry[CaptureFormat] = Registry(
    READERS,
    {
        "bag": "bag.reader:BagCapture",
        "tum": "layouts:TUM_RGBD",
        "bop": "layouts:BOP",
        "stray": "formats.stray_scanner:STRAY",
        "icl": "layouts:ICL",
        "redwood": "layouts:REDWOOD_INDOOR",
        "record3d": "formats.record3d:Record3DCapture",
        "arrays": "formats.npz:ArraysCapture",
        "pairs": "layouts:PAIRS",
        "lerobot": "formats.lerobot:LeRobotCapture",
        "folder": "layouts:FOLDER",
        "cloud": "formats.cloud:CloudCapture",
        "photos": "formats.photos:PHOTOS",
        "video": "formats.video:VideoCapture",
    },
    __name__,
    lambda entry: None if callable(entry) and callable(getattr(entry, "can_read", None)) else "is no class with can_read",
)
IMAGE_FORMATS = ("photos", "video")  # formats whose frames are images without depth, for the 2-D mode
_HEAD_BYTES = 64  # of a file, read to recognize what is no capture at all


def format_class(name: str) -> CaptureFormat:
    """Return the class that reads the format `name`, a key of `FORMATS` such as "bag" or "tum".

    The module of the class is imported at the first request. Raises KeyError for an unknown name, ConfigError for a broken
    plug-in.
    """
    return FORMATS[name]


def open_capture(
    path: str | Path,
    images_only: bool = False,
    masks: str | Path | None = None,
    options: ReadOptions = DEFAULT,
    camera: str | Path | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Capture:
    """Open a recording, a cloud or an image as a sequence of frames.

    Opening lists the frames and reads what they share (times, intrinsics). `capture[i].load()` reads one frame's data and
    returns a FrameData: `data` (Frame, Cloud or Image), `mask` (bool or None) and `pose` (camera to world, or None).

    Parameters
    ----------
    path
        a folder or a file in any format of `FORMATS`, detected from content: a bag (ROS 1, ROS 2 or RealSense's SDK), TUM
        RGB-D, BOP, ICL-NUIM, Redwood, Record3D, an NPZ of arrays, a folder of depth and color images, a depth image (PNG, TIFF,
        NPY), clouds (PLY, PCD, text, NPZ, NPY, LAS, LAZ, E57), meshes (OBJ, STL, PLY), photographs, a video.
    images_only
        if a folder has both depth and color images, open its color images alone, as Image: for a config with `mode: 2d`.
    masks
        masks to use instead of the capture's own: a folder of images named like the frames, or one image for a capture of one
        frame. Pixels above zero are the object. None: the capture's own masks, if it has any.
    options
        values that are missing or wrong in the capture: topics, `camera` (fx, fy, cx, cy in px), `depth_scale` (units per metre),
        `tolerance` (s), `color`, `trajectory` (a file of camera poses), `pose` (of the camera in a robot's base frame; by default
        that in a file pose.yaml or pose.json beside the images). A value given here replaces the capture's.
    camera
        the intrinsics of the depth images: a file (JSON, YAML, RealSense's text), or a text "fx,fy,cx,cy" in px. Short for
        `camera_file` and `camera` of ReadOptions.
    limits
        the largest images and clouds that are read, such as `config.input.limits()`; a frame that announces more fails.

    Returns
    -------
    Capture : a sequence of FrameRef in recording order, with `len`, iteration and indexing by number, slice or name; has
        `format` (a key of `FORMATS`), `path`, and `notes`, sentences about assumptions and repairs.

    Raises
    ------
    InputError : `path` does not exist, its format is unknown, or something that all frames need is missing or damaged.
        A frame that is damaged alone raises InputError from its `load`.
    MissingDependency : the format needs a package that is not installed; the message has the pip command.

    Examples
    --------
    >>> capture = doo3d.open_capture("sample_clouds/crossing", options=ReadOptions(depth_scale=1000))
    >>> for frame in capture:
    ...     loaded = frame.load()
    ...     detection = doo3d.detect(loaded.data, mask=loaded.mask)
    """
    path = file_path(path, "path")
    masks = None if masks is None else file_path(masks, "masks")
    images_only = flag(images_only, "images_only")
    if not isinstance(options, ReadOptions):
        raise refused(options, "options", "a ReadOptions")
    if camera is not None:
        options = options.model_copy(update=intrinsics_of(file_path(camera, "camera")))
    with guarded(path), limited(limits):
        if not path.exists():
            raise InputError(f"{path} does not exist", code="file-missing")
        capture = _open_with_camera_file(path, images_only, options)
        if options.trajectory is not None:
            capture = with_trajectory(capture, options.trajectory, options.tolerance)
        if masks is not None:
            capture = with_masks(capture, masks)
        return replace(capture if images_only else _posed_in_base(capture, options), options=options)


def _posed_in_base(capture: Capture, options: ReadOptions) -> Capture:
    """Return the capture with the camera's pose in the robot's base frame, if one is given or stored beside the images."""
    if options.pose is None:
        file = pose_file_beside(capture.path)
        return capture if file is None else in_base_frame(capture, read_pose(file), str(file))
    if not isinstance(options.pose, str):
        return in_base_frame(capture, np.array(options.pose), "POSE")
    if options.pose.startswith(TF) and capture.format != "bag":
        remedy = f"{capture.path} is no bag: give a file or x,y,z,qx,qy,qz,qw"
        raise InputError(f"pose={options.pose}: names a frame of a bag's tf, and {remedy}", code="pose-invalid")
    return in_base_frame(capture, None, options.pose)


def _open_with_camera_file(path: Path, images_only: bool, options: ReadOptions) -> Capture:
    """Open a capture with the camera and the depth unit of the camera file in the options, if there is one.

    The size of the first frame's image selects among several cameras of the file, and must agree with the selected one.
    """
    if options.camera_file is None or options.camera is not None:
        return _open(path, images_only, options, options)

    def opened_with(camera: Calibration) -> Capture:
        given = {"camera": camera.pinhole, "depth_scale": options.depth_scale or camera.scale}
        return _open(path, images_only, options.model_copy(update=given), options)

    cameras = read_camera_file(options.camera_file)
    capture = opened_with(cameras[0])
    first = _first_frame(capture)
    if first is None:
        return capture
    size = (first.camera.width, first.camera.height)
    chosen, note = choose_camera(cameras, size, aligned=first.color is not None)
    check_size(chosen, size)
    if chosen != cameras[0]:
        capture = opened_with(chosen)
    return replace(capture, notes=[*capture.notes, *([note] if note else []), *describe_camera(chosen)])


def _first_frame(capture: Capture) -> Frame | None:
    """Return the first frame of the capture if it has depth and can be read; otherwise None."""
    try:
        data = capture[0].load().data if len(capture) else None
    except InputError:
        return None
    return data if isinstance(data, Frame) else None


def _open(path: Path, images_only: bool, options: ReadOptions, given: ReadOptions) -> Capture:
    """Open a capture by the first format that can read it; `given` are the options as the user wrote them."""
    if path.is_file():
        check_not_pointer(path, read_head(path, _HEAD_BYTES))
    for name in sorted(FORMATS, key=lambda name: (images_only and name not in IMAGE_FORMATS, FORMATS.is_built_in(name))):
        if FORMATS.attempt(name, partial(_can_read, name, path)) or (name == "pairs" and _is_depth_by_options(path, options)):
            _check_options(path, name, format_class(name), images_only, given)
            return _checked(name, FORMATS.call(name, format_class(name), path, options))
    raise unknown_format(path, [reader for _, reader in FORMATS.working()])


def _can_read(name: str, path: Path) -> bool:
    return FORMATS.call(name, format_class(name).can_read, path)


def _checked(name: str, read: Any) -> Capture:
    """Convert the object that a reader returned to a Capture; raise an error if it is none."""
    if missing := [part for part in ("path", "format", "frames") if not hasattr(read, part)]:
        sentence = f"the reader {name} returned a {type(read).__name__} without {' and '.join(missing)}: mend or uninstall it"
        raise ConfigError(sentence, code="plugin-broken")
    return Capture.of(read)


def _check_options(path: Path, name: str, reader: CaptureFormat, images_only: bool, given: ReadOptions) -> None:
    """Raise InputError if an option is set that the reader does not support; its `options` names the supported ones."""
    used = getattr(reader, "options", None)
    if used is not None:
        of_poses = set[str]() if images_only or name in IMAGE_FORMATS else {"trajectory", "pose"}
        check_used(given, used | of_poses, f"{path}, a capture of the format {name}")


def _is_depth_by_options(path: Path, options: ReadOptions) -> bool:
    """Return whether `path` is an image that counts as a depth image because the options give its camera."""
    if options.camera is None or not path.is_file() or not is_image(path):
        return False
    return options.color is not None or not is_depth_content(path)

"""Read frames from arrays in an NPZ file of `numpy.savez`: depth, K, and optionally color, mask, pose, timestamps."""

from functools import lru_cache, partial
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...errors import InputError
from ...guard.guarding import prefixed
from ...types import Array, Floats, Frame, check_mask
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, OF_DEPTH, ReadOptions, without_color
from ..support.arrays import to_metres
from ..support.camera_search import REMEDY, find_camera
from ..support.depth_frames import Pinhole, camera_for, check_depth_scale, check_pose, check_unit, pinhole_of
from ._npz_arrays import SMALL, STACKS, ArrayStack, find_arrays, has_depth
from .image_folder import DEFAULT_DEPTH_SCALE


class ArraysCapture:
    """An NPZ file of arrays, opened as a capture of N frames (1 if `depth` is a single image).

    An array without the leading dimension N applies to all frames; only `color` must have it if `depth` has it. Loading a frame
    reads only that frame's part of `depth`, `color` and `mask`.

    Notes
    -----
    Arrays in the file; `depth` is required, and `K` unless the options give the camera:

    - depth : (H, W) or (N, H, W); whole numbers in `depth_scale` units per metre (1000 if absent), or floats
      in metres (divided by `depth_scale` if that is given).
    - K : (3, 3) or (N, 3, 3), [fx, 0, cx; 0, fy, cy; 0, 0, 1], px.
    - color : (H, W, 3) or (N, H, W, 3) uint8 RGB.
    - mask : (H, W) or (N, H, W), true or above zero on the object.
    - pose : (4, 4) or (N, 4, 4), camera to world, x_world = pose @ x_camera, m.
    - timestamps : one or (N,), s, increasing.
    - depth_scale : one or (N,), units per metre.

    Other usual names are known, such as `rgb` or `image` for color and `intrinsics` for K, which may also be the four numbers fx,
    fy, cx, cy. Without K, a camera file beside the NPZ file is read.
    """

    what: ClassVar[str] = "an NPZ of arrays (depth, K, with color, depth_scale, mask, pose, timestamps)"
    format = "arrays"
    options: ClassVar[frozenset[str]] = OF_DEPTH

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        changed = path.stat().st_mtime_ns
        arrays = find_arrays(path)
        if without_color(options):
            arrays.pop("color", None)
        if "depth" not in arrays:
            raise InputError(f"{path}: has no array depth, (H, W) or (N, H, W)", code="array-shape")
        count, is_stacked = _frame_count(path, arrays), arrays["depth"].stacked
        small = {name: arrays[name].numbers(count) for name in SMALL if name in arrays}
        self.notes: list[str] = []
        self.extra_files: list[Path] = []
        camera: Pinhole | None = options.camera
        if camera is None and "K" not in small:
            height, width = arrays["depth"].part_shape
            found = find_camera(path.parent, (width, height), aligned=True)
            if found is None:
                raise InputError(f"{path}: has no K, the (3, 3) camera matrix: add it, or {REMEDY}", code="intrinsics-missing")
            camera, self.notes, self.extra_files = found.camera.pinhole, found.notes, [found.camera.file]
        times = small.get("timestamps", np.zeros(0))
        if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
            raise InputError(f"{path}: timestamps must increase from frame to frame and be finite, in s", code="times-not-rising")
        parts = tuple((name, arrays[name].stored) for name in STACKS if name in arrays)
        digits = max(len(str(count - 1)), 6)
        self.frames = []
        for i in range(count):
            name, time = f"{i:0{digits}d}" if is_stacked else path.stem, times[i].item() if len(times) else None
            scale = options.depth_scale or (small["depth_scale"][i].item() if "depth_scale" in small else None)
            pose = small["pose"][i] if "pose" in small else None
            load = partial(_load, path, changed, i, name, parts, camera or small["K"][i], scale, pose, time)
            self.frames.append(FrameRef(name, path, load, time))

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is an NPZ file with an array called `depth` (or `depths`, `depth_image`, ...)."""
        try:
            return path.is_file() and has_depth(path)
        except InputError:
            return False


def _frame_count(path: Path, arrays: dict[str, ArrayStack]) -> int:
    """Return the number of frames; raise InputError if an array has neither one part per frame nor one for all."""
    depth = arrays["depth"]
    count = depth.shape[0] if depth.stacked else 1
    for name, array in arrays.items():
        if array.stacked and array.shape[0] != count:
            sentence = f"{path}: {name} has {array.shape[0]} parts, but there are {count} frames of depth"
            raise InputError(sentence, code="frame-count")
        if name == "color" and depth.stacked and not array.stacked:
            sentence = f"{path}: color has shape {array.shape}, expected one image for each of the {count} frames"
            raise InputError(sentence, code="frame-count")
    return count


@lru_cache(maxsize=len(STACKS))
def _stack(path: Path, changed: int, name: str, stored: str) -> ArrayStack:
    """Return the reader that all frames of a file share, also unpickled ones; `changed` is the file's modification time."""
    return ArrayStack(path, name, stored)


def _load(
    path: Path,
    changed: int,
    index: int,
    name: str,
    parts: tuple[tuple[str, str], ...],
    intrinsics: Pinhole | Floats,
    scale: float | None,
    pose: Floats | None,
    time: float | None,
) -> FrameData:
    where = f"{path}: frame {index}"
    arrays = {part: _stack(path, changed, part, stored).part(index) for part, stored in parts}
    depth = _metres(arrays["depth"], scale, where)
    check_unit(depth, path, scale or 1.0)
    pinhole = _pinhole(intrinsics, where) if isinstance(intrinsics, np.ndarray) else intrinsics
    with prefixed(where):
        frame = Frame(arrays.get("color"), depth, camera_for(pinhole, depth.shape), name, time)
        mask = check_mask(arrays["mask"], depth.shape) if "mask" in arrays else None
    return FrameData(frame, mask, None if pose is None else check_pose(pose, f"{where}: pose"))


def _metres(depth: Array, scale: float | None, where: str) -> Array:
    """Return depth as float32 metres; `scale` is the units per metre, None for the default of its type."""
    if scale is not None:
        check_depth_scale(scale, where, "units per metre above zero (1000 for millimetres)")
    if depth.dtype.kind not in "uif":
        raise InputError(f"{where}: depth has type {depth.dtype}, expected whole numbers or floats", code="depth-type")
    return to_metres(depth, scale or DEFAULT_DEPTH_SCALE, scale or 1.0)


def _pinhole(values: Floats, where: str) -> Pinhole:
    """Return fx, fy, cx, cy (px) from an array of these four numbers, or from a camera matrix (3, 3) or (4, 4)."""
    if values.shape == (4,):
        fx, fy, cx, cy = values.tolist()
        return fx, fy, cx, cy
    return pinhole_of(values[:3, :3] if values.shape == (4, 4) else values, f"{where}: K")

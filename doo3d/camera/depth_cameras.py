"""Open several depth cameras as one capture of fused or best single views."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from ..config import Config
from ..errors import DooError, InputError
from ..fusion.fuse import fuse_cameras
from ..inputs import IMAGE_FORMATS, Capture, FrameData, FrameRef, ReadOptions, open_capture
from ..inputs.rig.rig_file import RigFile
from ..pipeline import detect
from ..types import Cloud, Detection, Floats, Frame

DEPTH_CAMERAS = "rig of depth cameras"
"""Format of the capture."""

MIN_LENGTH_RATIO = 0.97
"""Length of the chains in the view of one camera, relative to those of all views fused, below which the view misses a part of
the object."""


def open_depth_cameras(path: Path, file: Path, rig: RigFile, config: Config, masks: Path | None, options: ReadOptions) -> Capture:
    """Open the captures of depth cameras as one capture of simultaneous frames.

    Parameters
    ----------
    path, file
        the folder of the captures, and the rig file.
    rig
        content of the rig file.
    config
        the settings of `detect`.
    masks
        folder with a sub-folder of masks for each camera; None: the captures' own.
    options
        values that the captures lack; `pose` is that of the rig in a robot's base frame.

    Raises
    ------
    InputError : a capture cannot be read, has no depth, or no frames are simultaneous.
    """
    captures = []
    for camera in rig.cameras:
        assert camera.capture is not None
        changed = {"camera_file": camera.camera or options.camera_file, "cameras": None, "pose": None}
        own = options.model_copy(update=changed | {"depth_scale": camera.depth_scale or options.depth_scale})
        folder = None if masks is None else masks / camera.name
        captures.append(open_capture(path / camera.capture, False, folder, own))
        if captures[-1].format in IMAGE_FORMATS:
            sentence = f"the capture {path / camera.capture} of the camera {camera.name} has no depth"
            raise InputError(f"{file}: {sentence}: a pair without depth has `images`, not `capture`", code="rig-invalid")
    sets, notes = _synchronize(captures, [camera.name for camera in rig.cameras], options.tolerance)
    base = None if options.pose is None else np.array(options.pose)
    frames = []
    for together in sets:
        named = [replace(each, name=f"the camera {camera.name}") for each, camera in zip(together, rig.cameras, strict=True)]
        views = [(each, np.array(camera.pose)) for each, camera in zip(named, rig.cameras, strict=True)]
        first = together[0]
        frames.append(FrameRef(first.name, path, partial(load_best, first, views, config, base), first.timestamp))
    notes += [f"{camera.name}: {note}" for camera, opened in zip(rig.cameras, captures, strict=True) for note in opened.notes]
    return Capture(path, DEPTH_CAMERAS, frames, notes)


def _synchronize(captures: Sequence[Capture], names: Sequence[str], tolerance: float) -> tuple[list[list[FrameRef]], list[str]]:
    """Return the simultaneous frames of all cameras, with notes on frames left out.

    Frames are matched by timestamps (s, within `tolerance`), else by names, else by order.

    Raises
    ------
    InputError : no frames are near in time; or frames lack times, and only some names match, or no names match
    and the numbers of
        frames differ.
    """
    first = captures[0]
    if all(frame.timestamp is not None for capture in captures for frame in capture):
        times = [np.array([frame.timestamp for frame in capture], dtype=float) for capture in captures]
        nearest = [[int(np.abs(each - time).argmin()) for time in times[0]] for each in times]
        offsets = [np.abs(each[at] - times[0]) for each, at in zip(times, nearest, strict=True)]
        together = np.flatnonzero((np.array(offsets) <= tolerance).all(axis=0))
        sets = [[capture[at[i]] for capture, at in zip(captures, nearest, strict=True)] for i in together]
        if not sets:
            sentence = f"no frames of {' and '.join(names)} are within {tolerance} s of each other (--input-option tolerance=...)"
            raise InputError(f"{first.path.parent}: {sentence}", code="times-apart")
        left_out = len(first) - len(sets)
        return sets, [f"{left_out} frames of {names[0]} have no partner within {tolerance} s"] if left_out else []
    named = [{frame.name: frame for frame in capture} for capture in captures]
    common = set.intersection(*map(set, named))
    if len(common) == max(map(len, captures)):
        return [[frames[name] for frames in named] for name in named[0]], []
    if common or len({len(capture) for capture in captures}) > 1:
        counts = ", ".join(f"{name} has {len(capture)}" for name, capture in zip(names, captures, strict=True))
        shared = f"{len(common) or 'no'} names of frames in common, and not all have times"
        sentence = f"{counts} frames, {shared}, so that it is unknown which belong together"
        raise InputError(f"{first.path.parent}: {sentence}: give one frame of each camera at each time", code="frame-count")
    note = f"the frames of {' and '.join(names)} have no times and other names: they are taken to belong together by their order"
    return [list(views) for views in zip(*captures, strict=True)], [note]


def load_best(first: FrameRef, views: Sequence[tuple[FrameRef, Floats]], config: Config, base: Floats | None) -> FrameData:
    """Return the fused views, or the view of one camera with more confident chains.

    The chains of the single view must not be shorter. Where strands are on top of each other, one camera may separate them
    better than the fused cloud. Of results from different data the one of highest confidence is most often right.

    Parameters
    ----------
    first
        the frame that gives name and time.
    views
        the frame of each camera, and the pose (4, 4) of that camera in the rig, m.
    config
        the settings of `detect`.
    base
        (4, 4) m, pose of the rig in a robot's base frame; None if unknown.

    Raises
    ------
    InputError : no camera sees the object.
    """
    placed = [replace(frame, loader=partial(_load_posed, frame, pose)) for frame, pose in views]
    fused = fuse_cameras(placed, config, first.name, first.timestamp)
    best = FrameData(fused, pose=np.eye(4), base_pose=base)
    found = detect(fused, config)
    confidence, length = _confidence(found), MIN_LENGTH_RATIO * _length(found)
    for frame, pose in views:
        try:
            loaded = frame.load()
            alone = detect(loaded.data, config, loaded.mask_for(config))
        except DooError:  # the object is hidden from this camera
            continue
        if _confidence(alone) > confidence and _length(alone) >= length:
            assert isinstance(loaded.data, Frame | Cloud)
            data, confidence = replace(loaded.data, name=first.name), _confidence(alone)
            best = FrameData(data, loaded.mask, pose, pose if base is None else base @ pose)
    return best


def _load_posed(frame: FrameRef, pose: Floats) -> FrameData:
    """Return the data of a frame with a pose (4, 4), camera to rig, m."""
    return replace(frame.load(), pose=pose)


def _confidence(detection: Detection) -> float:
    """Return the smallest confidence of the chains; 0 without chains."""
    return min((chain.confidence for chain in detection.chains), default=0.0)


def _length(detection: Detection) -> float:
    """Return the total length of the chains, m."""
    return sum(chain.length for chain in detection.chains)

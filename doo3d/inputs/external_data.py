"""Replace the masks and poses of a capture by those of separate files."""

from dataclasses import replace
from functools import partial
from pathlib import Path

from ..errors import InputError
from ..types import Cloud, Floats, Frame
from .capture import Capture, FrameData, FrameRef
from .formats.trajectory import Trajectory, read_trajectory
from .support.images import PHOTO_SUFFIXES, read_mask
from .support.listing import images_in, match_images


def with_masks(capture: Capture, masks: Path) -> Capture:
    """Return a capture whose frames have masks from separate files instead of its own.

    `masks` is one image, for a capture of one frame, or a folder of images. An image in the folder belongs to the frame whose
    name is the image's file name without the suffix; if no name agrees and there are as many images as frames, the first image
    belongs to the first frame and so on. Pixels above zero are the object. Loading a frame that has no mask file raises
    InputError.

    Raises
    ------
    InputError : `masks` does not exist, the folder has no mask for any frame, or one image is given for several frames.
    """
    count = len(capture)
    if masks.is_dir():
        files = match_images(images_in(masks, PHOTO_SUFFIXES), {frame.name: frame for frame in capture})
        if not files:
            sentence = f"{masks}: holds no mask for any of the {count} frames of {capture.path}: name masks like frames"
            raise InputError(sentence, code="mask-missing")
    elif not masks.exists():
        raise InputError(f"{masks} does not exist", code="file-missing")
    elif count != 1:
        sentence = f"{masks}: is one mask, but {capture.path} has {count} frames: give a folder of masks"
        raise InputError(sentence, code="frame-count")
    else:
        files = {capture[0].name: masks}
    frames = [replace(frame, loader=partial(_load_masked, frame, files.get(frame.name), masks)) for frame in capture]
    return replace(capture, frames=frames, masks=masks)


def _load_masked(frame: FrameRef, file: Path | None, masks: Path) -> FrameData:
    if file is None:
        raise InputError(f"{masks}: there is no mask for frame {frame.name}", code="mask-missing")
    loaded = frame.load()
    data = loaded.data
    if isinstance(data, Cloud):
        raise InputError(f"{file}: a mask needs an image, but {frame.source} is a cloud", code="mask-on-cloud")
    if isinstance(data, Frame):
        return replace(loaded, mask=read_mask(file, data.depth.shape))
    return replace(loaded, mask=read_mask(file, data.color.shape[:2], upright=True))


def with_trajectory(capture: Capture, file: Path, tolerance: float) -> Capture:
    """Return a capture whose poses come from a trajectory file (TUM's format, camera to world) instead of its own.

    A frame with a time gets the pose interpolated at that time, or None if no pose in the file is within `tolerance` (s). If no
    frame has a time, the first line of the file belongs to the first frame and so on; there must be as many lines as frames.

    Raises
    ------
    InputError : the file cannot be read, no pose is within `tolerance` of any frame, or the numbers of lines and frames differ.
    """
    trajectory = read_trajectory(file)
    if any(frame.timestamp is not None for frame in capture):
        poses = _poses_by_time(capture, trajectory, tolerance, file)
    elif len(trajectory.times) == len(capture):
        poses = list(trajectory.poses)
    else:
        counts = f"has {len(trajectory.times)} poses but {capture.path} has {len(capture)} frames without times"
        raise InputError(f"{file}: {counts}: give one line per frame", code="frame-count")
    frames = [replace(frame, loader=partial(_load_posed, frame, pose)) for frame, pose in zip(capture, poses, strict=True)]
    return replace(capture, frames=frames, notes=[*capture.notes, *trajectory.notes])


def _poses_by_time(capture: Capture, trajectory: Trajectory, tolerance: float, file: Path) -> list[Floats | None]:
    times = [frame.timestamp for frame in capture if frame.timestamp is not None]
    poses = [None if frame.timestamp is None else trajectory.at(frame.timestamp, tolerance) for frame in capture]
    if all(pose is None for pose in poses):
        spans = f"from {trajectory.times[0]} to {trajectory.times[-1]} s, the frames from {min(times)} to {max(times)} s"
        apart = f"no pose is within {tolerance} s of a frame (--input-option tolerance=...)"
        raise InputError(f"{file}: its poses are {spans}: {apart}", code="times-apart")
    return poses


def _load_posed(frame: FrameRef, pose: Floats | None) -> FrameData:
    return replace(frame.load(), pose=pose)


def in_base_frame(capture: Capture, pose: Floats | None, source: str) -> Capture:
    """Return a capture whose results are in a robot's base frame, or another frame in which the camera's pose is known.

    Loading a frame that has no pose raises InputError if `pose` is None.

    Parameters
    ----------
    capture
        the frames.
    pose
        (4, 4) m, camera to base: p_base = pose @ p_camera, the same for all frames; None takes each frame's own pose.
    source
        the option or file that the pose comes from, for errors.
    """
    frames = [replace(frame, loader=partial(_load_in_base_frame, frame, pose, source)) for frame in capture]
    return replace(capture, frames=frames, base_pose=source if pose is None else pose.tolist())


def _load_in_base_frame(frame: FrameRef, pose: Floats | None, source: str) -> FrameData:
    loaded = frame.load()
    base_pose = loaded.pose if pose is None else pose
    if base_pose is None:
        fault = f"has no camera pose, which pose={source} needs (doo3d info says whether there are poses)"
        remedy = "give the pose itself, as a file or x,y,z,qx,qy,qz,qw"
        raise InputError(f"frame {frame.name} {fault}: {remedy}", code="pose-missing")
    return replace(loaded, base_pose=base_pose)

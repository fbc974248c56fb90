"""Detect objects in all frames of a capture together, in two passes.

The first pass detects in each frame by itself. Then the number of objects and their lengths are voted over all frames. The
second pass follows every object through all frames, starting from the frames in which it is seen whole. It works in windows
with fixed borders, and reads some frames before and after each window: memory stays small, and windows are independent of each
other.
"""

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..config import Config, ConfigLike, as_config
from ..errors import InputError
from ..geometry.limits import FRAME_RATE
from ..types import Array, Cloud, Detection, Frame
from ..types.arguments import refused
from .deviations import with_deviations
from .first_pass import check_mode, observe_frame
from .follow import follow
from .frame_evidence import Period
from .frame_result import frame_result
from .junction_vote import trees_of
from .objects import SequenceObject, find_objects
from .observations import Observation
from .sequence_notes import sequence_notes
from .shape import Shape
from .tracks import CONTEXT, WINDOW
from .world_frame import in_camera, in_world, is_of_camera, poses_of


def detect_sequence(
    frames: Iterable[Frame | Cloud],
    config: ConfigLike | None = None,
    masks: Iterable[Array | None] | None = None,
    poses: Iterable[ArrayLike] | None = None,
) -> list[Detection]:
    """Detect the deformable linear objects of a capture in all frames together.

    An object has the same id, direction and number of segments in all frames, and joint i is the same point of the material.
    Parts hidden in one frame are filled in from the frames before and after. An object that is seen whole keeps its place in
    the image.

    Parameters
    ----------
    frames
        the frames or clouds of one capture, in order; read once, and not kept.
    config
        the settings, as for `detect`; section `sequence` applies here only.
    masks
        for each frame the caller's segmentation, as for `detect`, or None; None segments all frames according to the settings.
    poses
        for each frame the pose of a moving camera, camera to world: (4, 4) m. Objects are then followed in the world; their
        chains are in the camera frame all the same. None: objects are followed in the camera frame.

    Returns
    -------
    A detection for each frame; the first one also has the notes on the whole sequence. For each segment,
    `occluded` is True where the object is hidden in the frame, and `from_time` where the segment was filled in from other
    frames.

    Raises
    ------
    InputError : a frame cannot be used, or the config is for images (mode "2d").
    """
    config = as_config(config)
    check_mode(config)
    placed = zip(_with_masks(frames, masks), _poses(poses), strict=False)  # too few poses raise an error
    observations = [observe_frame(frame, config, mask, pose) for (frame, mask), pose in placed]
    objects = find_objects(in_world(observations), config)
    detections = list(follow_objects(observations, objects, config))
    if detections:
        notes = (*sequence_notes(observations, objects, config), *detections[0].notes)
        detections[0] = replace(detections[0], notes=notes)
    return detections


def _with_masks(
    frames: Iterable[Frame | Cloud], masks: Iterable[Array | None] | None
) -> Iterator[tuple[Frame | Cloud, Array | None]]:
    """Yield each frame with its mask, checked for type and number."""
    for values, what in ((frames, "frames"), (() if masks is None else masks, "masks")):
        if not isinstance(values, Iterable) or isinstance(values, str | Frame | Cloud) or getattr(values, "ndim", 1) == 0:
            raise refused(values, what, "a sequence, such as a list: one for each frame")
    given = itertools.repeat(None) if masks is None else iter(masks)
    for number, frame in enumerate(frames):
        if not isinstance(frame, Frame | Cloud):
            remedy = "a doo3d.Frame or a doo3d.Cloud: of a capture give [frame.load().data for frame in capture]"
            raise refused(frame, f"frames[{number}]", remedy)
        try:
            yield frame, next(given)
        except StopIteration:
            raise InputError(
                f"there are {number} masks, and more frames: give one for each, or None", code="mask-missing"
            ) from None


def _poses(poses: Iterable[ArrayLike] | None) -> Iterator[ArrayLike | None]:
    """Yield the pose of each frame, checked for number; None if there are none."""
    if poses is None:
        yield from itertools.repeat(None)
        return
    if not isinstance(poses, Iterable) or isinstance(poses, str | bytes) or getattr(poses, "ndim", 1) == 0:
        raise refused(poses, "poses", "a sequence of poses (4, 4), such as a list: one for each frame")
    yield from poses
    raise InputError("there are fewer poses than frames: give one for each", code="pose-invalid")


def combine(observations: Sequence[Observation], config: Config, past_only: bool = False) -> Iterator[Detection]:
    """Find the objects of a capture, and yield the detection of each frame, as `follow_objects`."""
    return follow_objects(observations, find_objects(in_world(observations), config), config, past_only)


def follow_objects(
    observations: Sequence[Observation], objects: Sequence[SequenceObject], config: Config, past_only: bool = False
) -> Iterator[Detection]:
    """Yield the detection of each frame from all observations: the second pass.

    Parameters
    ----------
    observations
        all frames of the capture, in order.
    objects
        the objects of the capture, from `find_objects`.
    config
        the settings; sections `sequence` and `output` are used.
    past_only
        True to find each object from earlier frames only, for comparison. The number and lengths of the objects still come
        from all frames.
    """
    max_gap = gap_frames(observations, config)
    for start in range(0, len(observations), WINDOW):
        first, last = window_bounds(start, len(observations))
        yield from combine_window(start, observations[first:last], objects, max_gap, config.output.min_confidence, past_only)


def window_bounds(start: int, count: int) -> tuple[int, int]:
    """Return the first frame that a window reads, and one after the last.

    start : first frame of the window itself. count : number of frames of the capture.
    """
    return max(0, start - CONTEXT), min(count, start + WINDOW + CONTEXT)


def combine_window(
    start: int,
    observations: Sequence[Observation],
    objects: Sequence[SequenceObject],
    max_gap: int,
    min_confidence: float,
    past_only: bool = False,
) -> list[Detection]:
    """Return the detections of the WINDOW (300) frames of a window.

    Parameters
    ----------
    start
        index in the capture of the window's first frame.
    observations
        the observations of the frames of `window_bounds`, which begin up to CONTEXT frames earlier.
    objects
        the objects of the whole capture.
    max_gap
        largest number of successive frames without any strand of an object that are filled in.
    min_confidence
        smallest confidence of chains that the sequence does not confirm: rings, and all chains if no object was found.
    past_only
        as for `combine`.
    """
    frames = range(max(0, start - CONTEXT), max(0, start - CONTEXT) + len(observations))
    placed = in_world(observations)
    poses = poses_of(placed) if is_of_camera(observations) else np.zeros((0, 4, 4))
    if is_of_camera(placed):
        poses = np.tile(np.eye(4), (len(placed), 1, 1))
    owned = [_owned(item, frames) for item in objects]
    claimed = [set[int]().union(*(own[k] for own in owned)) for k in range(len(frames))]
    shapes: list[list[Shape | None]] = []
    for tree in trees_of([item.nodes for item in objects]):
        items = [objects[k] for k in tree]
        of_others = [[chains - own for chains, own in zip(claimed, owned[k], strict=True)] for k in tree]
        followed = follow(items, Period(frames.start, placed, poses, len(objects) == 1), of_others, max_gap, past_only)
        known = [with_deviations(item, each, placed, past_only) for item, each in zip(items, followed, strict=True)]
        shapes += [_in_camera(each, placed) for each in known]
    is_branched = any(observation.detection.objects for observation in observations)
    return [
        frame_result(observations[k], objects, [shape[k] for shape in shapes], claimed[k], is_branched, min_confidence)
        for k in range(start - frames.start, min(start - frames.start + WINDOW, len(frames)))
    ]


def _in_camera(shapes: Sequence[Shape | None], observations: Sequence[Observation]) -> list[Shape | None]:
    """Return the shapes of an object in the camera frame.

    observations : of the same frames, in the world if `in_world` transformed them.
    """
    poses = poses_of(observations)
    if not len(poses):
        return list(shapes)
    return [shape and replace(shape, joints=in_camera(pose, shape.joints)) for shape, pose in zip(shapes, poses, strict=True)]


def gap_frames(observations: Sequence[Observation], config: Config) -> int:
    """Return `sequence.max_gap` as a number of frames."""
    return round(config.sequence.max_gap / frame_seconds(observations))


def frame_seconds(observations: Sequence[Observation]) -> float:
    """Return the median time between frames in s; 1/30 s if they have no times."""
    times = [observation.detection.timestamp for observation in observations]
    steps = np.diff([time for time in times if time is not None])
    steps = steps[steps > 0]
    return float(np.median(steps)) if len(steps) else 1 / FRAME_RATE


def _owned(item: SequenceObject, frames: range) -> list[set[int]]:
    """Return for each frame the chain that is the object or a part of it, as a set."""
    chains = dict(item.parts) | {anchor.frame: anchor.chain for anchor in item.anchors}
    return [{chains[frame]} if frame in chains else set() for frame in frames]

"""Relate color and depth in a bag: pairing in time, transforms between the cameras, camera poses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...types import Array, Floats
from . import realsense
from .index import Bag, TopicIndex
from .realsense import DEPTH_ALONE
from .tf import Transforms, values_of
from .topics import Stream
from .undistortion import Lens

_MAX_INTRINSICS_DIFFERENCE_PX = 0.01  # cameras whose intrinsics differ by less have the same pixels


def pair_by_time(path: Path, depth: TopicIndex, color: TopicIndex, tolerance: float, required: bool) -> tuple[Array, str]:
    """Find the color image nearest in time to each depth image.

    The times are those in the message headers if all messages of both topics have one, else the times of recording.

    Parameters
    ----------
    path
        path of the bag, named in the error.
    depth, color
        messages of the depth and of the color topic.
    tolerance
        largest time difference, s.
    required
        whether it is an error if no depth image has a color image.

    Returns
    -------
    (indices, note). indices : (D,) int for D depth images, for each the index into `color` of its color image, or -1 if none is
    within the tolerance. One color image may belong to several depth images. note : a sentence if no depth image has a color
    image, else empty.

    Raises
    ------
    InputError : color is required, and no depth image has a color image within the tolerance.
    """
    stamped = depth.stamped and color.stamped
    depth_times, times = depth.clock(stamped), color.clock(stamped)
    order = np.argsort(times, kind="stable")
    ranks = np.clip(np.searchsorted(times[order], depth_times), 1, max(len(times) - 1, 1))
    before, after = order[ranks - 1], order[np.minimum(ranks, len(times) - 1)]
    nearest = np.where(np.abs(times[before] - depth_times) <= np.abs(times[after] - depth_times), before, after)
    apart = np.abs(times[nearest] - depth_times)
    note = ""
    if not (apart <= tolerance * 1e9).any():
        least, names = apart.min() / 1e9, f"no image of {color.topic.name} is within {tolerance} s of one of {depth.topic.name}"
        fault = f"{names}, the nearest differs by {least:.3f} s"
        if required:
            raise InputError(f"{path}: {fault}: give --input-option tolerance=..., or {DEPTH_ALONE}", code="times-apart")
        wider = math.ceil(least * 100) / 100
        note = f"{fault}, so depth is read alone: --input-option tolerance={wider:g} reads the color with it"
    return np.asarray(np.where(apart <= tolerance * 1e9, nearest, -1)), note


def color_geometry(
    bag: Bag, index: Mapping[str, TopicIndex], depth: Stream, color: Stream, transforms: Transforms, time: int
) -> tuple[Lens, tuple[tuple[float, ...], ...] | None]:
    """Return the color camera with its lens, and the transform from the depth camera to the color camera.

    The transform comes from RealSense's extrinsics or from the tree of coordinate frames (/tf). It is the identity if the depth
    topic is depth aligned to color, or if both images have the same frame_id.

    Parameters
    ----------
    bag, index
        the bag, and its messages by topic name.
    depth, color
        the topics of the images; the depth camera's lens must be known.
    transforms
        the tree of coordinate frames.
    time
        time at which the transform is taken, ns.

    Returns
    -------
    (lens, transform). The lens is that of the color images, or of the depth images if the color topic has no CameraInfo but the
    same pixels. The transform is the four rows of a (4, 4) matrix, x_color = transform @ x_depth, m, or None if the pixels of
    both images coincide, so that no alignment is needed.

    Raises
    ------
    InputError : the transform or the color camera's intrinsics are not in the bag.
    """
    assert depth.lens is not None
    frames, is_same_size = (depth.topic_index.frame, color.topic_index.frame), color.size == depth.size
    registered = "aligned_depth_to_color" in depth.name or "depth_registered" in depth.name
    depth_to_color: Floats | None
    if realsense.stream_of(depth.name) and realsense.stream_of(color.name):
        depth_to_color = realsense.extrinsics(bag, index, depth.name, color.name)
    elif registered or (frames[0] == frames[1] and frames[0]):
        depth_to_color = np.eye(4)
    else:
        depth_to_color = transforms.between(*frames, time) if all(frames) else None
        if depth_to_color is None and is_same_size and (color.lens is None or _same_pixels(depth.lens, color.lens)):
            depth_to_color = np.eye(4)
    if depth_to_color is None:
        first, second = (
            f"{each.name} ({each.size[0]}x{each.size[1]}, frame {each.topic_index.frame!r})" for each in (color, depth)
        )
        fault = f"{first} is not aligned to {second}, and the bag has no transform between the two"
        raise InputError(f"{bag.path}: {fault}: name an aligned topic, or {DEPTH_ALONE}", code="extrinsics-missing")
    same_position = np.allclose(depth_to_color, np.eye(4), atol=1e-7)
    if color.lens is None and not (same_position and is_same_size):
        fault = f"there is no CameraInfo for {color.name}, so it cannot be aligned to {depth.name}"
        raise InputError(f"{bag.path}: {fault}: {DEPTH_ALONE}", code="intrinsics-missing")
    lens = color.lens or depth.lens
    if same_position and _same_pixels(depth.lens, lens):
        return lens, None
    return lens, tuple(tuple(row) for row in depth_to_color.tolist())


def _same_pixels(a: Lens, b: Lens) -> bool:
    """Return whether two cameras have the same intrinsics and image size, apart from distortion."""
    intrinsics = [(c.fx, c.fy, c.cx, c.cy, c.width, c.height) for c in (a.camera, b.camera)]
    return bool(np.allclose(intrinsics[0], intrinsics[1], rtol=0, atol=_MAX_INTRINSICS_DIFFERENCE_PX))


def transforms_of(bag: Bag, index: Mapping[str, TopicIndex]) -> Transforms:
    """Read the transforms in a bag (TFMessage, as on /tf and /tf_static) into a tree of coordinate frames.

    `index` is the bag's messages by topic name. Damaged messages are skipped.
    """
    result = Transforms()
    for topic_index in index.values():
        if not topic_index.topic.kind.lower().endswith("/tfmessage"):
            continue
        static = topic_index.topic.name.endswith("tf_static")
        for i in range(len(topic_index)):
            try:
                message = bag.message(topic_index.topic, topic_index.location(i))
            except InputError:
                continue
            for stamped in message.transforms:
                header = stamped.header
                time = header.stamp.sec * 10**9 + header.stamp.nanosec
                result.add(header.frame_id, stamped.child_frame_id, time, values_of(stamped.transform), static)
    result.finish()
    return result

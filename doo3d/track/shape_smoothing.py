"""Smooth the shapes of an object over time: hidden joints, and depth."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import interp1d
from scipy.ndimage import distance_transform_cdt

from ..geometry.curves import runs
from ..geometry.equal_segments import close_ring
from ..geometry.polyline import whittaker_smooth
from ..types import Bools, Floats
from ..types.pose import in_frame_of
from .inverse_range_smoother import UNSEEN_WEIGHT, smooth_inverse_range, variance
from .object_length import MIN_FRAMES
from .objects import SequenceObject
from .registration import TURN_WEIGHT, relax_lengths
from .shape import Shape
from .world_frame import in_camera

UNKNOWN_WEIGHT = 0.01
"""Weight of a position far from anything visible, relative to 1 for a position next to a visible joint, which is known to a
radius; a visible joint weighs the inverse."""


NODES = 40
"""Number of places along an object at which depth is smoothed, about one per wavelength of a stereo camera's depth waves."""


def smooth_shapes(item: SequenceObject, shapes: list[Shape | None], poses: Floats) -> list[Shape | None]:
    """Smooth hidden joints and depth over time; visible joints stay in the image.

    Parameters
    ----------
    item
        the object.
    shapes
        its shape in T successive frames; None where it is missing.
    poses
        (T, 4, 4) m, camera to the frame of the shapes; (0, 4, 4) if no camera saw them.
    """
    result = list(shapes)
    for first, end in runs(np.array([shape is not None for shape in shapes], dtype=bool)):
        shown = [shape for shape in shapes[first:end] if shape is not None]
        result[first:end] = _smooth_run(item, shown, poses[first:end])
    return result


def _smooth_run(item: SequenceObject, shapes: Sequence[Shape], poses: Floats) -> list[Shape]:
    """Smooth the shapes of successive frames over time.

    A joint that is visible without depth takes its depth from the neighboring frames, and keeps its place in the image.
    """
    joints = np.array([shape.joints for shape in shapes])
    seen = np.array([shape.seen for shape in shapes])
    measured = np.array([shape.measured for shape in shapes])
    stiffness = _stiffness(item, joints, seen)
    weight = np.where(measured, 1 / UNKNOWN_WEIGHT, _certainty(measured, item.closed))
    smooth = joints.copy()
    for k in np.flatnonzero(~seen.all(axis=0)):
        weights = weight[:, k, None, None] * np.eye(3)
        smooth[:, k] = np.where(seen[:, k, None], joints[:, k], whittaker_smooth(joints[:, k], weights, stiffness))
    if item.closed:
        closed = [close_ring(line[:-1], item.segment_length) for line in smooth]
        return [replace(shape, joints=ring) for shape, ring in zip(shapes, closed, strict=True)]
    if len(poses):
        in_view = np.array([in_camera(pose, line) for pose, line in zip(poses, smooth, strict=True)])
        steady = smooth_joint_depth(in_view, measured)
        smooth = np.array([in_frame_of(pose, line) for pose, line in zip(poses, steady, strict=True)])
    return [
        replace(shape, joints=relax_lengths(line, item.segment_length, shape.seen))
        for line, shape in zip(smooth, shapes, strict=True)
    ]


def _stiffness(item: SequenceObject, joints: Floats, seen: Bools) -> float:
    """Return the weight of second differences over time, relative to that of a position known to a radius.

    It is the ratio of the two variances; that of the second differences is that of the visible joints. joints, seen :
    (T, M + 1, 3) m, and (T, M + 1) bool.
    """
    moves = np.diff(joints, 2, axis=0)[seen[2:] & seen[1:-1] & seen[:-2]]
    radius = item.radius if np.isfinite(item.radius) else item.segment_length
    return radius**2 / variance(moves) if len(moves) else 1.0


def _certainty(seen: Bools, closed: bool) -> Floats:
    """Return how well each joint is known in each frame, 0.01 to 1: (T, M + 1).

    The lower limit is UNKNOWN_WEIGHT. A strand determines the object for 7 segments beyond its end (see TURN_WEIGHT); farther on
    the error of a position grows with the square of the distance.

    seen : (T, M + 1) bool, True for visible joints. closed : whether the last joint is the first.
    """
    count = seen.shape[1]
    around = np.hstack((seen[:, :-1], seen, seen[:, 1:])) if closed else seen
    first = count - 1 if closed else 0
    away = np.full(seen.shape, float(count))
    for frame, shown in enumerate(around):
        if shown.any():
            away[frame] = distance_transform_cdt(~shown)[first : first + count]
    return np.asarray(UNKNOWN_WEIGHT + 1 / (1 + (TURN_WEIGHT * away**2) ** 2))


def smooth_joint_depth(joints: Floats, measured: Bools) -> Floats:
    """Return the joints of successive frames with their depth smoothed over time.

    joints : (T, M + 1, 3) m, in the camera frame, as the result. measured : (T, M + 1) bool,
    True for joints with measured depth.
    """
    if len(joints) < MIN_FRAMES:
        return joints
    distance = np.linalg.norm(joints, axis=2)
    places, at = np.linspace(0.0, 1.0, NODES), np.linspace(0.0, 1.0, joints.shape[1])
    values = np.dstack((1 / distance, np.where(measured, 1.0, UNSEEN_WEIGHT), joints / distance[:, :, None]))
    inverse, weight, *rays = np.moveaxis(interp1d(at, values, axis=1)(places), 2, 0)
    change = smooth_inverse_range(inverse, weight, np.stack(rays, axis=2)) - inverse
    nearer = distance * interp1d(places, change, axis=1)(at)
    return np.asarray(joints / (1 + nearer)[:, :, None])

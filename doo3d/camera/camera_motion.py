"""Estimate the motion of a camera without poses from the background.

Each frame is aligned with a key frame, directly by brightness and inverse depth (Kerl et al., "Robust odometry estimation for
RGB-D cameras", 2013), starting from the previous motion. When a frame shares too little with the key frame, the frame before
it becomes the next key frame, so that drift grows with the path of the camera and not with the number of frames.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from ..fusion.camera_at_rest import camera_moves
from ..geometry.curves import runs
from ..geometry.limits import MAX_AGE
from ..types import Bools, Floats
from .background import BackgroundView
from .view_alignment import Level, align, is_sound, loss_if_still, pyramid

MIN_STILL_LOSS = 1.5
"""Smallest ratio of the loss of two views for a camera at rest to the loss at their estimated poses that means that it moved: 2
to 5 for rendered cameras that move by 1 cm or more, at most 1.3 for cameras at rest with hands in front of them and flickering
light. The excess must also exceed the same fraction of the loss of noise, since a few pixels of one color agree exactly at any
pose."""

MOTION_NOTE = "sequence: the camera moves: its motion is estimated from the background (give its poses if they are known)"
"""Note on a capture whose objects are followed in the world frame."""

UNTRUSTED_NOTE = (
    "sequence: the camera seems to move, but the background does not tell how: it is taken to stand still; "
    "give its poses (--input-option trajectory=FILE)"
)
"""Note on a capture whose camera seems to move in an unknown way."""


@dataclass(frozen=True)
class CameraMotion:
    """The motion of the camera of a capture, estimated from its frames.

    Attributes
    ----------
    poses
        (T, 4, 4) m, camera to the frame of the first camera; None if the camera stands still, or is assumed to.
    notes
        sentences for the user; empty if the camera stands still.
    """

    poses: Floats | None = None
    notes: tuple[str, ...] = ()


def estimate_motion(view_of: Callable[[int], BackgroundView | None], count: int, max_gap: int) -> CameraMotion:
    """Estimate the motion of the camera of a capture.

    First one frame of each second and the last one are compared, to decide whether the camera moves at all.

    Parameters
    ----------
    view_of
        function that returns the background of frame 0, 1, ...; None if the frame has none.
    count
        number of frames.
    max_gap
        largest number of successive frames whose pose may be unknown, and is interpolated.
    """
    some = _CameraTracker(map(view_of, sorted({*range(0, count, MAX_AGE), count - 1} - {-1})))
    if not some.moves and not some.is_lost:
        return CameraMotion()
    tracker = _CameraTracker(map(view_of, range(count)))
    if not tracker.moves:
        return CameraMotion()
    known = np.array([pose is not None for pose in tracker.poses], dtype=bool)
    given = np.array([pose for pose in tracker.poses if pose is not None])
    lost = max((end - first for first, end in runs(~known)), default=0)
    if lost > max_gap or not camera_moves(given):
        return CameraMotion(notes=(UNTRUSTED_NOTE,))
    return CameraMotion(_interpolate(given, known), (MOTION_NOTE,))


class _CameraTracker:
    """Tracker of a camera from view to view.

    Attributes
    ----------
    poses
        (4, 4) m, for each view the pose in the frame of the first one; None where unknown.
    is_lost
        whether some view could not be aligned with an earlier one.
    """

    def __init__(self, views: Iterable[BackgroundView | None]) -> None:
        self.poses: list[Floats | None] = []
        self.is_lost = False
        self._losses = np.zeros(2)  # over moved views: excess loss if the camera stood still, and loss; 1 is noise
        self._key: list[Level] | None = None
        self._last: list[Level] | None = None
        self._to_key: Floats = np.eye(4)  # pose of the key view in the frame of the first
        self._to_last: Floats = np.eye(4)  # pose of the last view in the frame of the first
        self._motion: Floats = np.eye(4)  # between the last two views, expected again
        for view in views:
            self._add(view)

    @property
    def moves(self) -> bool:
        """Whether the views fit far better with a moving camera than with one at rest."""
        return bool(self._losses[0] > (MIN_STILL_LOSS - 1) * self._losses[1])

    def _add(self, view: BackgroundView | None) -> None:
        """Align the next view, and append its pose."""
        levels = None if view is None else pyramid(view)
        if self._key is None or self._last is None or levels is None:
            has_depth = levels is not None and np.isfinite(levels[0][1]).any()
            self.poses.append(np.eye(4) if has_depth else None)
            if has_depth:
                self._key = self._last = levels
            return
        found = align(self._key, levels, np.linalg.inv(self._to_last @ self._motion) @ self._to_key)
        if found is None and self._last is not self._key:
            found = align(self._last, levels, np.linalg.inv(self._motion))
            if found is not None:
                self._key, self._to_key = self._last, self._to_last
        if found is None:
            self.is_lost = True
            self.poses.append(None)
            return
        pose = self._to_key @ np.linalg.inv(found.pose)
        if camera_moves(np.array([np.eye(4), found.pose])):
            self._losses += loss_if_still(found, self._key[0], levels[0]) - found.loss, max(found.loss, 1.0)
        sound = is_sound(found, self._key[0], levels[0])
        self.poses.append(pose if sound else None)
        if sound and np.isfinite(levels[0][1]).any():
            self._motion = np.linalg.inv(self._to_last) @ pose
            self._last, self._to_last = levels, pose


def _interpolate(given: Floats, known: Bools) -> Floats:
    """Return the poses (T, 4, 4) of all frames, interpolated between known ones.

    given : (K, 4, 4), the known poses. known : (T,) bool, the frames of these.
    """
    at = np.flatnonzero(known)
    frames = np.clip(np.arange(len(known)), at[0], at[-1])
    result = np.tile(np.eye(4), (len(known), 1, 1))
    if len(at) > 1:
        result[:, :3, :3] = Slerp(at, Rotation.from_matrix(given[:, :3, :3]))(frames).as_matrix()
    result[:, :3, 3] = np.column_stack([np.interp(frames, at, column) for column in given[:, :3, 3].T])
    return result

"""Estimate the motion of a camera without poses from the background.

Each frame is aligned with a key frame, directly by brightness and inverse depth (Kerl et al., "Robust odometry estimation for
RGB-D cameras", 2013), starting from the previous motion. When a frame shares too little with the key frame, the frame before
it becomes the next key frame, so that drift grows with the path of the camera and not with the number of frames.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from ..fusion.fuse import MIN_CAMERA_MOTION_M, camera_moves
from ..geometry.curves import runs
from ..geometry.limits import MAX_AGE
from ..geometry.noise import OUTLIER_DEVIATIONS
from ..kernels import view_alignment
from ..types import Array, Bools, Floats
from .background import BackgroundView

LEVELS, STEPS, CONVERGED_PX = 3, 10, 0.05
"""Number of pyramid levels: at the coarsest one, 24 px wide, a motion of a tenth of the image is 2 px. Largest number of
Gauss-Newton steps. Step in px at which they stop: the remaining error is below noise."""

MIN_STILL_LOSS, MIN_OFF_LOSS = 1.5, 1.1
"""Smallest ratios of the loss of two views to the loss at their estimated poses. The first one, for a camera at rest,
means that the camera moved: 2 to 5 for rendered cameras that move by 1 cm or more, at most 1.3 for cameras at rest with hands in
front of them and flickering light. The excess must also exceed the same fraction of the loss of noise, since a few pixels of one
color agree exactly at any pose. The second one, with a pose off by MIN_CAMERA_MOTION_M in the worst direction, means that the
estimate is sound: at least 1.3 where it errs by less than 1 mm, at most 1.02 where the motion along a plane of one color is
unobservable."""

MOTION_NOTE = "sequence: the camera moves: its motion is estimated from the background (give its poses if they are known)"
"""Note on a capture whose objects are followed in the world frame."""

UNTRUSTED_NOTE = (
    "sequence: the camera seems to move, but the background does not tell how: it is taken to stand still; "
    "give its poses (--input-option trajectory=FILE)"
)
"""Note on a capture whose camera seems to move in an unknown way."""

Level = tuple[Array, Array, Floats]
"""Brightness and inverse depth of a view, (h, w) float32, NaN where unknown, and the intrinsics (4,) px of these pixels."""


@dataclass(frozen=True)
class _Alignment:
    """The alignment of two views at a pose.

    Attributes
    ----------
    pose
        (4, 4) m, p_second = pose @ p_first.
    light
        (2,) gain and offset of the brightness.
    equations
        (8, 9), normal equations for turn, shift, gain and offset, from the kernel `view_alignment`.
    noise
        (2,) of brightness and of inverse depth.
    loss
        mean robust loss over the pixels in both views.
    known, seen, agreeing
        numbers of pixels.
    """

    pose: Floats
    light: Floats
    equations: Floats
    noise: Floats
    loss: float
    known: int
    seen: int
    agreeing: int


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
    some = _Tracker(map(view_of, sorted({*range(0, count, MAX_AGE), count - 1} - {-1})))
    if not some.moves and not some.is_lost:
        return CameraMotion()
    tracker = _Tracker(map(view_of, range(count)))
    if not tracker.moves:
        return CameraMotion()
    known = np.array([pose is not None for pose in tracker.poses], dtype=bool)
    given = np.array([pose for pose in tracker.poses if pose is not None])
    lost = max((end - first for first, end in runs(~known)), default=0)
    if lost > max_gap or not camera_moves(given):
        return CameraMotion(notes=(UNTRUSTED_NOTE,))
    return CameraMotion(_interpolate(given, known), (MOTION_NOTE,))


class _Tracker:
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
        levels = None if view is None else _pyramid(view)
        if self._key is None or self._last is None or levels is None:
            has_depth = levels is not None and np.isfinite(levels[0][1]).any()
            self.poses.append(np.eye(4) if has_depth else None)
            if has_depth:
                self._key = self._last = levels
            return
        found = _align(self._key, levels, np.linalg.inv(self._to_last @ self._motion) @ self._to_key)
        if found is None and self._last is not self._key:
            found = _align(self._last, levels, np.linalg.inv(self._motion))
            if found is not None:
                self._key, self._to_key = self._last, self._to_last
        if found is None:
            self.is_lost = True
            self.poses.append(None)
            return
        pose = self._to_key @ np.linalg.inv(found.pose)
        if camera_moves(np.array([np.eye(4), found.pose])):
            self._losses += _loss_if_still(found, self._key[0], levels[0]) - found.loss, max(found.loss, 1.0)
        is_sound = _is_sound(found, self._key[0], levels[0])
        self.poses.append(pose if is_sound else None)
        if is_sound and np.isfinite(levels[0][1]).any():
            self._motion = np.linalg.inv(self._to_last) @ pose
            self._last, self._to_last = levels, pose


def _loss_if_still(found: _Alignment, first: Level, second: Level) -> float:
    """Return the mean loss of two views for a camera at rest, with the best light."""
    still = _compare(first, second, np.eye(4), found.light, found.noise)
    change = np.linalg.lstsq(still.equations[6:, 6:8], still.equations[6:, 8], rcond=None)[0]
    return _compare(first, second, np.eye(4), found.light + change, found.noise).loss


def _is_sound(found: _Alignment, first: Level, second: Level) -> bool:
    """Return whether two views determine their pose to MIN_CAMERA_MOTION_M (5 mm).

    The middle of the first view is displaced by as much in the second one, both ways along the direction of least resistance,
    with turn, gain and offset adapted: the loss must increase clearly.
    """
    x, y, z = found.pose[:3, 2] / np.nanmedian(first[1]) + found.pose[:3, 3]
    moved = np.array([[0, z, -y, 1, 0, 0, 0, 0], [-z, 0, x, 0, 1, 0, 0, 0], [y, -x, 0, 0, 0, 1, 0, 0]])
    spread = np.linalg.pinv(found.equations[:, :8], hermitian=True) @ moved.T
    variances, axes = np.linalg.eigh(moved @ spread)
    change = spread @ axes[:, -1] * (MIN_CAMERA_MOTION_M / max(variances[-1], np.finfo(float).tiny))
    off = (_compare(first, second, *_moved_by(found.pose, found.light, side * change), found.noise) for side in (1, -1))
    return all(each.loss >= MIN_OFF_LOSS * found.loss for each in off)


def _moved_by(pose: Floats, light: Floats, change: Floats) -> tuple[Floats, Floats]:
    """Return pose and light after a change (8,) of turn, shift, gain and offset."""
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = Rotation.from_rotvec(change[:3]).as_matrix(), change[3:6]
    return turn @ pose, light + change[6:]


def _pyramid(view: BackgroundView) -> list[Level]:
    """Return a view at all levels, each with half the resolution of the one before."""
    gray = np.where(view.gray > 0, view.gray, np.nan).astype(np.float32)
    inverse = np.where(view.inverse > 0, view.inverse, np.nan).astype(np.float32)
    levels = [(gray, inverse, view.intrinsics)]
    for _ in range(LEVELS - 1):
        gray, inverse, intrinsics = levels[-1]
        smaller = np.append(intrinsics[:2] / 2, (intrinsics[2:] - 0.5) / 2)
        levels.append((_halve(gray), _halve(inverse), smaller))
    return levels


def _halve(image: Array) -> Array:
    """Return the means of squares of 2 x 2 pixels; NaN where one of them is unknown."""
    rows, columns = image.shape[0] // 2, image.shape[1] // 2
    return np.ascontiguousarray(image[: 2 * rows, : 2 * columns].reshape(rows, 2, columns, 2).mean(axis=(1, 3)))


def _align(first: Sequence[Level], second: Sequence[Level], guess: Floats) -> _Alignment | None:
    """Return the best alignment of two views, starting from a guess of the pose.

    If the finest level alone fails, or moves a pixel or more from the guess, the coarser levels are searched, too, and the
    better result is used. None unless half of the first view agrees with the second.
    """
    if first[0][0].shape != second[0][0].shape:
        return None
    light = np.array([1.0, 0.0])
    near = _minimize(first[0], second[0], guess, light)
    if near is not None and _agrees(near):
        motion = near.pose @ np.linalg.inv(guess)
        if _image_motion(first[0], _nearness(first[0]), Rotation.from_matrix(motion[:3, :3]).as_rotvec(), motion[:3, 3]) < 1:
            return near
    far: _Alignment | None = None
    for level in reversed(range(LEVELS)):
        far = _minimize(first[level], second[level], guess, light)
        if far is None:
            break
        guess, light = far.pose, far.light
    if far is not None and near is not None:
        far = _compare(first[0], second[0], far.pose, far.light, near.noise)
    best = min((each for each in (near, far) if each is not None), key=lambda each: each.loss, default=None)
    return best if _agrees(best) else None


def _agrees(found: _Alignment | None) -> bool:
    """Return whether half of the first view agrees with the second."""
    return found is not None and 2 * found.agreeing >= found.known


def _nearness(level: Level) -> float:
    """Return the median inverse depth of a view, 1/m; 0 without depth."""
    return float(np.nanmedian(level[1])) if np.isfinite(level[1]).any() else 0.0


def _image_motion(level: Level, nearness: float, turn: Floats, shift: Floats) -> float:
    """Return the largest image motion of a small turn (3,) rad and shift (3,) m, px.

    nearness : 1/m, inverse depth of the view.
    """
    return float(level[2][0] * (np.linalg.norm(turn) + nearness * np.linalg.norm(shift)))


def _minimize(first: Level, second: Level, pose: Floats, light: Floats) -> _Alignment | None:
    """Align two views by Gauss-Newton steps; None if they overlap too little."""
    nearness = _nearness(first)
    for _ in range(STEPS):
        found = _compare(first, second, pose, light)
        if 2 * found.seen < found.known or not found.seen:
            return None
        change = np.linalg.lstsq(found.equations[:, :8], found.equations[:, 8], rcond=None)[0]
        pose, light = _moved_by(pose, light, change)
        if _image_motion(first, nearness, change[:3], change[3:6]) < CONVERGED_PX:
            break
    return replace(found, pose=pose, light=light)


def _compare(first: Level, second: Level, pose: Floats, light: Floats, noise: Floats | None = None) -> _Alignment:
    """Return the alignment of two views at a pose.

    noise : (2,) of brightness and inverse depth; None estimates it from the differences.
    """
    given = np.zeros(2) if noise is None else noise
    equations, summary = view_alignment(*first[:2], *second[:2], first[2], pose, light, given, OUTLIER_DEVIATIONS)
    known, seen, agreeing = summary[4:].astype(int).tolist()
    return _Alignment(pose, light, equations, summary[:2], float(summary[2:4].sum()) / max(seen, 1), known, seen, agreeing)


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

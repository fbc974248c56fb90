"""Align two views of a background directly by brightness and inverse depth."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from ..fusion.camera_at_rest import MIN_CAMERA_MOTION_M
from ..geometry.noise import OUTLIER_DEVIATIONS
from ..kernels import view_alignment
from ..types import Array, Floats
from .background import BackgroundView

LEVELS, STEPS, CONVERGED_PX = 3, 10, 0.05
"""Number of pyramid levels: at the coarsest one, 24 px wide, a motion of a tenth of the image is 2 px. Largest number of
Gauss-Newton steps. Step in px at which they stop: the remaining error is below noise."""

MIN_OFF_LOSS = 1.1
"""Smallest ratio of the loss with a pose off by MIN_CAMERA_MOTION_M in the worst direction to the loss at the estimated pose that
means that the estimate is sound: at least 1.3 where it errs by less than 1 mm, at most 1.02 where the motion along a plane of one
color is unobservable."""

Level = tuple[Array, Array, Floats]
"""Brightness and inverse depth of a view, (h, w) float32, NaN where unknown, and the intrinsics (4,) px of these pixels."""


@dataclass(frozen=True)
class Alignment:
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


def loss_if_still(found: Alignment, first: Level, second: Level) -> float:
    """Return the mean loss of two views for a camera at rest, with the best light."""
    still = _compare(first, second, np.eye(4), found.light, found.noise)
    change = np.linalg.lstsq(still.equations[6:, 6:8], still.equations[6:, 8], rcond=None)[0]
    return _compare(first, second, np.eye(4), found.light + change, found.noise).loss


def is_sound(found: Alignment, first: Level, second: Level) -> bool:
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


def pyramid(view: BackgroundView) -> list[Level]:
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


def align(first: Sequence[Level], second: Sequence[Level], guess: Floats) -> Alignment | None:
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
    far: Alignment | None = None
    for level in reversed(range(LEVELS)):
        far = _minimize(first[level], second[level], guess, light)
        if far is None:
            break
        guess, light = far.pose, far.light
    if far is not None and near is not None:
        far = _compare(first[0], second[0], far.pose, far.light, near.noise)
    best = min((each for each in (near, far) if each is not None), key=lambda each: each.loss, default=None)
    return best if _agrees(best) else None


def _agrees(found: Alignment | None) -> bool:
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


def _minimize(first: Level, second: Level, pose: Floats, light: Floats) -> Alignment | None:
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


def _compare(first: Level, second: Level, pose: Floats, light: Floats, noise: Floats | None = None) -> Alignment:
    """Return the alignment of two views at a pose.

    noise : (2,) of brightness and inverse depth; None estimates it from the differences.
    """
    given = np.zeros(2) if noise is None else noise
    equations, summary = view_alignment(*first[:2], *second[:2], first[2], pose, light, given, OUTLIER_DEVIATIONS)
    known, seen, agreeing = summary[4:].astype(int).tolist()
    return Alignment(pose, light, equations, summary[:2], float(summary[2:4].sum()) / max(seen, 1), known, seen, agreeing)

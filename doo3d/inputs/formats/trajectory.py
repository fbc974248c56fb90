"""Camera poses from a file in the format of the TUM RGB-D benchmark, for captures that have none of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...types import Floats
from ..capture import Capture, FrameData, FrameRef
from ..support.poses import interpolate_pose

_UNIT = 1e-2  # by which a quaternion's length may differ from 1: those in files are rounded


@dataclass(frozen=True)
class Trajectory:
    """Poses at times.

    times : (N,) s, rising. poses : (N, 4, 4), camera to world: x_world = pose @ x_camera.
    """

    times: Floats
    poses: Floats

    def at(self, time: float, tolerance: float) -> Floats | None:
        """(4, 4) the pose at a time.

        Between two poses that are both no farther off than `tolerance` (s) it lies between them: along the line, and by the
        same share of the turn (slerp). Where one is near it is that one, and None where none is.
        """
        after = int(np.searchsorted(self.times, time))
        near = [i for i in (after - 1, after) if 0 <= i < len(self.times) and abs(self.times[i] - time) <= tolerance]
        if not near:
            return None
        first, last = near[0], near[-1]
        if first == last:
            return np.asarray(self.poses[first])
        share = (time - self.times[first]) / (self.times[last] - self.times[first])
        return interpolate_pose(self.poses[first], self.poses[last], float(share))


def pose_from(quaternion: Sequence[float] | Floats, position: Sequence[float] | Floats, where: str) -> Floats:
    """(4, 4) from qx, qy, qz, qw of length 1 and x, y, z.

    Raises
    ------
    InputError : the length is another, or a number is not finite.
    """
    from scipy.spatial.transform import Rotation

    turn = np.asarray(quaternion, dtype=float)
    length = float(np.linalg.norm(turn))
    if not abs(length - 1) <= _UNIT or not np.isfinite(position).all():
        raise InputError(
            f"{where}: the quaternion qx, qy, qz, qw has length {length:.3g}, expected 1 (and finite numbers)",
            code="pose-invalid",
        )
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(turn).as_matrix()
    pose[:3, 3] = position
    return pose


def read_lines(path: Path, columns: int, what: str) -> list[tuple[int, list[str]]]:
    """The rows of a text file with their line numbers; empty lines and those that start with # left out.

    Raises
    ------
    InputError : it is not there or no text, holds no row, or one with fewer than `columns` words.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError:
        raise InputError(f"{path}: is missing", code="file-missing") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})", code="file-unreadable") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not a text file, expected lines of {what}", code="file-not-text") from None
    rows = [
        (number, line.replace(",", " ").split())
        for number, line in enumerate(lines, 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows:
        raise InputError(f"{path}: is empty, expected lines of {what}", code="file-empty")
    for number, words in rows:
        if len(words) < columns:
            raise InputError(
                f"{path}: line {number} has {len(words)} columns, expected {what}: is the file cut off?", code="line-invalid"
            )
    return rows


def rising(path: Path, rows: list[tuple[int, list[str]]]) -> Floats:
    """(N,) s, the first column of rows as times.

    Raises
    ------
    InputError : one is not a number, or not after the one before it.
    """
    times = np.array([_number(path, number, words[0]) for number, words in rows])
    for i in np.flatnonzero(np.diff(times) <= 0)[:1]:
        raise InputError(
            f"{path}: line {rows[i + 1][0]}: time {rows[i + 1][1][0]} is not after {rows[i][1][0]} before it: sort it",
            code="times-not-rising",
        )
    return times


def read_trajectory(path: Path) -> Trajectory:
    """Poses of a file of lines `time tx ty tz qx qy qz qw`: s, m, camera to world.

    Raises
    ------
    InputError : it cannot be read, or a line is none of these; the message names the line.
    """
    rows = read_lines(path, 8, "time tx ty tz qx qy qz qw")
    times = rising(path, rows)
    values = [[_number(path, number, word) for word in words[1:8]] for number, words in rows]
    poses = [pose_from(row[3:], row[:3], f"{path}: line {number}") for (number, _), row in zip(rows, values, strict=True)]
    return Trajectory(times, np.array(poses))


class PosedCapture:
    """A capture with the poses of a file instead of its own.

    A frame with a time gets the pose at that time, where there is one within `tolerance` s. Where no frame has a time, poses
    and frames belong together by order, if there are equally many.
    """

    def __init__(self, capture: Capture, file: Path, tolerance: float) -> None:
        self.path, self.format = capture.path, capture.format
        found = read_trajectory(file)
        poses = _by_time(capture, found, tolerance, file) if _timed(capture) else _by_order(capture, found, file)
        self.frames: Sequence[FrameRef] = [
            replace(entry, loader=partial(_load, entry, pose)) for entry, pose in zip(capture.frames, poses, strict=True)
        ]


def _timed(capture: Capture) -> bool:
    return any(entry.timestamp is not None for entry in capture.frames)


def _by_time(capture: Capture, found: Trajectory, tolerance: float, file: Path) -> list[Floats | None]:
    times = [entry.timestamp for entry in capture.frames]
    poses = [None if time is None else found.at(time, tolerance) for time in times]
    if all(pose is None for pose in poses):
        known = [time for time in times if time is not None]
        raise InputError(
            f"{file}: its poses are from {found.times[0]} to {found.times[-1]} s, the frames from {min(known)} to "
            f"{max(known)} s: none is within {tolerance} s of another (--input-option tolerance=...)",
            code="times-apart",
        )
    return poses


def _by_order(capture: Capture, found: Trajectory, file: Path) -> list[Floats | None]:
    if len(found.times) != len(capture.frames):
        raise InputError(
            f"{file}: has {len(found.times)} poses but {capture.path} has {len(capture.frames)} frames without times: "
            "give one line per frame",
            code="frame-count",
        )
    return list(found.poses)


def _load(entry: FrameRef, pose: Floats | None) -> FrameData:
    return replace(entry.load(), pose=pose)


def _number(path: Path, line: int, word: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f"{path}: line {line}: {word!r} is not a finite number", code="line-invalid")
    return value

"""Read text tables with times, and camera poses in the format of the TUM RGB-D benchmark."""

from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...guard.guarding import read_bytes
from ...types import Floats
from ..support.depth_frames import numbers

Row = tuple[int, list[str]]
"""Number of a line from 1, and its words."""
_MAX_TABLE_BYTES = 1 << 26  # of a table
_MAX_ROWS = 1_000_000  # nine hours at 30 Hz
_MAX_LINE_LETTERS = 10_000  # a row has a few numbers and names of files
_MAX_NORM_ERROR = 1e-2  # of a quaternion: those in files are rounded


@dataclass(frozen=True)
class Trajectory:
    """Camera poses over time.

    Attributes
    ----------
    times
        (N,) s, increasing, of N poses.
    poses
        (N, 4, 4), camera to world: x_world = pose @ x_camera, m.
    notes
        repairs made while reading: a sentence if the lines were not sorted by time.
    """

    times: Floats
    poses: Floats
    notes: tuple[str, ...] = ()

    def at(self, time: float, tolerance: float) -> Floats | None:
        """Return the (4, 4) pose at a time (s), or None if no pose is within `tolerance` (s) of it.

        If the nearest poses before and after the time are both within the tolerance, the pose is interpolated between them:
        linearly in position, by slerp in rotation. If only one of the two is within the tolerance, that pose is returned.
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


def interpolate_pose(one: Floats, other: Floats, share: float) -> Floats:
    """Return the (4, 4) pose between two (4, 4) poses: linear in position, slerp in rotation.

    `share` is the fraction of the path from `one` to `other`, 0 to 1: 0 gives `one`, 1 gives `other`.
    """
    from scipy.spatial.transform import Rotation

    rotation = Rotation.from_matrix(one[:3, :3].T @ other[:3, :3]).as_rotvec()
    pose = np.eye(4)
    pose[:3, :3] = one[:3, :3] @ Rotation.from_rotvec(share * rotation).as_matrix()
    pose[:3, 3] = (1 - share) * one[:3, 3] + share * other[:3, 3]
    return pose


def matrix(values: Floats | tuple[float, ...]) -> Floats:
    """Return a (4, 4) transform from seven values: translation x, y, z, then quaternion x, y, z, w (scalar last).

    A quaternion of length zero gives the identity rotation.
    """
    from scipy.spatial.transform import Rotation

    transform = np.eye(4)
    transform[:3, 3] = values[:3]
    if np.linalg.norm(values[3:]) > 0:
        transform[:3, :3] = Rotation.from_quat(values[3:]).as_matrix()
    return transform


def pose_from(quaternion: Sequence[float] | Floats, position: Sequence[float] | Floats, where: str) -> Floats:
    """Return the (4, 4) transform [R, t; 0, 0, 0, 1] of a unit quaternion (R) and a position (t).

    Parameters
    ----------
    quaternion
        the rotation R as (qx, qy, qz, qw), scalar last.
    position
        the translation t as (x, y, z) in m.
    where
        file and line, named in the error.

    Raises
    ------
    InputError : the quaternion's length differs from 1 by more than 0.01, or a number is not finite.
    """
    length = float(np.linalg.norm(quaternion))
    if not abs(length - 1) <= _MAX_NORM_ERROR or not np.isfinite(position).all():
        sentence = f"the quaternion qx, qy, qz, qw has length {length:.3g}, expected 1 (and finite numbers)"
        raise InputError(f"{where}: {sentence}", code="pose-invalid")
    return matrix((*position, *quaternion))


def read_lines(path: Path, columns: int, layout: str) -> list[Row]:
    """Read a table from a text file: return a list of (line number from 1, words), one per row.

    Words are separated by blanks or commas. Empty lines and comment lines (#) are left out.

    Parameters
    ----------
    path
        the file.
    columns
        least number of words in a row; rows may have more.
    layout
        description of a row for the error message, such as "time and file name".

    Raises
    ------
    InputError : the file is missing or not text, has no rows, or has a row with fewer words.
    """
    try:
        lines = StringIO(read_bytes(path, _MAX_TABLE_BYTES).decode("utf-8-sig"), newline=None)
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not a text file, expected lines of {layout}", code="file-not-text") from None
    rows = list[Row]()
    for number, line in enumerate(map(str.strip, lines), 1):
        if len(rows) == _MAX_ROWS or len(line) > _MAX_LINE_LETTERS:
            limits = f"{_MAX_ROWS} rows, or than {_MAX_LINE_LETTERS} letters in line {number}"
            raise InputError(f"{path}: has more than {limits}, expected lines of {layout}", code="size-too-large")
        if line and not line.startswith("#"):
            rows.append((number, line.replace(",", " ").split()))
    if not rows:
        raise InputError(f"{path}: is empty, expected lines of {layout}", code="file-empty")
    if short := [(number, len(words)) for number, words in rows if len(words) < columns]:
        number, count = short[0]
        sentence = f"{path}: line {number} has {count} columns, expected {layout}: is the file cut off?"
        raise InputError(sentence, code="line-invalid")
    return rows


def sort_by_time(path: Path, rows: list[Row]) -> tuple[Floats, list[Row], list[str]]:
    """Return the rows of a table in order of the times in their first words.

    `rows` is the table that `read_lines` read from `path`: (line number, words) per row. If rows have equal times, the first is
    kept.

    Returns
    -------
    (times, rows, notes): times (N,) s, increasing; the N rows of these times; a sentence if rows were sorted, another if some
    were left out.

    Raises
    ------
    InputError : a time is not a number; the message has file and line.
    """
    given = np.array([numbers(words[:1], 1, f"{path}: line {number}", "line-invalid")[0] for number, words in rows])
    times, first = np.unique(given, return_index=True)
    notes = []
    if len(earlier := np.flatnonzero(np.diff(given) < 0)):
        line = rows[earlier[0] + 1][0]
        notes.append(f"the lines of {path.name} are not in order of time (line {line} is the first too early): they were sorted")
    if len(times) < len(rows):
        notes.append(f"{len(rows) - len(times)} lines of {path.name} have the time of an earlier line: they are left out")
    return times, [rows[i] for i in first.tolist()], notes


def associate(one: Floats, other: Floats, tolerance: float) -> list[tuple[int, int]]:
    """Pair the times of two lists that are nearest to each other, each time in one pair at most.

    Pairs within the tolerance are chosen in order of increasing difference, as by the benchmark's associate.py.

    Parameters
    ----------
    one, other
        times in s, increasing: (N,) and (M,).
    tolerance
        largest time difference within a pair, s.

    Returns
    -------
    The index into `one` and the index into `other` of each pair; the indices into `one` increase.
    """
    low, high = np.searchsorted(other, one - tolerance), np.searchsorted(other, one + tolerance, side="right")
    near = [(abs(one[i] - other[j]), i, j) for i in range(len(one)) for j in range(low[i], high[i])]
    pairs: dict[int, int] = {}
    used: set[int] = set()
    for _, i, j in sorted(near):
        if i not in pairs and j not in used:
            pairs[i] = j
            used.add(j)
    return sorted(pairs.items())


def read_trajectory(path: Path) -> Trajectory:
    """Read a trajectory file in the format of the TUM benchmark, with lines `time tx ty tz qx qy qz qw`.

    Times are in s, positions in m; the poses are camera to world. Lines are sorted by time, with a note.

    Raises
    ------
    InputError : the file cannot be read, or a line has another layout; the message names the line.
    """
    times, rows, notes = sort_by_time(path, read_lines(path, 8, "time tx ty tz qx qy qz qw"))
    poses = []
    for number, words in rows:
        where = f"{path}: line {number}"
        values = numbers(words[1:8], 7, where, "line-invalid")
        poses.append(pose_from(values[3:], values[:3], where))
    return Trajectory(times, np.array(poses), tuple(notes))

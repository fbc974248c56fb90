"""Carry what is hidden of an object over time, from where it was seen last and is seen next."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from ..geometry.curves import runs
from ..types import Bools, Floats, Ints

NEAR = 0.4
"""m of an object whose motion a hidden part beside it follows: less turns with each bend, and more does not turn with the part.
All 480 frames of four dragged cables are right, and 446 with 0.2 m; with 0.6 m fewer frames of stereo cameras are."""


def carried(joints: Floats, seen: Bools, segment: float) -> Floats:
    """Return the joints (T, M, 3) m of an open object with those that are hidden carried from other frames.

    A hidden joint is where it was when it was seen last, moved and turned since as the seen joints near it have; the same from
    when it is seen next, and both averaged by how near they are in time. Joints that are never seen stay, and all joints of a
    frame that shows nothing.

    seen : (T, M) bool, which joints the frames show. segment : m, distance of neighboring joints.
    """
    frames = np.arange(len(seen))[:, None]
    last = np.maximum.accumulate(np.where(seen, frames, -1), axis=0)
    later = np.minimum.accumulate(np.where(seen, frames, len(seen))[::-1], axis=0)[::-1]
    result = joints.copy()
    for frame in np.flatnonzero(seen.any(axis=1) & ~seen.all(axis=1)).tolist():
        for hidden in _parts(~seen[frame], last[frame], later[frame]):
            before, after = int(last[frame, hidden[0]]), int(later[frame, hidden[0]])
            starts = [start for start in (before, after) if 0 <= start < len(seen)]
            if starts and all((seen[start] & seen[frame]).any() for start in starts):
                lines = [_moved(joints, seen, start, frame, hidden, segment) for start in starts]
                share = (frame - before) / (after - before)
                result[frame, hidden] = (1 - share) * lines[0] + share * lines[-1]
    return result


def _parts(hidden: Bools, last: Ints, later: Ints) -> Iterator[Ints]:
    """Yield the indices of successive hidden joints (M,) that were seen in the same frame last, and are in the same one next."""
    for first, end in runs(hidden):
        edges = np.flatnonzero((np.diff(last[first:end]) != 0) | (np.diff(later[first:end]) != 0)) + 1
        yield from np.split(np.arange(first, end), edges)


def _moved(joints: Floats, seen: Bools, start: int, frame: int, hidden: Ints, segment: float) -> Floats:
    """Return successive hidden joints of frame `start`, (K, 3) m, moved and turned to another frame as those near them.

    A part between two that are seen follows both, by how near they are. At least one joint is seen in both frames.
    """
    known = np.flatnonzero(seen[start] & seen[frame])
    away = np.maximum(hidden[0] - known, known - hidden[-1])
    near = known[np.argsort(away, kind="stable")[: round(NEAR / segment)]]
    turn = _rotation(joints[start, near], joints[frame, near], segment)
    at = int(np.searchsorted(known, hidden[0]))
    sides = known[max(0, at - 1) : at + 1].tolist()
    lines: list[Floats] = [joints[frame, side] + turn.apply(joints[start, hidden] - joints[start, side]) for side in sides]
    share = ((hidden - sides[0]) / max(1, sides[-1] - sides[0]))[:, None]
    return np.asarray((1 - share) * lines[0] + share * lines[-1])


def _rotation(before: Floats, after: Floats, least: float) -> Rotation:
    """Return the rotation that turns points (K, 3) most nearly to others (Kabsch, Acta Cryst. 1976).

    least : m, as if points so far off had not turned: a straight line does not tell how far it turns round itself.
    """
    still = least * np.eye(3)
    return Rotation.align_vectors(*(np.vstack((points - points.mean(axis=0), still)) for points in (after, before)))[0]

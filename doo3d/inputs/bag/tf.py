"""Where frames are at a time, by the transforms of a bag (tf2_msgs/TFMessage), each of a child in its parent."""

from __future__ import annotations

from array import array
from collections.abc import Iterator

import numpy as np

from ...types import Floats
from ..support.poses import interpolate_pose

FIXED = ("map", "odom", "world")
"""Frames that stand still (REP 105); the first that a camera hangs on is its world."""
_GAP = 1.0  # s: farther apart, two transforms do not tell where a moving frame was between them
_MAX_DEPTH = 100  # of the tree; more is a circle


class Transforms:
    """The tree of frames. Each child keeps its parents' seven numbers per message: translation, quaternion x y z w."""

    def __init__(self) -> None:
        self._parents: dict[str, str] = {}
        self._static: dict[str, Floats] = {}
        self._times: dict[str, array[int]] = {}
        self._values: dict[str, array[float]] = {}

    def add(self, parent: str, child: str, time: int, values: tuple[float, ...], static: bool) -> None:
        """One transform, from coordinates in `child` to coordinates in `parent`, passed over if not finite. time : ns."""
        if not np.isfinite(values).all():
            return
        parent, child = parent.lstrip("/"), child.lstrip("/")
        if static:
            self._static[child] = matrix(values)
            self._parents[child] = parent
        elif child not in self._static:
            if self._parents.setdefault(child, parent) == parent:  # a second parent would be another tree
                self._times.setdefault(child, array("q")).append(time)
                self._values.setdefault(child, array("d")).extend(values)

    def finish(self) -> None:
        """Put the transforms of each frame in the order of time, after the last one was added."""
        for child, times in self._times.items():
            order = np.argsort(np.array(times), kind="stable")
            self._times[child] = array("q", np.array(times)[order].tolist())
            self._values[child] = array("d", np.array(self._values[child]).reshape(-1, 7)[order].ravel().tolist())

    def pose(self, frame: str, time: int) -> Floats | None:
        """(4, 4) from `frame` to the fixed frame that it hangs on; None where there is none, or not at this time (ns)."""
        above = [name for name, _ in self._chain(frame)]
        world = next((name for name in FIXED if name in above), None)
        return None if world is None else self._up(frame, world, time)

    def between(self, source: str, target: str, time: int) -> Floats | None:
        """(4, 4) from coordinates in `source` to coordinates in `target`; None where the two do not hang together."""
        if source == target:
            return np.eye(4)
        above = {name for name, _ in self._chain(target)} | {target}
        shared = next((name for name in [source, *(name for name, _ in self._chain(source))] if name in above), None)
        if shared is None:
            return None
        up, down = self._up(source, shared, time), self._up(target, shared, time)
        return None if up is None or down is None else np.linalg.inv(down) @ up

    def _chain(self, frame: str) -> Iterator[tuple[str, str]]:
        """Parent and child, from `frame` upwards."""
        for _ in range(_MAX_DEPTH):
            parent = self._parents.get(frame)
            if parent is None:
                return
            yield parent, frame
            frame = parent

    def _up(self, frame: str, ancestor: str, time: int) -> Floats | None:
        total = np.eye(4)
        if frame == ancestor:
            return total
        for parent, child in self._chain(frame):
            step = self._static[child] if child in self._static else self._at(child, time)
            if step is None:
                return None
            total = step @ total
            if parent == ancestor:
                return total
        return None

    def _at(self, child: str, time: int) -> Floats | None:
        times = np.frombuffer(self._times[child], dtype=np.int64)
        values = np.frombuffer(self._values[child], dtype=float).reshape(-1, 7)
        after = int(np.searchsorted(times, time))
        if after < len(times) and times[after] == time:
            return matrix(tuple(values[after]))
        if after in (0, len(times)):  # before the first or after the last: as that one, if it is near
            end = min(after, len(times) - 1)
            return matrix(tuple(values[end])) if abs(int(times[end]) - time) <= _GAP / 10 * 1e9 else None
        start, stop = int(times[after - 1]), int(times[after])
        if stop - start > _GAP * 1e9:
            return None
        return interpolate_pose(matrix(tuple(values[after - 1])), matrix(tuple(values[after])), (time - start) / (stop - start))


def matrix(values: tuple[float, ...]) -> Floats:
    """(4, 4) of a translation and a quaternion, x y z and x y z w; a quaternion of length zero is no turn."""
    from scipy.spatial.transform import Rotation

    found = np.eye(4)
    found[:3, 3] = values[:3]
    if np.linalg.norm(values[3:]) > 0:
        found[:3, :3] = Rotation.from_quat(values[3:]).as_matrix()
    return found

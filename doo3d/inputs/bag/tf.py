"""Poses of frames over time from the transforms of a bag (tf2_msgs/TFMessage), each of a child in its parent."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...types import Floats, Ints
from ..formats.trajectory import interpolate_pose, matrix

FIXED = ("map", "odom", "world")
"""Fixed frames (REP 105) in order of preference; the first one above a camera in the tree is its world."""
_MAX_GAP_S = 1.0  # two transforms farther apart do not determine a moving frame's pose between them
_MAX_EXTRAPOLATION_S = _MAX_GAP_S / 10  # before the first and after the last transform
_MAX_DEPTH = 100  # levels of the tree; more means a cycle


class Transforms:
    """A tree of coordinate frames (tf), with the transform of each frame to its parent over time.

    Add all transforms with `add`, call `finish` once, then ask for a `pose` or the transform `between` two frames.
    """

    def __init__(self) -> None:
        self._parents: dict[str, str] = {}
        self._static: dict[str, Floats] = {}
        self._times: dict[str, list[int]] = {}
        self._values: dict[str, list[tuple[float, ...]]] = {}
        self._tracks: dict[str, tuple[Ints, Floats]] = {}

    def add(self, parent: str, child: str, time: int, values: tuple[float, ...], static: bool) -> None:
        """Add the transform of one message, child to parent: x_parent = T @ x_child.

        A transform with a value that is not finite is skipped. A transform that is not static is skipped too if `child` already
        has a static transform or another parent.

        Parameters
        ----------
        parent, child
            names of the frames, with or without a leading slash.
        time
            time of the transform, ns; ignored if `static`.
        values
            x, y, z in m, then the quaternion x, y, z, w.
        static
            whether the transform is valid at all times.
        """
        if not np.isfinite(values).all():
            return
        parent, child = parent.lstrip("/"), child.lstrip("/")
        if static:
            self._static[child] = matrix(values)
            self._parents[child] = parent
        elif child not in self._static:
            if self._parents.setdefault(child, parent) == parent:  # a second parent would make it no tree
                self._times.setdefault(child, []).append(time)
                self._values.setdefault(child, []).append(values)

    @property
    def frames(self) -> list[str]:
        """The names of all coordinate frames in the tree, sorted."""
        return sorted({*self._parents, *self._parents.values()})

    def finish(self) -> None:
        """Sort the transforms of each frame by time; call this once, after the last `add` and before `pose` or `between`."""
        for child, times in self._times.items():
            order = np.argsort(times, kind="stable")
            self._tracks[child] = np.array(times, np.int64)[order], np.array(self._values[child])[order]

    def pose(self, frame: str, time: int) -> Floats | None:
        """Return the (4, 4) pose of a frame in the world at a time (ns): x_world = pose @ x_frame, m.

        The world is the first of the frames "map", "odom" and "world" that is above `frame` in the tree. Between two transforms
        at most 1 s apart, the pose is interpolated. Up to 0.1 s before the first transform the first one is used, up to 0.1 s
        after the last transform the last one. None if the tree has none of the three frames, or no transform at this time.
        """
        ancestors = [name for name, _ in self._chain(frame)]
        world = next((name for name in FIXED if name in ancestors), None)
        return None if world is None else self._to_ancestor(frame, world, time)

    def between(self, source: str, target: str, time: int) -> Floats | None:
        """Return the (4, 4) transform T between two frames at a time (ns): x_target = T @ x_source, m.

        Transforms are interpolated over gaps of up to 1 s. None if the two frames are not connected in the tree, or a transform
        between them is unknown at this time.
        """
        if source == target:
            return np.eye(4)
        ancestors = {name for name, _ in self._chain(target)} | {target}
        shared = next((name for name in [source, *(name for name, _ in self._chain(source))] if name in ancestors), None)
        if shared is None:
            return None
        from_source, from_target = (self._to_ancestor(frame, shared, time) for frame in (source, target))
        return None if from_source is None or from_target is None else np.linalg.inv(from_target) @ from_source

    def _chain(self, frame: str) -> Iterator[tuple[str, str]]:
        """Yield parent and child, from `frame` upwards."""
        for _ in range(_MAX_DEPTH):
            parent = self._parents.get(frame)
            if parent is None:
                return
            yield parent, frame
            frame = parent

    def _to_ancestor(self, frame: str, ancestor: str, time: int) -> Floats | None:
        total = np.eye(4)
        if frame == ancestor:
            return total
        for parent, child in self._chain(frame):
            step = self._static[child] if child in self._static else self._transform_at(child, time)
            if step is None:
                return None
            total = step @ total
            if parent == ancestor:
                return total
        return None

    def _transform_at(self, child: str, time: int) -> Floats | None:
        times, values = self._tracks[child]
        last = len(times) - 1
        after = int(np.searchsorted(times, time))
        if after > last or after == 0 or times[after] == time:  # that one, if it is near in time
            near = min(after, last)
            return matrix(values[near]) if abs(int(times[near]) - time) <= _MAX_EXTRAPOLATION_S * 1e9 else None
        start, stop = times[after - 1 : after + 1].tolist()
        if stop - start > _MAX_GAP_S * 1e9:
            return None
        return interpolate_pose(matrix(values[after - 1]), matrix(values[after]), (time - start) / (stop - start))


def values_of(transform: Any) -> tuple[float, ...]:
    """Return the seven values of a message geometry_msgs/Transform, as `matrix` takes them."""
    t, r = transform.translation, transform.rotation
    return t.x, t.y, t.z, r.x, r.y, r.z, r.w

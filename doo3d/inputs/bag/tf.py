"""Compute poses of coordinate frames over time from the transforms of a bag (tf2_msgs/TFMessage)."""

from __future__ import annotations

from collections.abc import Sequence
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
        after the last transform the last one. The result is None if none of the three frames is above, or there is no transform
        at this time.
        """
        path = self._path(frame)
        world = next((name for name in FIXED if name in path[1:]), None)
        return None if world is None else self._combined(path[: path.index(world)], time)

    def between(self, source: str, target: str, time: int) -> Floats | None:
        """Return the (4, 4) transform T between two frames at a time (ns): x_target = T @ x_source, m.

        Transforms are interpolated over gaps of up to 1 s. None if the two frames are not connected in the tree, or a transform
        between them is unknown at this time.
        """
        paths = [self._path(frame) for frame in (source, target)]
        shared = next((name for name in paths[0] if name in paths[1]), None)
        if shared is None:
            return None
        from_source, from_target = (self._combined(path[: path.index(shared)], time) for path in paths)
        return None if from_source is None or from_target is None else np.linalg.inv(from_target) @ from_source

    def _path(self, frame: str) -> list[str]:
        """Return a frame and those above it in the tree, from the frame upwards."""
        path = [frame]
        while len(path) <= _MAX_DEPTH and path[-1] in self._parents:
            path.append(self._parents[path[-1]])
        return path

    def _combined(self, frames: Sequence[str], time: int) -> Floats | None:
        """Return the transform from the first of successive frames to the parent of the last; None if one is unknown."""
        total = np.eye(4)
        for child in frames:
            step = self._static[child] if child in self._static else self._transform_at(child, time)
            if step is None:
                return None
            total = step @ total
        return total

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

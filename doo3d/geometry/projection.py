"""Project points to the plane of a view: by a camera, in parallel, or in 2-D."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..types import Camera, Floats


@dataclass(frozen=True)
class Projection:
    """A projection of points onto the plane of a view, as three functions.

    Attributes
    ----------
    project
        takes N points (N, D), returns their positions in the view (N, 2); NaN for points behind a camera.
    distance
        takes N points (N, D), returns their distances along the viewing direction (N,). Of two points at one position in the
        view the nearer hides the other.
    scale
        takes distances of any shape, returns in the same shape the length in the view of a unit of length at that distance
        (such as px per m); NaN behind a camera.
    """

    project: Callable[[Floats], Floats]
    distance: Callable[[Floats], Floats]
    scale: Callable[[Floats], Floats]

    @staticmethod
    def planar() -> Projection:
        """Return the projection for 2-D points, which already are positions in the view.

        `project` returns the points unchanged, `distance` 0 for every point, and `scale` 1 for every distance.
        """
        return Projection(
            lambda points: np.asarray(points[:, :2], dtype=float), lambda points: np.zeros(len(points)), np.ones_like
        )

    @staticmethod
    def of_camera(camera: Camera) -> Projection:
        """Return the pinhole projection of points in the camera frame, m, to px (u, v).

        Its `distance` is z in m, and its `scale` focal length / z, in px per m.
        """
        return Projection(camera.project, lambda points: np.asarray(points[:, 2]), _pinhole_scale(camera))

    @staticmethod
    def perspective(viewpoint: Floats, axes: Floats, camera: Camera) -> Projection:
        """Return the pinhole projection of points in m to the pixels of a posed camera.

        Distances are along the camera's forward axis in m, and the scale is in px per m.

        Parameters
        ----------
        viewpoint
            (3,) m, position of the camera in the frame of the points.
        axes
            (3, 3), rows are the camera's unit axes in the frame of the points: right, down, forward.
        camera
            the intrinsics.
        """
        return Projection(
            lambda points: camera.project((points - viewpoint) @ axes.T),
            lambda points: np.asarray((points - viewpoint) @ axes[2]),
            _pinhole_scale(camera),
        )

    @staticmethod
    def parallel(origin: Floats, axes: Floats, scale: float = 1.0, offset: Floats | float = 0.0) -> Projection:
        """Return the parallel projection of 3-D points along the forward axis of a view.

        A point's position in the view is `scale` times its coordinates along right and down, relative to `origin`, plus
        `offset`.

        Parameters
        ----------
        origin
            (3,) m, the point that is projected to `offset` and has the distance 0.
        axes
            (3, 3), rows are the unit axes of the view in the frame of the points: right, down, forward. Distances grow
            forward, in m.
        scale
            length in the view of one unit of length, such as px per m.
        offset
            (2,) position of the origin in the view.
        """
        return Projection(
            lambda points: np.asarray(scale * (points - origin) @ axes[:2].T + offset),
            lambda points: np.asarray((points - origin) @ axes[2]),
            lambda distance: np.full_like(distance, scale),
        )


def _pinhole_scale(camera: Camera) -> Callable[[Floats], Floats]:
    """Return the function from distance, m, to px per m of a pinhole camera."""
    focal = float(np.sqrt(camera.fx * camera.fy))
    return lambda distance: np.asarray(focal / np.where(distance > 0, distance, np.nan))


def axes_along(direction: Floats) -> Floats:
    """Return three right-handed unit axes of a view along a direction.

    direction : (3,), the viewing direction, of any length. Returns (3, 3), rows right, down, forward.

    The forward axis is the direction, or z if its length is 0. The turn about the direction is arbitrary but always the same.
    """
    size = float(np.linalg.norm(direction))
    forward = direction / size if size > 0 else np.array((0.0, 0.0, 1.0))
    side = _cross(np.eye(3)[np.argmin(np.abs(forward))], forward)
    side /= np.linalg.norm(side)
    return np.array([side, _cross(forward, side), forward])


def _cross(first: Floats, second: Floats) -> Floats:
    """Return the cross product of two vectors (3,), ten times as fast as NumPy's."""
    (a, b, c), (x, y, z) = first.tolist(), second.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def upright_axes_along(direction: Floats) -> Floats:
    """Return three right-handed unit axes of an upright view along a direction.

    direction : (3,), the viewing direction, of any length over 0, in a frame whose y axis points down, such as a camera's
    optical frame. Returns (3, 3), rows right, down, forward.

    The forward axis is the direction, and the down axis is as near to y as possible; for a direction along y it is -z.
    """
    forward = direction / max(float(np.linalg.norm(direction)), 1e-9)
    down = np.array((0.0, 1.0, 0.0)) - forward[1] * forward
    if np.linalg.norm(down) < 1e-3:
        down = np.array((0.0, 0.0, -1.0)) + forward[2] * forward
    down /= np.linalg.norm(down)
    right = np.linalg.svd(np.array([down, forward]))[2][2]
    axes = np.array([right, down, forward])
    axes[0] *= np.sign(np.linalg.det(axes))
    return np.asarray(axes)


def spread_axes(centered: Floats) -> Floats:
    """Return three right-handed unit axes of the view of largest spread of points.

    They are the principal axes of the points, with the largest spread along "right" and the smallest along "forward". The
    largest component of "right", and that of "down", is positive.

    Parameters
    ----------
    centered
        (N, 3), N points minus their mean.

    Returns
    -------
    (3, 3), rows right, down, forward.
    """
    _, axes = np.linalg.eigh(centered.T @ centered)
    axes = axes.T[::-1].copy()
    for axis in axes[:2]:
        if axis[np.argmax(np.abs(axis))] < 0:
            axis *= -1
    axes[2] *= np.sign(np.linalg.det(axes))
    return np.asarray(axes)

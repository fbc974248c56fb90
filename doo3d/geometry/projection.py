"""Projections of points to the plane of a view: of a camera, from a viewpoint, parallel, or in 2-D."""

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
        (N, D) points -> (N, 2) positions in the view; NaN for points behind a camera.
    distance
        (N, D) points -> (N,) distance along the viewing direction. Of two points at one position the nearer hides the other.
    scale
        (...) distances -> (...) length in the view of one unit of length at that distance; NaN behind a camera.
    """

    project: Callable[[Floats], Floats]
    distance: Callable[[Floats], Floats]
    scale: Callable[[Floats], Floats]

    @staticmethod
    def planar() -> Projection:
        """Return the projection of 2-D points: their positions unchanged, distance 0, scale 1."""
        return Projection(
            lambda points: np.asarray(points[:, :2], dtype=float), lambda points: np.zeros(len(points)), np.ones_like
        )

    @staticmethod
    def of_camera(camera: Camera) -> Projection:
        """Return the pinhole projection of points in the camera's optical frame (m) to pixels; the distance is z in m."""
        return Projection(camera.project, lambda points: np.asarray(points[:, 2]), _pinhole_scale(camera))

    @staticmethod
    def perspective(viewpoint: Floats, axes: Floats, camera: Camera) -> Projection:
        """Return the pinhole projection of points (m) as a camera at a viewpoint would see them.

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
        """Return the parallel projection along the third of given axes.

        A point's position in the view is `scale` times its coordinates along right and down, plus `offset`.

        Parameters
        ----------
        origin
            (3,) m, the point at `offset` in the view and at distance 0.
        axes
            (3, 3), rows are the unit axes of the view in the frame of the points: right, down, forward. Distance grows forward.
        scale
            length in the view of one unit of length.
        offset
            (2,) position of the origin in the view.
        """
        return Projection(
            lambda points: np.asarray(scale * (points - origin) @ axes[:2].T + offset),
            lambda points: np.asarray((points - origin) @ axes[2]),
            lambda distance: np.full_like(distance, scale),
        )


def _pinhole_scale(camera: Camera) -> Callable[[Floats], Floats]:
    focal = float(np.sqrt(camera.fx * camera.fy))
    return lambda distance: np.asarray(focal / np.where(distance > 0, distance, np.nan))


def axes_along(direction: Floats) -> Floats:
    """Return the axes of a view along a direction (3,): (3, 3), rows right, down, forward.

    They are unit vectors and right-handed. The third row is the direction, or z if its length is 0. The turn about the
    direction is arbitrary but always the same.
    """
    size = float(np.linalg.norm(direction))
    forward = direction / size if size > 0 else np.array((0.0, 0.0, 1.0))
    side = np.cross(np.eye(3)[np.argmin(np.abs(forward))], forward)
    side /= np.linalg.norm(side)
    return np.array([side, np.cross(forward, side), forward])


def upright_axes_along(direction: Floats) -> Floats:
    """Return the axes of an upright view along a direction (3,): (3, 3), rows right, down, forward.

    They are unit vectors and right-handed. The coordinates of the direction have y pointing down, as in a camera's optical
    frame. The row "down" is as near to y as possible; for a direction along y it is -z.
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
    """Return the axes of the view that shows points most spread out: (3, 3), rows right, down, forward.

    They are the principal axes of the points, unit vectors and right-handed. The points spread most along "right" and least
    along "forward". The largest component of "right", and that of "down", is positive.

    Parameters
    ----------
    centered
        (N, 3) points less their mean.
    """
    _, axes = np.linalg.eigh(centered.T @ centered)
    axes = axes.T[::-1].copy()
    for axis in axes[:2]:
        if axis[np.argmax(np.abs(axis))] < 0:
            axis *= -1
    axes[2] *= np.sign(np.linalg.det(axes))
    return np.asarray(axes)

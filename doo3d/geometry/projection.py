"""Projections of points to the plane of a view: of a camera, from a viewpoint, parallel, or in 2-D."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..types import Camera, Floats


@dataclass(frozen=True)
class Projection:
    """Positions, distances and the scale of points in a view.

    project : (N, D) points -> (N, 2) positions in the view; NaN for points behind the camera.
    distance : (N, D) points -> (N,) distance along the view; of two points at one position the nearer hides the farther.
    scale : (...) distances -> (...) length in the view of one unit of length at that distance; NaN behind the camera.
    """

    project: Callable[[Floats], Floats]
    distance: Callable[[Floats], Floats]
    scale: Callable[[Floats], Floats]

    @staticmethod
    def planar() -> Projection:
        """Return the projection of 2-D points: unchanged, all at distance 0."""
        return Projection(
            lambda points: np.asarray(points[:, :2], dtype=float), lambda points: np.zeros(len(points)), np.ones_like
        )

    @staticmethod
    def of_camera(camera: Camera) -> Projection:
        """Return the pinhole projection of points in the camera frame, m, to pixels; the distance is z."""
        return Projection(camera.project, lambda points: np.asarray(points[:, 2]), _pinhole_scale(camera))

    @staticmethod
    def perspective(viewpoint: Floats, axes: Floats, camera: Camera) -> Projection:
        """Return the pinhole projection from a viewpoint.

        Parameters
        ----------
        viewpoint
            (3,) m.
        axes
            (3, 3), rows: right, down and forward.
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
        """Return the parallel projection: `scale * (points - origin)` along the first two axes, plus `offset`.

        Parameters
        ----------
        origin
            (3,) m; points there have distance 0.
        axes
            (3, 3), rows: right, down and forward.
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
    """Return a right-handed system whose third axis is the direction: (3, 3), rows; z for a direction of length 0."""
    size = float(np.linalg.norm(direction))
    forward = direction / size if size > 0 else np.array((0.0, 0.0, 1.0))
    side = np.cross(np.eye(3)[np.argmin(np.abs(forward))], forward)
    side /= np.linalg.norm(side)
    return np.array([side, np.cross(forward, side), forward])


def upright_axes_along(direction: Floats) -> Floats:
    """Return axes of a view along the direction with y pointing down as far as possible: (3, 3), rows right, down, forward."""
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
    """Return the principal axes of (N, 3) centered points: (3, 3), greatest spread first (rows right, down, forward)."""
    _, axes = np.linalg.eigh(centered.T @ centered)
    axes = axes.T[::-1].copy()
    for axis in axes[:2]:
        if axis[np.argmax(np.abs(axis))] < 0:
            axis *= -1
    axes[2] *= np.sign(np.linalg.det(axes))
    return np.asarray(axes)

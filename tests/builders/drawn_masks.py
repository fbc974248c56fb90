"""Cables by formula: points of their surface, depth images of them, and the error of a chain against the true axis."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree

from doo3d.geometry.curves import Curves
from doo3d.geometry.polyline import densify
from doo3d.types import Array, Bools, Camera, Chain, Floats, Frame

CAMERA = Camera(fx=900.0, fy=900.0, cx=320.0, cy=240.0, width=640, height=480)


def line(a: Array, b: Array) -> Floats:
    """Return a straight axis from a to b, (400, 3) m."""
    return np.asarray(np.linspace(a, b, 400), dtype=float)


def ring(middle: Array, radius: float, tilt: float = 0.0) -> Floats:
    """Return a circle, (400, 3) m, facing the camera or tilted about x by radians; the last point is the first."""
    t = np.linspace(0, 2 * np.pi, 400)
    flat = radius * np.column_stack((np.cos(t), np.sin(t) * np.cos(tilt), np.sin(t) * np.sin(tilt)))
    return np.asarray(middle + flat)


def wave(length: float = 0.3, depth: float = 0.5, height: float = 0.03, dive: float = 0.01) -> Floats:
    """Return a gentle wave across the view, (500, 3) m, up and down and to and fro."""
    t = np.linspace(0, 1, 500)
    swing = (length * (t - 0.5), height * np.sin(2 * np.pi * t), depth + dive * np.cos(3 * np.pi * t))
    return np.asarray(np.column_stack(swing))


def helix(turns: float = 1.5, radius: float = 0.05, pitch: float = 0.06) -> Floats:
    """Return a helix about the x axis in front of the camera, (600, 3) m."""
    t = np.linspace(0, 2 * np.pi * turns, 600)
    return np.column_stack((pitch * (t / (2 * np.pi) - turns / 2), radius * np.cos(t), 0.5 + radius * np.sin(t)))


def surface(axis: Floats, radius: float, viewpoint: Array | None = None, spacing: float = 0.001) -> Floats:
    """Return points (N, 3) m of the wall of a tube with flat ends, all around or only where they face a viewpoint."""
    axis = densify(axis, spacing)
    along = Curves.of([axis]).tangents
    side = np.cross(along, np.eye(3)[np.argmin(np.abs(along).max(axis=0))])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    sides = max(12, round(2 * np.pi * radius / spacing))
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)[None] + 0.4 * np.arange(len(axis))[:, None]
    normal = np.cos(angle)[..., None] * side[:, None] + np.sin(angle)[..., None] * other[:, None]
    points = axis[:, None] + radius * normal
    if viewpoint is None:
        return points.reshape(-1, 3)
    return np.asarray(points[np.einsum("sak,sak->sa", normal, viewpoint - points) > 0])


def depth_of(axes: list[Floats], radii: list[float], camera: Camera = CAMERA, table: float = 0.0) -> tuple[Floats, Array]:
    """Render the exact depth (H, W) m of tubes with round ends, and the number of the tube that each pixel shows (-1: none).

    Each tube is the union of balls a tenth of a radius apart. table : m, distance of a plane behind; 0 = none.
    """
    depth, which = _rendered(tuple(np.asarray(axis, dtype=float).tobytes() for axis in axes), tuple(radii), camera, table)
    return depth.copy(), which.copy()


@lru_cache(maxsize=64)
def _rendered(axes: tuple[bytes, ...], radii: tuple[float, ...], camera: Camera, table: float) -> tuple[Floats, Array]:
    v, u = np.mgrid[0 : camera.height, 0 : camera.width]
    rays = np.stack(((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)), axis=-1)
    depth = np.full(u.shape, table if table > 0 else np.inf)
    which = np.full(u.shape, -1)
    for number, (axis, radius) in enumerate(zip(axes, radii, strict=True)):
        for center in densify(np.frombuffer(axis).reshape(-1, 3), radius / 10):
            if center[2] <= radius:
                continue
            x, y = camera.project(center[None])[0]
            reach = 1.1 * radius / (center[2] - radius) * max(camera.fx, camera.fy) + 1
            part = (
                slice(max(0, int(y - reach)), max(0, int(y + reach) + 2)),
                slice(max(0, int(x - reach)), max(0, int(x + reach) + 2)),
            )
            ray = rays[part]
            if not ray.size:
                continue
            square, middle = (ray**2).sum(axis=-1), ray @ center
            inside = middle**2 - square * (center @ center - radius**2)
            z = np.where(inside >= 0, (middle - np.sqrt(np.maximum(inside, 0))) / square, np.inf)
            nearer = z < depth[part]
            depth[part][nearer] = z[nearer]
            which[part][nearer] = number
    return np.where(np.isfinite(depth), depth, 0.0), which


def frame_of(*axes: Floats, radius: float = 0.005, camera: Camera = CAMERA, table: float = 0.0) -> tuple[Frame, Bools]:
    """Return a frame without color that shows cables, and their mask."""
    depth, which = depth_of(list(axes), [radius] * len(axes), camera, table)
    return Frame(None, depth.astype(np.float32), camera), which >= 0


@dataclass(frozen=True)
class AxisError:
    """Distances between a chain and the true axis, m.

    rms, largest : of the joints from the axis, extended in a straight line at its ends.
    uncovered : largest distance of a point of the axis from the chain. beyond : of a joint from the axis as it is.
    """

    rms: float
    largest: float
    uncovered: float
    beyond: float


def axis_error(chain: Chain, axis: Floats) -> AxisError:
    """Return the distances between a chain and the axis (P, 3) m that it should follow."""
    dense = densify(axis, 2e-4)
    tangent = Curves.of([dense]).tangents
    on = np.arange(0, 0.1, 2e-4)[:, None]
    extended = dense
    if not np.allclose(axis[0], axis[-1]):
        extended = np.concatenate((dense[0] - on * tangent[0], dense, dense[-1] + on * tangent[-1]))
    distance = cKDTree(extended).query(chain.joints)[0]
    beyond = cKDTree(dense).query(chain.joints)[0]
    back = cKDTree(densify(chain.joints, 2e-4)).query(dense)[0]
    return AxisError(float(np.sqrt(np.mean(distance**2))), float(distance.max()), float(back.max()), float(beyond.max()))


def runs_along(chain: Chain, axis: Floats) -> bool:
    """Tell whether a chain runs along an axis from one end to the other without turning back."""
    position = cKDTree(axis).query(chain.joints)[1]
    return bool((np.diff(position) >= 0).all() or (np.diff(position) <= 0).all())

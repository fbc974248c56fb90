"""What chains are drawn upon: an image, and how places in space come to lie on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from ..types import Array, Camera, Cloud, Floats, Frame, Image

SIZE = (1280, 720)  # px, of the picture of a cloud
_MARGIN = 0.1  # of the picture of a cloud, on each side
_SPLAT = 1.2  # width of a point in roots of the pixels there are for each: a surface shows no holes


@dataclass(frozen=True)
class View:
    """An image and its projection.

    image : (H, W, 3) uint8 RGB.
    project : (N, D) points -> (N, 2) px; NaN where they cannot be seen from here.
    scale : (N, D) points -> (N,) px that one unit of length has at each of them.
    distance : (N, D) points -> (N,) how far behind the image they lie: of two, the smaller hides the other.
    """

    image: Array
    project: Callable[[Floats], Floats]
    scale: Callable[[Floats], Floats]
    distance: Callable[[Floats], Floats]


def view_of(data: Frame | Cloud | Image | Array) -> View:
    """The view of a frame (its colour, or its depth in colours), of a cloud (drawn from points) or of an image."""
    if isinstance(data, Frame):
        image = data.color if data.color is not None else depth_picture(data.depth)
        return _camera_view(image, data.camera)
    if isinstance(data, Cloud):
        return _cloud_view(data)
    return flat_view(data.color if isinstance(data, Image) else np.asarray(data))


def depth_picture(depth: Array) -> Array:
    """(H, W) m, 0 = none -> (H, W, 3) uint8 RGB: near is bright, none is nearly black."""
    seen = depth > 0
    if not seen.any():
        return np.full((*depth.shape, 3), 20, np.uint8)
    near, far = np.percentile(depth[seen], (2, 98))
    bright = np.clip((far - depth) / max(far - near, 1e-6), 0, 1)
    picture = cv2.applyColorMap(np.uint8(40 + 150 * bright), cv2.COLORMAP_BONE)[:, :, ::-1].copy()
    picture[~seen] = 20
    return np.asarray(picture)


def flat_view(image: Array) -> View:
    """The view of an image in its own pixels, for chains in 2-D."""

    def one(points: Floats) -> Floats:
        return np.ones(len(points))

    return View(image, lambda points: np.asarray(points[:, :2], dtype=float), one, one)


def _camera_view(image: Array, camera: Camera) -> View:
    def scale(points: Floats) -> Floats:
        z = np.where(points[:, 2] > 0, points[:, 2], np.nan)
        return np.asarray(np.sqrt(camera.fx * camera.fy) / z)

    return View(image, camera.project, scale, lambda points: np.asarray(points[:, 2]))


def _cloud_view(cloud: Cloud) -> View:
    """From the viewpoint in perspective where it is known, else along the axis of least spread in parallel."""
    width, height = SIZE
    if not len(cloud.points):
        return _camera_view(np.full((height, width, 3), 30, np.uint8), Camera(width, width, width / 2, height / 2, width, height))
    center = cloud.points.mean(axis=0)
    if cloud.viewpoint is None:
        axes = _spread_axes(cloud.points - center)
        flat = (cloud.points - center) @ axes[:2].T
        low, high = np.percentile(flat, (0.5, 99.5), axis=0)
        per_unit = float(_fit(high - low))
        offset = np.array(SIZE) / 2 - per_unit * (low + high) / 2
        view = View(
            np.zeros((height, width, 3), np.uint8),
            lambda points: np.asarray(per_unit * (points - center) @ axes[:2].T + offset),
            lambda points: np.full(len(points), per_unit),
            lambda points: np.asarray((points - center) @ axes[2]),
        )
    else:
        axes, origin = _look(center - cloud.viewpoint), cloud.viewpoint
        seen = (cloud.points - origin) @ axes.T
        rays = seen[:, :2] / np.maximum(seen[:, 2:], 1e-9)
        low, high = np.percentile(rays, (0.5, 99.5), axis=0)
        focal = float(_fit(high - low))
        cx, cy = np.array(SIZE) / 2 - focal * (low + high) / 2
        turned = _camera_view(np.zeros((height, width, 3), np.uint8), Camera(focal, focal, cx, cy, width, height))
        view = View(
            turned.image,
            lambda points: turned.project((points - origin) @ axes.T),
            lambda points: turned.scale((points - origin) @ axes.T),
            lambda points: np.asarray((points - origin) @ axes[2]),
        )
    return View(_points_picture(cloud, view), view.project, view.scale, view.distance)


def _fit(extent: Floats) -> float:
    return float(np.min(np.array(SIZE) * (1 - 2 * _MARGIN) / np.maximum(extent, 1e-9)))


def _spread_axes(centered: Floats) -> Floats:
    """(3, 3) rows: right, down and away, a right-handed system with the greatest spread to the right."""
    _, axes = np.linalg.eigh(centered.T @ centered)
    axes = axes.T[::-1].copy()
    for axis in axes[:2]:
        if axis[np.argmax(np.abs(axis))] < 0:
            axis *= -1
    axes[2] *= np.sign(np.linalg.det(axes))
    return np.asarray(axes)


def _look(direction: Floats) -> Floats:
    """(3, 3) rows: right, down and forward along `direction`, with the frame's y as down as far as that goes."""
    forward = direction / max(float(np.linalg.norm(direction)), 1e-9)
    down = np.array((0.0, 1.0, 0.0)) - forward[1] * forward
    if np.linalg.norm(down) < 1e-3:
        down = np.array((0.0, 0.0, -1.0)) + forward[2] * forward
    down /= np.linalg.norm(down)
    right = np.linalg.svd(np.array([down, forward]))[2][2]
    axes = np.array([right, down, forward])
    axes[0] *= np.sign(np.linalg.det(axes))
    return np.asarray(axes)


def _points_picture(cloud: Cloud, view: View) -> Array:
    """(H, W, 3) uint8 RGB: the points as small squares on dark ground, far ones first."""
    width, height = SIZE
    shade = np.linspace(46, 22, height)[:, None, None]
    picture: Array = np.rint(shade * np.array((0.86, 0.95, 1.15))).repeat(width, axis=1).astype(np.uint8)
    away = view.distance(cloud.points)
    order = np.argsort(-away, kind="stable")
    if cloud.colors is not None:
        colors = cloud.colors[order]
    else:
        low, high = np.percentile(away, (1, 99))
        near = 1 - np.clip((away[order] - low) / max(high - low, 1e-9), 0, 1)
        colors = np.rint((110 + 110 * near[:, None]) * np.array((0.9, 0.97, 1.0))).astype(np.uint8)
    at = view.project(cloud.points[order])
    good = np.isfinite(at).all(axis=1) & (np.abs(at) < 4 * max(SIZE)).all(axis=1)
    at, colors = np.rint(at[good]).astype(int), colors[good]
    if not len(at):
        return picture
    free = np.sqrt(np.prod(np.ptp(at, axis=0) + 1.0) / len(at))
    wide = int(np.clip(np.ceil(_SPLAT * free), 1, 6))
    for step in np.ndindex(wide, wide):
        u, v = (at + step - wide // 2).T
        inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
        picture[v[inside], u[inside]] = colors[inside]
    return picture

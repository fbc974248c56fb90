"""Make the image that chains are drawn on, and the projection of points to its pixels."""

from dataclasses import dataclass

import numpy as np

from ..geometry.projection import Projection, spread_axes, upright_axes_along
from ..types import Array, Camera, Cloud, Floats, Frame, Image
from ..types.arguments import refused

SIZE = (1280, 720)  # (width, height) px of the picture of a cloud
MARGIN = 0.1  # share of the picture of a cloud, on each side
MIN_TANGENT = 1e-4  # extent of a cloud in the view, as a tangent: a smaller one would need an impossible focal length
POINT_WIDTH = 1.2  # of a point, in square roots of the pixels per point: a surface shows no holes


@dataclass(frozen=True)
class Backdrop:
    """An image to draw on, and the projection of points to its pixels.

    Attributes
    ----------
    image
        (H, W, 3) uint8 RGB.
    projection
        maps points (m in 3-D, px in 2-D) to pixels of the image (x right, y down).
    """

    image: Array
    projection: Projection


def backdrop_of(data: Frame | Cloud | Image | Array) -> Backdrop:
    """Return the image to draw chains on, and the projection of points to its pixels.

    Parameters
    ----------
    data
        decides what the image is:

        - Frame: its color image, or its depth in shades of gray if there is no color; the projection is that of its camera.
        - Cloud: a picture of its points, 1280 x 720 px, in perspective as seen from the viewpoint of the cloud. If the viewpoint
          is unknown, the projection is parallel, along the axis in which the points spread least.
        - Image, or an array (H, W, 3) uint8 RGB: the image itself; points are 2-D, in its pixels.
    """
    if isinstance(data, Frame):
        image = data.color if data.color is not None else depth_picture(data.depth)
        return Backdrop(image, Projection.of_camera(data.camera))
    if isinstance(data, Cloud):
        return _cloud_backdrop(data)
    if not isinstance(data, Image | np.ndarray):
        raise refused(data, "data", "a doo3d.Frame, Cloud or Image, or an array (H, W, 3) uint8 RGB")
    return planar_backdrop(data.color if isinstance(data, Image) else Image(data).color)


def depth_picture(depth: Array) -> Array:
    """Convert a depth image (H, W) m to a gray picture (H, W, 3) uint8 RGB: near is bright, far is dark.

    Pixels without depth (0) are nearly black. The shades span the 2nd to the 98th percentile of the depths.
    """
    measured = depth > 0
    if not measured.any():
        return np.full((*depth.shape, 3), 20, np.uint8)
    near, far = np.percentile(depth[measured], (2, 98))
    brightness = np.clip((far - depth) / max(far - near, 1e-6), 0, 1)
    picture = np.repeat((40 + 150 * brightness).astype(np.uint8)[:, :, None], 3, axis=2)
    picture[~measured] = 20
    return np.asarray(picture)


def planar_backdrop(image: Array) -> Backdrop:
    """Return an image (H, W, 3) uint8 RGB as the backdrop for 2-D chains; points (x, y) px are not changed."""
    return Backdrop(image, Projection.planar())


def _cloud_backdrop(cloud: Cloud) -> Backdrop:
    """Return the picture of a cloud, in perspective from its viewpoint, or in parallel along the axis of least spread."""
    projection = _cloud_projection(cloud)
    if not len(cloud.points):
        width, height = SIZE
        return Backdrop(np.full((height, width, 3), 30, np.uint8), projection)
    return Backdrop(_points_picture(cloud, projection), projection)


def _cloud_projection(cloud: Cloud) -> Projection:
    """Return the projection in which most points of a cloud fill the picture."""
    width, height = SIZE
    if not len(cloud.points):
        return Projection.of_camera(Camera(width, width, width / 2, height / 2, width, height))
    center = cloud.points.mean(axis=0)
    if cloud.viewpoint is None:
        axes = spread_axes(cloud.points - center)
        scale, offset = _fitted((cloud.points - center) @ axes[:2].T)
        return Projection.parallel(center, axes, scale, offset)
    axes = upright_axes_along(center - cloud.viewpoint)
    in_view = (cloud.points - cloud.viewpoint) @ axes.T
    focal, (cx, cy) = _fitted(in_view[:, :2] / np.maximum(in_view[:, 2:], 1e-9), MIN_TANGENT)
    return Projection.perspective(cloud.viewpoint, axes, Camera(focal, focal, cx, cy, width, height))


def _fitted(positions: Floats, min_extent: float = 1e-9) -> tuple[float, Floats]:
    """Return the scale and the (2,) offset, px, with which 99 % of (N, 2) positions lie inside the margins of the picture."""
    low, high = np.percentile(positions, (0.5, 99.5), axis=0)
    scale = float(np.min(np.array(SIZE) * (1 - 2 * MARGIN) / np.maximum(high - low, min_extent)))
    return scale, np.asarray(np.array(SIZE) / 2 - scale * (low + high) / 2)


def _points_picture(cloud: Cloud, projection: Projection) -> Array:
    """Draw the points as small squares on a dark background, far ones first: (H, W, 3) uint8 RGB."""
    width, height = SIZE
    background = np.linspace(46, 22, height)[:, None, None]
    picture: Array = np.rint(background * np.ones(3)).repeat(width, axis=1).astype(np.uint8)
    distance = projection.distance(cloud.points)
    order = np.argsort(-distance, kind="stable")
    if cloud.colors is not None:
        colors = cloud.colors[order]
    else:
        low, high = np.percentile(distance, (1, 99))
        nearness = 1 - np.clip((distance[order] - low) / max(high - low, 1e-9), 0, 1)
        colors = np.rint((110 + 110 * nearness[:, None]) * np.ones(3)).astype(np.uint8)
    at = projection.project(cloud.points[order])
    in_view = np.isfinite(at).all(axis=1) & (np.abs(at) < 4 * max(SIZE)).all(axis=1)
    at, colors = np.rint(at[in_view]).astype(int), colors[in_view]
    if not len(at):
        return picture
    spacing = np.sqrt(np.prod(np.ptp(at, axis=0) + 1.0) / len(at))
    width_px = int(np.clip(np.ceil(POINT_WIDTH * spacing), 1, 6))
    for step in np.ndindex(width_px, width_px):
        u, v = (at + step - width_px // 2).T
        inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
        picture[v[inside], u[inside]] = colors[inside]
    return picture

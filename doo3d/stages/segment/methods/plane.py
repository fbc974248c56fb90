"""What stands off the dominant plane."""

from __future__ import annotations

import cv2
import numpy as np

from ....config import SegmentConfig
from ....errors import InputError
from ....types import Array, Bools, Cloud, Floats, Frame, Image

SAMPLE = 2000
"""Points that RANSAC counts inliers on: the share of a plane is known to about one percent from that many."""


SURE, LIKELY = 3.5, 2.0
"""Deviations of the plane's noise."""


RANSAC_DRAWS = 200
"""A plane that a third of the readings lie on is missed by all draws with a probability of 5e-4."""


def fit_plane(points: Floats, distance: float, iterations: int, seed: int) -> tuple[Floats, float, float]:
    """The plane with the most points within `distance` m (RANSAC, then least squares on its inliers).

    points : (N, 3) m, N >= 3. Returns the unit normal (3,), the offset d with normal @ p = d on the plane, and the
    robust standard deviation of the inliers about it, m.
    """
    random = np.random.default_rng(seed)
    sample = points[random.choice(len(points), SAMPLE, replace=False)] if len(points) > SAMPLE else points
    corners = sample[random.integers(0, len(sample), (iterations, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    norm = np.linalg.norm(normals, axis=1)
    normals = normals[norm > 0] / norm[norm > 0, None]
    if not len(normals):
        return np.array([0.0, 0.0, 1.0]), float(points[0, 2]), 0.0
    offsets = np.einsum("ij,ij->i", normals, corners[norm > 0, 0])
    counts = (np.abs(sample @ normals.T - offsets) < distance).sum(axis=0)
    best = int(np.argmax(counts))
    normal, offset = normals[best], float(offsets[best])
    for _ in range(3):
        inliers = sample[np.abs(sample @ normal - offset) < 2 * distance]
        if len(inliers) < 3:
            break
        center = inliers.mean(axis=0)
        normal = np.linalg.eigh((inliers - center).T @ (inliers - center))[1][:, 0]
        offset = float(normal @ center)
    residual = np.abs(sample @ normal - offset)
    near = residual[residual < 2 * distance]
    return normal, offset, 1.4826 * float(np.median(near)) if len(near) else 0.0


def height(data: Frame | Cloud, normal: Floats, offset: float) -> Array:
    """m off the plane, positive towards the sensor: (H, W) float32 with 0 where there is no depth, or (N,).

    In an image the plane's inverse depth is affine in the pixel, so no point is ever computed. A cloud without a
    viewpoint has no side towards the sensor: the side that holds more of the points counts as that.
    """
    if isinstance(data, Cloud):
        above = data.points @ normal - offset
        if data.viewpoint is not None:
            return np.asarray(above * np.sign(normal @ data.viewpoint - offset))
        return np.asarray(above if np.sum(np.sign(above) * (np.abs(above) > np.std(above))) >= 0 else -above)
    camera = data.camera
    along_u = normal[0] * (np.arange(camera.width) - camera.cx) / camera.fx
    along_v = normal[1] * (np.arange(camera.height) - camera.cy) / camera.fy + normal[2]
    ray = along_v[:, None].astype(np.float32) + along_u[None, :].astype(np.float32)
    ray *= data.depth
    np.subtract(np.float32(offset), ray, out=ray)
    ray *= np.float32(np.sign(offset))
    ray[data.depth <= 0] = 0
    return np.asarray(ray)


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> Bools:
    """Pixels or points in front of the dominant plane by more than `plane_distance`, beyond the noise of the plane.

    Surely beyond is 3.5 deviations. In an image what is 2 deviations in front belongs to it where it touches such pixels, so
    that the flanks of a thin object are not lost.

    Raises
    ------
    InputError : an image, which has no planes.
    """
    if isinstance(data, Image):
        raise InputError(
            "segment.method is plane, which needs depth: for an image use a mask, hsv or ridge", code="method-needs-depth"
        )
    points = subsample(data)
    if len(points) < 3:
        return np.zeros(len(data.points) if isinstance(data, Cloud) else data.depth.shape, dtype=bool)
    normal, offset, noise = fit_plane(points, config.plane_distance, RANSAC_DRAWS, seed)
    above = height(data, normal, offset)
    sure = np.asarray(above > max(config.plane_distance, SURE * noise))
    if isinstance(data, Cloud):
        return sure
    _, label = cv2.connectedComponents((above > max(config.plane_distance, LIKELY * noise)).astype(np.uint8))
    holds = np.zeros(int(label.max()) + 1, dtype=bool)
    holds[label[sure]] = True
    return np.asarray(holds[label])


def subsample(data: Frame | Cloud) -> Floats:
    """At most about 20,000 of the points, evenly: (N, 3) m."""
    if isinstance(data, Cloud):
        return data.points[:: max(1, len(data.points) // 20_000)]
    stride = max(1, int(np.sqrt(data.depth.size / 20_000)))
    depth = data.depth[::stride, ::stride]
    v, u = np.nonzero(depth)
    return data.camera.unproject(np.column_stack((u, v)) * stride, depth[v, u])

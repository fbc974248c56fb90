"""Select the pixels or points in front of the dominant plane."""

import math

import numpy as np

from ... import kernels
from ...config import SegmentConfig
from ...geometry.noise import DEVIATIONS, MAD_TO_DEVIATION, SAMPLES, SURFACE_SAMPLES
from ...kernels import raised_pixels
from ...types import Cloud, Floats, Frame, Image, Ints, Plane
from .result import MethodResult, require_depth

MIN_PLANE_SHARE, MISS_PROBABILITY = 0.4, 1e-4
"""Minimum fraction of the readings on the plane, and probability that RANSAC draws no triple of its points. A plane with a
smaller fraction is clutter, or one of several surfaces."""

RANSAC_DRAWS = math.ceil(math.log(MISS_PROBABILITY) / math.log(1 - MIN_PLANE_SHARE**3))
"""Number of planes that RANSAC tries, each through three points (Fischler and Bolles, 1981): 139."""

REFINE_ITERATIONS = 3
"""Number of least-squares fits of the plane to its inliers."""

NOISE_ITERATIONS = 6
"""Maximum number of times that the window of distances from which the noise is estimated is widened."""

SEED_DEVIATIONS, GROW_DEVIATIONS = 3.5, 2.0
"""High and low threshold of the hysteresis in an image, in standard deviations of the plane's noise."""


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> MethodResult:
    """Select the pixels, (H, W) bool, or the points of a cloud, (N,) bool, in front of the dominant plane.

    A pixel or point is selected if it lies on the sensor's side of the plane, at a distance of more than `plane_distance` and
    more than 3.5 standard deviations of the plane's noise. In a Frame 2 standard deviations suffice for pixels connected to such
    pixels (hysteresis threshold), so that the flanks of a thin object are not lost. Nothing is selected if there are fewer than
    three readings. The plane is part of the result.

    Parameters
    ----------
    data
        a Frame or a Cloud.
    config
        section `segment` of the settings: `plane_distance`.
    seed
        seed of the random draws of RANSAC.

    Raises
    ------
    InputError : the data is an Image, which has no planes.
    """
    data = require_depth(data, "plane")
    random = np.random.default_rng(seed)
    sample = _sample(data, random)
    if len(sample) < 3:
        return MethodResult(np.zeros(len(data.points) if isinstance(data, Cloud) else data.depth.shape, dtype=bool))
    normal, offset = _fit(sample, config.plane_distance, random)
    residual = np.abs(sample @ normal - offset)
    plane = Plane(normal, offset) if np.mean(residual < config.plane_distance) >= MIN_PLANE_SHARE else None
    noise = plane_noise(residual, config.plane_distance)
    low, high = (max(config.plane_distance, deviations * noise) for deviations in (GROW_DEVIATIONS, SEED_DEVIATIONS))
    if isinstance(data, Cloud):
        return MethodResult(height_above_plane(data, normal, offset) > high, plane=plane)
    if offset < 0:
        normal, offset = -normal, -offset
    camera = data.camera
    along_u = normal[0] * (np.arange(camera.width) - camera.cx) / camera.fx
    along_v = normal[1] * (np.arange(camera.height) - camera.cy) / camera.fy + normal[2]
    raised = raised_pixels(data.depth, along_u.astype(np.float32), along_v.astype(np.float32), offset, low, high)
    return MethodResult(raised, plane=plane)


def fit_plane(points: Floats, distance: float, seed: int) -> tuple[Floats, float]:
    """Fit the plane that has the most points near it, by RANSAC and then least squares on its inliers.

    Parameters
    ----------
    points
        (N, 3) m, N points, at least three.
    distance
        m, maximum distance of an inlier from the plane.
    seed
        seed of the random numbers.

    Returns
    -------
    normal : (3,) unit, of arbitrary sign.
    offset : m; points p on the plane have normal @ p = offset.

    If every triple drawn is collinear, the result is the plane z = constant through one of the points.
    """
    random = np.random.default_rng(seed)
    return _fit(points[_draw(len(points), random)], distance, random)


def _draw(count: int, random: np.random.Generator) -> Ints | slice:
    """Return the indices of SAMPLES points drawn at random from `count` points; all points if there are no more."""
    return random.choice(count, SAMPLES, replace=False) if count > SAMPLES else np.s_[:]


def _fit(sample: Floats, distance: float, random: np.random.Generator) -> tuple[Floats, float]:
    return kernels.fit_plane(sample, random.integers(0, len(sample), (RANSAC_DRAWS, 3)), distance, REFINE_ITERATIONS)


def plane_noise(residual: Floats, distance: float) -> float:
    """Return the robust standard deviation of distances from a plane, from their median absolute deviation.

    residual : (N,) m, 0 or more. distance : m, half of the first window of residuals; if no residual lies in it, 0 is returned.

    Where the depth is noisier than `distance`, a fixed window would truncate the noise and underestimate it: the window is
    widened to DEVIATIONS standard deviations until it is as wide as that.
    """
    noise, window = 0.0, 2 * distance
    for _ in range(NOISE_ITERATIONS):
        near = residual[residual < window]
        noise = MAD_TO_DEVIATION * float(np.median(near)) if len(near) else 0.0
        if DEVIATIONS * noise <= window:
            break
        window = DEVIATIONS * noise
    return noise


def height_above_plane(cloud: Cloud, normal: Floats, offset: float) -> Floats:
    """Return the height of each point of a cloud above a plane, in m, positive on the sensor's side.

    For a cloud without a viewpoint the sensor is taken to be on the side with more of the points far from the plane.

    Parameters
    ----------
    cloud
        the N points.
    normal
        (3,) unit, in the coordinates of the cloud.
    offset
        m; points p on the plane have normal @ p = offset.

    Returns
    -------
    (N,) m.
    """
    height = cloud.points @ normal - offset
    if cloud.viewpoint is not None:
        return np.asarray(height * np.sign(normal @ cloud.viewpoint - offset))
    return np.asarray(height if np.sum(np.sign(height) * (np.abs(height) > np.std(height))) >= 0 else -height)


def _sample(data: Frame | Cloud, random: np.random.Generator) -> Floats:
    """Return SAMPLES points drawn from a Frame or Cloud, (N, 3) m; those of a Frame from a grid of about SURFACE_SAMPLES pixels.

    The points are in the camera's optical frame for a Frame, in the coordinates of the cloud for a Cloud. Pixels without depth
    are left out.
    """
    if isinstance(data, Cloud):
        return data.points[_draw(len(data.points), random)]
    stride = max(1, int(np.sqrt(data.depth.size / SURFACE_SAMPLES)))
    depth = data.depth[::stride, ::stride]
    v, u = np.nonzero(depth != 0)
    chosen = _draw(len(v), random)
    return data.camera.unproject(np.column_stack((u[chosen], v[chosen])) * stride, depth[v[chosen], u[chosen]])

"""Simulate the errors of depth cameras: noise, rounding, flying points and holes."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.ndimage import gaussian_filter, maximum_filter, minimum_filter

from ...types import Array, Bools, Camera, Floats


@dataclass(frozen=True)
class Sensor:
    """The errors of a simulated depth camera.

    Attributes
    ----------
    baseline
        distance in m between the two cameras of a stereo sensor, whose noise is constant in disparity and so grows with the
        square of the depth; 0 for a sensor whose noise is constant in depth.
    noise
        (least, greatest) standard deviation of the noise, in px of disparity if there is a baseline, else in m; each frame has a
        random value between them.
    correlation
        sigma, in px, of the Gaussian blur that correlates the noise of neighboring pixels.
    disparity_step
        px; the disparity is rounded to multiples of this step; 0 for no rounding.
    depth_step
        m; the depth is rounded to multiples of this step; 0 for no rounding.
    flying
        fraction, 0 to 1, of the pixels at depth edges that measure a depth between the near and the far side.
    missing
        fraction, 0 to 1, of the pixels at depth edges that measure nothing.
    holes
        fraction, 0 to 1, of the image that is lost in small holes.
    """

    baseline: float = 0.0
    noise: tuple[float, float] = (0.0, 0.0)
    correlation: float = 1.0
    disparity_step: float = 0.0
    depth_step: float = 0.0
    flying: float = 0.0
    missing: float = 0.0
    holes: float = 0.0


SENSORS: dict[str, Sensor] = {
    "d435": Sensor(0.050, (0.04, 0.12), 1.0, 1 / 32, 0.001, 0.30, 0.25, 0.006),
    "d455": Sensor(0.095, (0.04, 0.12), 1.0, 1 / 32, 0.001, 0.30, 0.25, 0.006),
    "zivid": Sensor(noise=(0.0001, 0.0001), correlation=0.6, flying=0.05, missing=0.3, holes=0.002),
    "none": Sensor(),
}
MIN_EDGE_STEP = 0.0025
"""Least depth difference in m within 3 x 3 pixels that makes an edge."""

HOLE_SIGMA_PX = 2.2
"""Sigma in px of the Gaussian blur of the noise whose peaks become small holes."""


def measure_depth(
    exact: Floats, shiny: Bools, camera: Camera, sensor: Sensor, rng: Generator, walls: Array | None = None
) -> Array:
    """Return the depth image that a sensor measures, (H, W) float32 m, 0 where it measures nothing.

    Parameters
    ----------
    exact
        (H, W) m, the true depth along the optical axis; 0 where there is no surface.
    shiny
        (H, W) bool, pixels of surfaces that the sensor cannot measure.
    camera
        the intrinsics; only fx is used, to relate disparity to depth.
    sensor
        the errors of the sensor.
    rng
        the random number generator of the noise; the same state gives the same image.
    walls
        (H, W) int, the number of the table or wall at each pixel, 0 elsewhere; the slope of a wall is no edge.
    """
    valid = exact > 0
    depth = _noisy(_with_edges(exact, sensor, rng, walls), camera, sensor, rng)
    if sensor.holes > 0:
        level = _correlated_noise(exact.shape, HOLE_SIGMA_PX, rng)
        depth[level > np.quantile(level, 1 - sensor.holes)] = 0
    if sensor.depth_step > 0:
        depth = np.round(depth / sensor.depth_step) * sensor.depth_step
    depth[shiny | ~valid] = 0
    return np.asarray(depth, dtype=np.float32)


def _with_edges(exact: Floats, sensor: Sensor, rng: Generator, walls: Array | None) -> Floats:
    """Return the depth with flying points (a depth between both sides) and missing pixels at edges."""
    depth = exact.copy()
    if sensor.flying + sensor.missing == 0:
        return depth
    nearest = minimum_filter(np.where(exact > 0, exact, np.inf), 3)
    farthest = maximum_filter(exact, 3)
    edge = (exact > 0) & (farthest - nearest > MIN_EDGE_STEP)
    if walls is not None:
        edge &= (walls == 0) | (minimum_filter(walls, 3) != maximum_filter(walls, 3))
    chance, t = rng.random(exact.shape), rng.random(exact.shape)
    flying = edge & (chance < sensor.flying)
    depth[flying] = (t * nearest + (1 - t) * farthest)[flying]
    depth[edge & (chance > 1 - sensor.missing)] = 0
    return depth


def _noisy(depth: Floats, camera: Camera, sensor: Sensor, rng: Generator) -> Floats:
    """Return the depth with noise, which is constant in disparity for a stereo camera."""
    if sensor.noise[1] == 0:
        return depth
    valid = depth > 0
    noise = rng.uniform(*sensor.noise) * _correlated_noise(depth.shape, sensor.correlation, rng)
    if sensor.baseline == 0:
        return np.where(valid, depth + noise, 0.0)
    scale = camera.fx * sensor.baseline
    disparity = scale / np.where(valid, depth, 1.0) + noise
    if sensor.disparity_step > 0:
        disparity = np.round(disparity / sensor.disparity_step) * sensor.disparity_step
    return np.where(valid, scale / np.maximum(disparity, 1e-3), 0.0)


def _correlated_noise(shape: tuple[int, ...], sigma: float, rng: Generator) -> Floats:
    """Return normal noise (H, W) of standard deviation 1, correlated over about 2 sigma px."""
    blurred = gaussian_filter(rng.normal(size=shape), sigma)
    return np.asarray(blurred / blurred.std())

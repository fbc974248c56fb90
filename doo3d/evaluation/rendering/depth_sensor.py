"""What depth cameras do to depth: noise, rounding, flying points and holes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.ndimage import gaussian_filter, maximum_filter, minimum_filter

from ...types import Array, Bools, Camera, Floats


@dataclass(frozen=True)
class Sensor:
    """A depth camera.

    baseline : m between its eyes; 0 = noise does not grow with the distance.
    noise : (least, most) standard deviation, px of disparity (m where there is no baseline); drawn once a frame.
    correlation : px, sigma of the blur that makes the noise of neighbours alike.
    step : px of disparity, rounding; 0 = none. depth_step : m, rounding of what is stored; 0 = none.
    flying, lost : shares of the pixels at depth edges that read between both sides, and nothing.
    blotches : share of the image that small holes take.
    """

    baseline: float = 0.0
    noise: tuple[float, float] = (0.0, 0.0)
    correlation: float = 1.0
    step: float = 0.0
    depth_step: float = 0.0
    flying: float = 0.0
    lost: float = 0.0
    blotches: float = 0.0


SENSORS: dict[str, Sensor] = {
    "d435": Sensor(0.050, (0.04, 0.12), 1.0, 1 / 32, 0.001, 0.30, 0.25, 0.006),
    "d455": Sensor(0.095, (0.04, 0.12), 1.0, 1 / 32, 0.001, 0.30, 0.25, 0.006),
    "zivid": Sensor(noise=(0.0001, 0.0001), correlation=0.6, flying=0.05, lost=0.3, blotches=0.002),
    "none": Sensor(),
}
EDGE = 0.0025  # m of depth from the nearest to the farthest of 3 x 3 pixels that make an edge
BLOTCH = 2.2  # px, sigma of the blur that small holes come from


def measured(exact: Floats, shiny: Bools, camera: Camera, sensor: Sensor, rng: Generator) -> Array:
    """(H, W) float32 m, 0 = none: what the sensor reads.

    Parameters
    ----------
    exact : (H, W) m, the true depth, 0 = nothing there. shiny : (H, W) bool, no depth is found there.
    """
    some = exact > 0
    depth = _noisy(_with_edges(exact, sensor, rng), camera, sensor, rng)
    if sensor.blotches > 0:
        level = _correlated(exact.shape, BLOTCH, rng)
        depth[level > np.quantile(level, 1 - sensor.blotches)] = 0
    if sensor.depth_step > 0:
        depth = np.round(depth / sensor.depth_step) * sensor.depth_step
    depth[shiny | ~some] = 0
    return np.asarray(depth, dtype=np.float32)


def _with_edges(exact: Floats, sensor: Sensor, rng: Generator) -> Floats:
    """The depth with some of the pixels at edges between both sides (flying points) or gone."""
    depth = exact.copy()
    if sensor.flying + sensor.lost == 0:
        return depth
    nearest = minimum_filter(np.where(exact > 0, exact, np.inf), 3)
    farthest = maximum_filter(exact, 3)
    edge = (exact > 0) & (farthest - nearest > EDGE)
    chance, share = rng.random(exact.shape), rng.random(exact.shape)
    flying = edge & (chance < sensor.flying)
    depth[flying] = (share * nearest + (1 - share) * farthest)[flying]
    depth[edge & (chance > 1 - sensor.lost)] = 0
    return depth


def _noisy(depth: Floats, camera: Camera, sensor: Sensor, rng: Generator) -> Floats:
    if sensor.noise[1] == 0:
        return depth
    some = depth > 0
    noise = rng.uniform(*sensor.noise) * _correlated(depth.shape, sensor.correlation, rng)
    if sensor.baseline == 0:
        return np.where(some, depth + noise, 0.0)
    scale = camera.fx * sensor.baseline
    disparity = scale / np.where(some, depth, 1.0) + noise
    if sensor.step > 0:
        disparity = np.round(disparity / sensor.step) * sensor.step
    return np.where(some, scale / np.maximum(disparity, 1e-3), 0.0)


def _correlated(shape: tuple[int, ...], sigma: float, rng: Generator) -> Floats:
    """(H, W) normal noise of standard deviation 1 that is alike over about 2 sigma px."""
    blurred = gaussian_filter(rng.normal(size=shape), sigma)
    return np.asarray(blurred / blurred.std())

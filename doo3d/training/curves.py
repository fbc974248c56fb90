"""Draw curves of strands in an image: single, in parallel, in coils, from a connector."""

from collections.abc import Callable

import numpy as np

from ..types import Array
from .noise import Rng

STEP_PX = 1.5
"""Distance between the samples of a curve, px."""


def wander(rng: Rng, size: int, radius: float, start: Array | None = None, heading: float | None = None) -> Array:
    """Draw a curve whose curvature is smooth noise, from the image border or from `start`: (N, 2) float64, px."""
    length = size * np.exp(rng.uniform(-0.9, 1.4))
    count = max(8, int(length / STEP_PX))
    scale = size * np.exp(rng.uniform(-2, 0.7))
    knots = max(3, int(length / scale) + 2)
    strength = rng.choice([0.0, 0.3, 1.0, 2.5], p=[0.12, 0.38, 0.35, 0.15])
    curvature = np.interp(np.linspace(0, knots - 1, count), np.arange(knots), rng.normal(0, strength, knots)) / scale
    window = np.hanning(2 * max(2, count // (2 * knots)) + 1)
    curvature = np.convolve(np.pad(curvature, len(window) // 2, mode="edge"), window / window.sum(), "valid")
    curvature = np.clip(curvature, -0.5 / radius, 0.5 / radius)
    if start is None:
        if rng.random() < 0.65:
            side = rng.integers(4)
            along = rng.random() * size
            start = np.array([[along, -5], [size + 5, along], [along, size + 5], [-5, along]][side], float)
            inward = [np.pi / 2, np.pi, -np.pi / 2, 0][side]
            heading = inward + rng.normal(0, 0.5)
        else:
            start = rng.uniform(0.05, 0.95, 2) * size
    angle = (rng.random() * 6.28 if heading is None else heading) + np.cumsum(curvature) * STEP_PX
    return start + np.cumsum(np.stack([np.cos(angle), np.sin(angle)], 1), 0) * STEP_PX


def normals(curve: Array) -> Array:
    """Return the unit normals of a curve, (N, 2)."""
    tangent = np.gradient(curve, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    return np.stack([-tangent[:, 1], tangent[:, 0]], 1)


def resampled(curve: Array) -> Array:
    """Resample a curve (N, 2) px to samples of equal distance."""
    steps = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    places = np.arange(0, steps[-1], STEP_PX)
    return np.stack([np.interp(places, steps, curve[:, i]) for i in range(2)], 1)


def smooth_noise(rng: Rng, count: int, knots: int) -> Array:
    """Draw smooth noise along a curve, with standard deviation 1: (count,)."""
    values = rng.normal(0, 1, knots)
    at = np.linspace(0, knots - 1, count)
    low = np.minimum(at.astype(int), knots - 2)
    part = at - low
    part = part * part * (3 - 2 * part)
    return np.asarray(values[low] * (1 - part) + values[low + 1] * part)


def singles(rng: Rng, size: int, radius: float) -> list[Array]:
    """Draw independent curves, (N, 2) px each."""
    return [wander(rng, size, radius) for _ in range(int(rng.choice([1, 2, 3, 4, 6, 9], p=[0.25, 0.25, 0.2, 0.15, 0.1, 0.05])))]


def parallels(rng: Rng, size: int, radius: float) -> list[Array]:
    """Draw curves that run beside each other: touching, apart or crossing at small angles."""
    base = wander(rng, size, 6 * radius)
    normal = normals(base)
    count = int(rng.integers(2, 11))
    pitch = 2 * radius * (1 if rng.random() < 0.3 else np.exp(rng.uniform(0, 1.6)))
    drift = 0.0 if rng.random() < 0.3 else rng.uniform(0.1, 1.2) * pitch * (count if rng.random() < 0.4 else 1)
    curves = []
    for number in range(count):
        offset = (number - (count - 1) / 2) * pitch + drift * smooth_noise(rng, len(base), int(rng.integers(2, 6)))
        curves.append(resampled(base + normal * offset[:, None]))
    return [curve for curve in curves if len(curve) > 6]


def fan(rng: Rng, size: int, radius: float) -> list[Array]:
    """Draw curves that leave a connector side by side and spread."""
    start, heading = rng.uniform(0.05, 0.95, 2) * size, rng.random() * 6.28
    side = np.array([-np.sin(heading), np.cos(heading)])
    count = int(rng.integers(2, 11))
    pitch = 2 * radius * rng.uniform(1.1, 2.5)
    places = (np.arange(count) - (count - 1) / 2) * pitch
    spread = rng.normal(0, 0.12)
    return [wander(rng, size, radius, start + side * place, heading + spread * place / pitch) for place in places]


def coil(rng: Rng, size: int, radius: float) -> list[Array]:
    """Draw one curve wound in loops."""
    turns = rng.uniform(1.2, 6)
    count = int(turns * 120)
    angle = np.linspace(0, turns * 6.28, count) * rng.choice([-1, 1]) + rng.random() * 6.28
    reach = size * rng.uniform(0.12, 0.4) * (1 + 0.12 * smooth_noise(rng, count, int(turns * 3) + 3))
    squash = rng.uniform(0.4, 1)
    center = rng.uniform(0.2, 0.8, 2) * size
    loops = center + np.stack([reach * np.cos(angle), reach * squash * np.sin(angle)], 1)
    loops += np.linspace(0, 1, count)[:, None] * rng.normal(0, 0.25 * size, 2) * (rng.random() < 0.5)
    last = loops[-1] - loops[-2]
    tail = wander(rng, size, radius, loops[-1], float(np.arctan2(last[1], last[0])))
    return [resampled(np.concatenate([loops, tail]))]


def snake(rng: Rng, size: int, radius: float) -> list[Array]:
    """Draw one long curve that fills the image and crosses itself."""
    count = int(rng.integers(4, 14))
    knots = rng.uniform(0.05, 0.95, (count, 2)) * size
    knots = np.concatenate([knots[:1], knots, knots[-1:]])
    t = np.linspace(0, 1, 60)[:, None]
    basis = ((1 - t) ** 3 / 6, (3 * t**3 - 6 * t**2 + 4) / 6, (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6, t**3 / 6)
    parts = [sum(b * knots[i + j] for j, b in enumerate(basis)) for i in range(count - 1)]
    return [resampled(np.concatenate(parts))]


LAYOUTS: dict[str, Callable[[Rng, int, float], list[Array]]] = {f.__name__: f for f in (singles, parallels, fan, coil, snake)}
SHARES = (0.45, 0.2, 0.1, 0.1, 0.15)

"""Draw noise and random colors for backgrounds and textures."""

import cv2
import numpy as np

from ..types import Array

Rng = np.random.Generator


def octaves(rng: Rng, size: int, coarsest: float, persistence: float = 0.5, stretch: float = 1.0) -> Array:
    """Draw a sum of octaves of smooth noise, (size, size) float32 from 0 to 1.

    Parameters
    ----------
    rng
        source of random numbers.
    size
        width and height, px.
    coarsest
        size of the largest blobs, px.
    persistence
        amplitude of each octave relative to the one before.
    stretch
        width of the blobs relative to their height.
    """
    total = np.zeros((size, size), np.float32)
    amplitude, blob = 1.0, float(coarsest)
    while blob >= 1.5 and amplitude > 0.04:
        height = max(2, int(size / blob) + 2)
        width = max(2, int(size / (blob * stretch)) + 2)
        cells = rng.random((min(height, size), min(width, size)), dtype=np.float32)
        total += amplitude * cv2.resize(cells, (size, size), interpolation=cv2.INTER_CUBIC if blob > 3 else cv2.INTER_LINEAR)
        amplitude *= persistence
        blob /= 2
    low, high = float(total.min()), float(total.max())
    return (total - low) / max(high - low, 1e-6)


def color(rng: Rng) -> Array:
    """Draw a random color, (3,) float32 from 0 to 1; gray, black and white are as frequent as saturated colors."""
    kind = rng.random()
    value = rng.random()
    if kind < 0.2:
        return np.full(3, value, np.float32) + rng.normal(0, 0.02, 3).astype(np.float32)
    if kind < 0.3:
        return np.full(3, 0.02 + 0.1 * value, np.float32)
    if kind < 0.4:
        return np.full(3, 0.8 + 0.2 * value, np.float32) - rng.random(3).astype(np.float32) * 0.06
    hsv = np.array([[[rng.random() * 360, rng.random() ** (0.4 if kind < 0.8 else 1.5), 0.15 + 0.85 * value]]], np.float32)
    return np.asarray(cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB)[0, 0])


def palette(rng: Rng, values: Array, colors: int) -> Array:
    """Map `values`, (H, W) from 0 to 1, to a scale of random colors: an image (H, W, 3) float32."""
    base = color(rng)
    spread = rng.choice([0.1, 0.25, 1.0], p=[0.35, 0.35, 0.3])
    stops = np.stack([(1 - spread) * base + spread * color(rng) for _ in range(colors)])
    table = np.stack([np.interp(np.linspace(0, 1, 256), np.linspace(0, 1, colors), stops[:, i]) for i in range(3)], axis=1)
    return np.asarray(table.astype(np.float32)[np.minimum((values * 255).astype(np.int32), 255)])

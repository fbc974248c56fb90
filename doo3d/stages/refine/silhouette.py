"""The silhouette of the object at samples along its axis: the middle and the width of the mask across the path."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...geometry.polyline import unit
from ...kernels import lateral_sums, nearest
from ...types import Array, Camera, Floats, Ints
from .cross_sections import SectionAxes, window_sum

MAX_MASK_PIXELS = 20_000
"""Pixels of the mask that suffice to measure on: their number is the width of the object."""

GOLDEN_RATIO = (1 + 5**0.5) / 2

PROJECTION_STEP = 1e-4
"""m; step along an axis whose projection tells its direction and scale in the image."""

MIN_SCALE = 1e-6
"""px per m; a lateral axis along the ray has no scale in the image."""


@dataclass(frozen=True)
class Silhouette:
    """The middle and half the width of the object's mask at S samples, measured across the object.

    Attributes
    ----------
    offset
        (S,) m (px in 2-D), from the sample to the middle of the mask, along the lateral axis.
    radius
        (S,) m (px in 2-D), half the width of the mask; 0 if no mask is near the sample.
    """

    offset: Floats
    radius: Floats


def measure_silhouette(
    positions: Floats,
    axes: SectionAxes,
    path: Ints,
    mask_pixels: Array,
    camera: Camera | None,
    reach: Floats,
    window_half: int,
) -> Silhouette:
    """Measure the middle and the width of the object's mask at samples, across the object.

    Every pixel of the mask belongs to the sample nearest to it in the image. The number of a sample's pixels, over the length
    of image that the sample stands for, is the width, without bias from the pixel grid. The mean of the pixels' offsets is
    the middle.

    Parameters
    ----------
    positions
        (S, D) m in the camera's optical frame (px in 2-D), the samples.
    axes
        the axes of the cross-section at each sample.
    path
        (S,) int, the path of each sample.
    mask_pixels
        (N, 2), the pixels (u, v) of the mask.
    camera
        the intrinsics; None if the positions are pixels.
    reach
        (S,) m (px in 2-D); pixels farther than this from a sample do not belong to it.
    window_half
        number of samples on either side, in the same path, whose pixels are pooled.
    """
    pixels, across, scale = _project_axes(positions, axes, camera)
    some = on_lattice(mask_pixels).astype(float)
    pixels_per_sample = len(mask_pixels) / max(1, len(some))
    reach = reach * np.abs(scale)
    distance, near = nearest(some, pixels, float(reach.max()), True)
    sums = lateral_sums(some, distance, near, pixels, across, reach)
    count, total = (window_sum(pixels_per_sample * each, path, window_half) for each in sums)
    length = np.maximum(window_sum(_image_lengths(pixels, path), path, window_half), 1e-9)
    return Silhouette(total / np.maximum(count, 1e-9) / scale, count / length / np.abs(scale) / 2)


def _project_axes(positions: Floats, axes: SectionAxes, camera: Camera | None) -> tuple[Floats, Floats, Floats]:
    """Project samples and their lateral axes.

    Returns
    -------
    pixels : (S, 2) px. across : (S, 2) unit, across the path in the image.
    scale : (S,) px across the path per unit along the lateral axis, signed: it depends on the place in the image and on depth.
    """
    if camera is None:
        return positions, axes.lateral, np.ones(len(positions))
    pixels = camera.project(positions)
    along = unit(camera.project(positions + PROJECTION_STEP * axes.tangent) - pixels)
    across = np.column_stack((-along[:, 1], along[:, 0]))
    moved = camera.project(positions + PROJECTION_STEP * axes.lateral) - pixels
    scale = np.einsum("ij,ij->i", moved, across) / PROJECTION_STEP
    return pixels, across, np.where(np.abs(scale) > MIN_SCALE, scale, MIN_SCALE)


def on_lattice(pixels: Array) -> Array:
    """Subsample pixels (N, 2) evenly to about MAX_MASK_PIXELS (20,000).

    The pixels kept lie on a lattice that is nearly as fine in every direction. In each row every k-th
    pixel is taken, shifted from row to row by about the golden section of k. Areas therefore keep their share of the pixels.
    """
    step = -(-len(pixels) // MAX_MASK_PIXELS)
    if step <= 1:
        return pixels
    slope = min((k for k in range(1, step) if math.gcd(k, step) == 1), key=lambda k: abs(k - step / GOLDEN_RATIO))
    return np.asarray(pixels[(pixels[:, 0] + slope * pixels[:, 1]) % step == 0])


def _image_lengths(pixels: Floats, path: Ints) -> Floats:
    """Return the length of image, px, that each sample stands for: half way to either neighbor on its path."""
    step = np.linalg.norm(np.diff(pixels, axis=0), axis=1) * (np.diff(path) == 0)
    return np.asarray((np.concatenate(([0.0], step)) + np.concatenate((step, [0.0]))) / 2)

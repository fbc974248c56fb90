"""The silhouette of the object at samples along its axis: the middle and the width of the mask across the path."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.constants import golden

from ...geometry.noise import SURFACE_SAMPLES
from ...geometry.polyline import unit
from ...kernels import lateral_sums, lattice_pixels, nearest, window_sum
from ...types import Bools, Camera, Floats, Ints
from .cross_sections import SectionAxes

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
        (S,) m (px in 2-D), from the sample to the middle of the mask, positive along the lateral axis; 0 if no mask is near the
        sample.
    radius
        (S,) m (px in 2-D), half the width of the mask; 0 if no mask is near the sample.
    """

    offset: Floats
    radius: Floats


class MaskSample(NamedTuple):
    """About SURFACE_SAMPLES (20,000) pixels of a mask, evenly distributed; all of them if there are not more.

    Attributes
    ----------
    pixels
        (K, 2) px, (u, v), sorted by u and then v.
    share
        number of pixels of the mask that each stands for.
    """

    pixels: Floats
    share: float

    @staticmethod
    def of(mask: Bools) -> MaskSample:
        """Return the sample of a mask (H, W).

        Areas keep their share of the pixels: in each row every k-th pixel is kept, shifted from row to row by about the golden
        section of k, so that the pixels kept lie on a lattice that is nearly as fine in every direction.
        """
        mask = np.ascontiguousarray(mask)
        count = int(np.count_nonzero(mask))
        step = max(1, -(-count // SURFACE_SAMPLES))
        slope = min((k for k in range(1, step) if math.gcd(k, step) == 1), key=lambda k: abs(k - step / golden), default=0)
        pixels = lattice_pixels(mask, step, slope)
        return MaskSample(pixels, count / max(1, len(pixels)))


def measure_silhouette(
    positions: Floats,
    axes: SectionAxes,
    path: Ints,
    mask: MaskSample,
    camera: Camera | None,
    reach: Floats,
    window_half: int,
) -> Silhouette:
    """Measure the middle and half the width of the object's mask at samples, across the object.

    Every pixel of the mask is assigned to the nearest sample in the image. The number of pixels of a sample, divided by the
    length of path in the image around the sample, is the width; the mean of their lateral offsets is the middle.

    Parameters
    ----------
    positions
        (S, 3) m in the camera's optical frame, in 2-D (S, 2) px: the positions of S samples.
    axes
        the axes of the cross-section at each sample.
    path
        (S,) int, index of the path that each sample lies on; the samples of one path are consecutive.
    mask
        the pixels of the mask.
    camera
        the intrinsics; None if the positions are pixels.
    reach
        (S,) m (px in 2-D), one per sample; pixels farther than this from their sample are left out.
    window_half
        number of samples on either side, on the same path, whose pixels are pooled with those of a sample.

    Returns
    -------
    Offset of the middle and half-width at each sample, m (px in 2-D).
    """
    pixels, across, scale = _project_axes(positions, axes, camera)
    reach = reach * np.abs(scale)
    distance, near = nearest(mask.pixels, pixels, float(reach.max()), True)
    sums = lateral_sums(mask.pixels, distance, near, pixels, across, reach)
    count, total = (window_sum(mask.share * each, path, window_half) for each in sums)
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


def _image_lengths(pixels: Floats, path: Ints) -> Floats:
    """Return the length of image, px, that each sample stands for: half way to either neighbor on its path."""
    step = np.linalg.norm(np.diff(pixels, axis=0), axis=1) * (np.diff(path) == 0)
    return np.asarray((np.concatenate(([0.0], step)) + np.concatenate((step, [0.0]))) / 2)

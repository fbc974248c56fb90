"""The silhouette of the object at samples along its axis: the middle and the width of the mask across the path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.constants import golden

from ... import kernels
from ...facts.frame_facts import FrameFacts
from ...geometry.noise import SURFACE_SAMPLES
from ...types import Camera, Floats, Ints
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
    def of(facts: FrameFacts) -> MaskSample:
        """Return the sample of a mask.

        Areas keep their share of the pixels: in each row every k-th pixel is kept, shifted from row to row by about the golden
        section of k, so that the pixels kept lie on a lattice that is nearly as fine in every direction.
        """
        return MaskSample(*facts.lattice_pixels(SURFACE_SAMPLES, golden))


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
    intrinsics = np.zeros(0) if camera is None else np.array((camera.fx, camera.fy, camera.cx, camera.cy))
    return Silhouette(
        *kernels.silhouette(
            positions, axes.tangent, axes.lateral, path, *mask, intrinsics, reach, window_half, PROJECTION_STEP, MIN_SCALE
        )
    )

"""Spacing of surface points and radius of the object, before there is a chain."""

from __future__ import annotations

import math

import numpy as np

from ..kernels import neighborhood_spreads
from ..types import Floats, Foreground
from .mask import mask_radius
from .sparse_grid import SAMPLE_POINTS, SAMPLE_SEEDS, cloud_spacing


def point_spacing(foreground: Foreground) -> float:
    """Return the typical distance between neighboring surface points in m.

    With a camera it is the side of a pixel at the median depth. For a cloud it follows from the density of the points
    (`cloud_spacing`).

    foreground : the object's points, (N, 3) m, N >= 1.
    """
    if foreground.camera is not None:
        return float(np.median(foreground.points[:, 2])) / foreground.camera.fx
    return cloud_spacing(foreground.points)


def estimate_radius(foreground: Foreground, apart: float) -> float:
    """Estimate the radius of the object in m (3-D only), before there is a chain.

    With a mask and depth it is the median half-width of the mask. For a cloud it is the median half-width of the points in
    neighborhoods that look like a strip; without any such neighborhood, a sixth of the diagonal of the cloud's bounding box.

    Parameters
    ----------
    foreground
        the object's points, with mask, depth and camera if there are any.
    apart
        m, typical distance between neighboring surface points, as `point_spacing` returns it; no smaller radius is returned.
    """
    if foreground.mask is not None and foreground.camera is not None and foreground.depth is not None:
        radius = foreground.mask_radius
        if radius is None:
            radius = mask_radius(foreground.mask, foreground.depth, foreground.camera.fx)
        return max(radius, apart)
    return max(_cloud_radius(foreground.points, apart), apart)


def _cloud_radius(points: Floats, apart: float) -> float:
    """Return the median half-width in m of a cloud where it looks like a strip.

    Around each of some seeds the neighborhood grows until it is three times as long as it is wide. The variance
    across is then r^2 / 3 for the half shell that one camera sees (uniform over the projected width) and r^2 / 2
    for a whole tube, told apart by the variance in depth.
    """
    sample = np.ascontiguousarray(points[:: max(1, len(points) // SAMPLE_POINTS)])
    seeds = np.ascontiguousarray(sample[:: max(1, len(sample) // SAMPLE_SEEDS)])
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    radii: list[float] = []
    reach = 3 * apart * math.sqrt(len(points) / len(sample))
    while len(seeds) and reach < extent:
        counts, _, covariances = neighborhood_spreads(sample, seeds, reach)
        thin, wide, length = np.linalg.eigvalsh(covariances.reshape(-1, 3, 3)).T
        long = (counts > 8) & (wide < length / 9)
        radii += np.sqrt(np.maximum(wide, 1e-18) * (3 - np.minimum(1.0, thin / np.maximum(wide, 1e-18))))[long].tolist()
        seeds = np.ascontiguousarray(seeds[~long])
        reach *= 1.3
    return float(np.median(radii)) if radii else extent / 6

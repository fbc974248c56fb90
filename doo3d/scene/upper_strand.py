"""The log odds that one of two crossing strands is the upper: from the depth of their surfaces, and from their colors.

Letters: C crossings, two strands each; S samples along a strand; A samples across it.
"""

import numpy as np
from scipy.spatial import cKDTree

from ..config import CrossingsConfig
from ..geometry.noise import COLOR_NOISE, DEVIATIONS
from ..geometry.projection import Projection
from ..geometry.radii import CORE_OFFSETS
from ..kernels import CrossingStrands
from ..types import Array, Bools, Floats

NEAREST_POINTS = 8
"""Points of a cloud of which the nearest to the sensor is taken for the surface."""

PROFILE_OFFSETS = np.linspace(-0.75, 0.75, 7)
"""Lateral offsets, in half-widths, of the colors across a strand."""


def depth_log_odds(strands: CrossingStrands, depth: Array, mask: Bools) -> Floats:
    """Return the log-odds (C,) that the first strand of each crossing is upper, by the readings of depth beside the overlap.

    strands : at the crossings. depth, mask : (H, W) m, 0 = no reading, and (H, W) bool.
    """
    image = np.ascontiguousarray(depth, dtype=np.float32)
    surface: Floats = strands.readings(CORE_OFFSETS, image, np.ascontiguousarray(mask))
    return strands.depth_log_odds(surface, DEVIATIONS)


def cloud_log_odds(strands: CrossingStrands, half_width: Floats, points: Floats, view: Projection) -> Floats:
    """Return the log-odds (C,) that the first strand of each crossing is upper, by the surface of a cloud beside the overlap.

    The surface is at the nearest to the sensor of the points within half of the greatest half-width.

    Parameters
    ----------
    strands
        at the crossings, in the view.
    half_width
        (C, 2), half the width of each strand at the crossing, in the unit of the view.
    points
        (N, 3) m, of the cloud.
    view
        the projection of points to the view.
    """
    positions = strands.positions(CORE_OFFSETS).reshape(-1, 2)
    surface = _nearest_in_cloud(positions, points, view, 0.5 * float(half_width.max()))
    return strands.depth_log_odds(surface, DEVIATIONS)


def color_log_odds(strands: CrossingStrands, image: Array, config: CrossingsConfig) -> Floats:
    """Return the log-odds (C,) that the first strand of each crossing is upper, by the colors in the overlap.

    They are 0, (1,), without a color image, (0, 0, 3), and where the settings say that colors do not count.
    """
    if not (image.size and config.use_color):
        return np.zeros(1)
    return strands.color_log_odds(np.ascontiguousarray(image), PROFILE_OFFSETS, COLOR_NOISE)


def _nearest_in_cloud(positions: Floats, points: Floats, view: Projection, reach: float) -> Floats:
    """Return the distance of the surface of a cloud (N, 3) m at positions (P, 2) in the view, (P,); NaN for none."""
    known = np.isfinite(positions).all(axis=1)
    surface, positions = np.full(len(positions), np.nan), positions[known]
    if len(positions):
        shown = view.project(points)
        around = ((shown > positions.min(axis=0) - reach) & (shown < positions.max(axis=0) + reach)).all(axis=1)
        near = cKDTree(shown[around]).query(positions, k=NEAREST_POINTS, distance_upper_bound=reach)[1]
        surface[known] = np.fmin.reduce(np.append(view.distance(points[around]), np.nan)[near], axis=1)
    return surface

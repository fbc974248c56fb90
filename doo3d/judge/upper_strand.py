"""The log odds that one of two crossing strands is the upper: from the depth of their surfaces, and from their colors.

Letters: C crossings, two strands each; S samples along a strand; A samples across it.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.curves import Curves
from ..geometry.intersections import Intersections
from ..geometry.noise import COLOR_NOISE, DEVIATIONS
from ..geometry.projection import Projection
from ..geometry.radii import CORE_OFFSETS
from ..kernels import CrossingStrands
from ..types import Array, Floats, Foreground

SAMPLE_DISTANCES = np.linspace(0.0, 5.0, 16)
"""Half-widths beyond the overlap, on both sides, of the samples along a strand."""

OVERLAP_MARGIN = 1.2
"""Half-lengths of the overlap that are left out of what counts as beyond it."""

MIN_ANGLE = 0.3
"""rad; strands that cross at less are taken to cross at this, or their overlap would have no end."""

NEAREST_POINTS = 8
"""Points of a cloud of which the nearest to the sensor is taken for the surface."""

PROFILE_OFFSETS = np.linspace(-0.75, 0.75, 7)
"""Lateral offsets, in half-widths, of the colors across a strand."""


def upper_strand_log_odds(
    intersections: Intersections, chains: Curves, radius: Floats, view: Projection, foreground: Foreground
) -> Floats:
    """Return the log odds that the first strand of each crossing is the upper one, judged by depth and color.

    Parameters
    ----------
    intersections
        C intersections of the chains in the view.
    chains
        the joints of all chains as (u, v, distance): position in the view and distance along the viewing direction.
    radius
        (C, 2) m (px in 2-D), radius of the two strands at each crossing.
    view
        the projection of points to the view.
    foreground
        the object's points, with depth, mask and color if there are any.

    Returns
    -------
    (C,) natural log odds, positive if the first strand is probably upper; 0 if neither depth nor color tells.
    """
    depth = chains.interpolate(intersections.chain, intersections.segment + intersections.t)[..., 2]
    half_width = radius * view.scale(depth)
    crossings = (intersections.chain, intersections.segment, intersections.t, intersections.angle, intersections.point)
    overlap = (SAMPLE_DISTANCES, OVERLAP_MARGIN, MIN_ANGLE)
    strands = CrossingStrands(chains.points, chains.bounds, chains.closed, *crossings, radius, half_width, *overlap)
    log_odds = np.zeros(len(depth))
    if foreground.points.shape[1] == 3:
        log_odds += depth_log_odds(strands, half_width, foreground, view)
    return log_odds if foreground.color is None else log_odds + color_log_odds(strands, foreground.color)


def depth_log_odds(strands: CrossingStrands, half_width: Floats, foreground: Foreground, view: Projection) -> Floats:
    """Return the log odds (C,) that the first strand of each crossing is upper, by the depth of the surfaces beside the overlap.

    half_width : (C, 2), half the width of each strand at the crossing, in the unit of the view. In a cloud, the surface is at the
    nearest to the sensor of the points within half of the greatest.
    """
    if foreground.depth is not None and foreground.mask is not None:
        image = np.ascontiguousarray(foreground.depth, dtype=np.float32)
        surface: Floats = strands.readings(CORE_OFFSETS, image, np.ascontiguousarray(foreground.mask))
    else:
        positions = strands.positions(CORE_OFFSETS).reshape(-1, 2)
        surface = _nearest_in_cloud(positions, foreground.points, view, 0.5 * float(half_width.max()))
    return strands.depth_log_odds(surface, DEVIATIONS)


def color_log_odds(strands: CrossingStrands, image: Array) -> Floats:
    """Return the log odds (C,) that the first strand of each crossing is upper, by the colors (H, W, 3) uint8 in the overlap."""
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

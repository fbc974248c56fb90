"""The log odds that one of two crossing strands is the upper: from the depth of their surfaces, and from their colors."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ...geometry.curves import Curves
from ...geometry.intersections import Intersections
from ...geometry.limits import AT_ONCE
from ...geometry.projection import Projection
from ...types import Floats, Foreground
from .overlap import CrossingStrands, Lookup, color_log_odds, depth_order, sample_strands

DEPTH_DEVIATION = 0.5
"""Thicknesses; standard deviation of a difference in depth. Strands that touch are 1 apart."""

SURFACE_WEIGHT = 0.75
"""Weight of the measured surfaces beside that of the chains: the chain of the lower strand is filled in at the crossing."""

MAX_DEPTH_DIFFERENCE = 1.5
"""Thicknesses up to which a difference in depth counts."""

NEAREST_POINTS = 8
"""Points of a cloud of which the nearest to the sensor is taken for the surface."""


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
    strands = sample_strands(intersections, chains, radius * view.scale(depth))
    log_odds = np.zeros(len(depth))
    if foreground.points.shape[1] == 3:
        log_odds += _depth_log_odds(strands, depth, radius, _surface_lookup(foreground, view, strands))
    return log_odds if foreground.color is None else log_odds + color_log_odds(strands, foreground.color)


def _depth_log_odds(strands: CrossingStrands, depth: Floats, radius: Floats, surface: Lookup) -> Floats:
    """Return the log odds (C,) by depth: from the difference of the strands, and of their measured surfaces."""
    thickness = np.maximum(radius.sum(axis=1), 1e-9)
    in_front = depth_order(strands, surface, radius)
    difference = (depth[:, 1] - depth[:, 0]) / thickness
    measured = np.isfinite(in_front)
    deviation = np.where(measured, DEPTH_DEVIATION, 2 * DEPTH_DEVIATION)
    difference = np.where(measured, SURFACE_WEIGHT * in_front / thickness + (1 - SURFACE_WEIGHT) * difference, difference)
    return np.asarray(2 * np.clip(difference, -MAX_DEPTH_DIFFERENCE, MAX_DEPTH_DIFFERENCE) / deviation**2)


def _surface_lookup(foreground: Foreground, view: Projection, strands: CrossingStrands) -> Lookup:
    """Return the lookup of the surface's distance: in the depth image within the mask, or from points of the cloud nearby."""
    if foreground.depth is not None and foreground.mask is not None:
        depth, mask = foreground.depth, foreground.mask

        def in_depth_image(positions: Floats) -> Floats:
            u, v = np.rint(positions[..., 0]), np.rint(positions[..., 1])
            inside = (u >= 0) & (v >= 0) & (u < depth.shape[1]) & (v < depth.shape[0])
            pixels = np.where(inside, v, 0).astype(int), np.where(inside, u, 0).astype(int)
            return np.where(inside & mask[pixels] & (depth[pixels] > 0), depth[pixels].astype(float), np.nan)

        return in_depth_image
    reach = 0.5 * float(strands.half_width.max())

    def in_cloud(positions: Floats) -> Floats:
        asked = positions.reshape(len(positions), -1, 2)
        low, high = np.fmin.reduce(asked, axis=1) - reach, np.fmax.reduce(asked, axis=1) + reach
        parts = (foreground.points[first : first + AT_ONCE] for first in range(0, max(len(foreground.points), 1), AT_ONCE))
        rows = np.concatenate([_rows_in_boxes(part, view, low, high) for part in parts])
        tree, known = cKDTree(rows[:, :2], balanced_tree=False, compact_nodes=False), np.append(rows[:, 2], np.inf)
        finite = np.where(np.isfinite(positions), positions, 1e9).reshape(-1, 2)
        nearest = known[tree.query(finite, NEAREST_POINTS, distance_upper_bound=reach)[1]].min(axis=1)
        return np.where(np.isfinite(nearest), nearest, np.nan).reshape(positions.shape[:-1])

    return in_cloud


def _rows_in_boxes(points: Floats, view: Projection, low: Floats, high: Floats) -> Floats:
    """Return (u, v, distance) of those points (N, 3) m that the view shows in one of the boxes from low to high (C, 2)."""
    shown = view.project(points)
    inside = (shown >= low[:, None]) & (shown <= high[:, None])
    near = (inside[..., 0] & inside[..., 1]).any(axis=0)
    return np.column_stack((shown[near], view.distance(points[near])))

"""Let cables come to rest on a table and on each other without intersecting."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ...types import Floats, Ints
from .stacking import OWN_ARC_RADII

STEP = 0.003
"""m between the points of a cable that settles."""

ROUNDS, RESTING_ROUNDS, PUSHES = 280, 100, 3
"""Rounds of falling and of coming to rest; times that strands are pushed apart in a round."""

FALL_RADII, RELAXATION = 0.075, 1.6
"""Radii by which a cable falls in a round; factor of a push (successive over-relaxation)."""

SMOOTHING_STEPS = (1, 2, 4, 8, 12)
"""Steps over which the displacement of a point is averaged: the stiffness of the cable."""

CONTACT = 1.035
"""Sums of radii between the axes of strands that touch, with a little for the sampling."""


def settle(points: Floats, radius: float) -> Floats | None:
    """Return the axis of a cable after it fell onto the table and onto itself: (P, 3) m in the world frame.

    Parameters
    ----------
    points
        (P, 3) m, points STEP apart in the plane.
    radius
        radius of the cable, m.

    Returns
    -------
    The points of the axis at rest; None if strands intersect before they fall.

    Notes
    -----
    Position-based dynamics (Mueller et al., 2007): each round lowers all points, smooths how far they have moved, and pushes
    strands apart that are nearer than their thickness.
    """
    axis, apart = points.copy(), CONTACT * 2 * radius
    i, j = _touching(axis, apart, radius)
    if np.linalg.norm(axis[i] - axis[j], axis=1).min(initial=apart) < 1.8 * radius:
        return None
    for k in range(ROUNDS + RESTING_ROUNDS):
        axis[:, 2] -= FALL_RADII * radius * (k < ROUNDS)
        moved = axis - points
        for step in SMOOTHING_STEPS:
            moved[step:-step] = (moved[step:-step] + (moved[: -2 * step] + moved[2 * step :]) / 2) / 2
        axis = points + moved
        i, j = _touching(axis, 1.1 * apart, radius)
        for _ in range(PUSHES):
            between = axis[j] - axis[i]
            distance = np.maximum(np.linalg.norm(between, axis=1, keepdims=True), 1e-9)
            push = np.maximum(apart - distance, 0) / 2 * between / distance
            both, near = np.r_[i, j], np.tile(distance[:, 0] < apart, 2)
            total = np.column_stack([np.bincount(both, part, len(axis)) for part in np.vstack((-push, push)).T])
            axis += RELAXATION * total / np.maximum(np.bincount(both[near], minlength=len(axis)), 1)[:, None]
            axis[:, 2] = np.maximum(axis[:, 2], radius)
    return axis


def _touching(axis: Floats, reach: float, radius: float) -> tuple[Ints, Ints]:
    """Return the pairs of points, (Q,) each, of different strands of one cable that are nearer than `reach` m."""
    i, j = cKDTree(axis).query_pairs(reach, output_type="ndarray").T
    strands = np.abs(i - j) * STEP > OWN_ARC_RADII * radius
    return i[strands], j[strands]

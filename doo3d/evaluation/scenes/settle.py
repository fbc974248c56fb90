"""Simulate a cable that falls onto a table and onto itself, until it rests without intersecting."""

import numpy as np
from scipy.spatial import cKDTree

from ...types import Floats, Ints
from .stacking import OWN_ARC_RADII

STEP = 0.003
"""Distance in m between the points of a cable that settles."""

ROUNDS, RESTING_ROUNDS, PUSHES = 280, 100, 3
"""Numbers of rounds of falling and of coming to rest; number of times that strands are pushed apart in each round."""

FALL_RADII, RELAXATION = 0.075, 1.6
"""Fall per round, in radii; factor of a push (successive over-relaxation)."""

SMOOTHING_STEPS = (1, 2, 4, 8, 12)
"""Distances, in points, over which displacements are averaged; they make the cable stiff."""

CONTACT = 1.035
"""Distance between the axes of touching strands, in sums of their radii; slightly above 1 because of the sampling."""


def settle(points: Floats, radius: float) -> Floats | None:
    """Return the axis of a cable after it fell onto the table and onto itself: (P, 3) m in the world frame.

    Parameters
    ----------
    points
        (P, 3) m, world frame, P points at a spacing of STEP.
    radius
        radius of the cable, m.

    Returns
    -------
    The points of the axis at rest; None if strands intersect before they fall.

    Notes
    -----
    Position-based dynamics (Mueller et al., 2007): each round lowers all points, smooths their displacements, and pushes strands
    apart that are nearer than their thickness.
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
    """Return the index pairs (Q,) of points of different strands of one cable that are nearer than `reach` (m)."""
    i, j = cKDTree(axis).query_pairs(reach, output_type="ndarray").T
    strands = np.abs(i - j) * STEP > OWN_ARC_RADII * radius
    return i[strands], j[strands]

"""Measure necks: a tip that only touches a strand is narrower at the contact than before it, a branch keeps its width.

The width of the object in the image is measured in cuts parallel to the trunk, from the trunk's surface outwards. A width well
below the diameter of the branch shows the background beside a tip.
"""

import numpy as np

from ...geometry.curves import runs
from ...geometry.polyline import unit
from ...scene.scene import Scene
from ...types import Bools, Floats, Ints
from .strands import ARM_RADII, SampledChain, across_view, view_direction

FIRST_CUT, NECK_END, LAST_CUT = 0.6, 2.5, 6.0
"""Distance of the first cut from the trunk's axis, in radii of the trunk. Distances from the trunk's surface, in radii of the
branch, up to which a narrow cut is a neck, and up to which the width of the branch is measured."""

CLEARANCE_RADII = 2.0
"""Largest difference in depth, in radii of the trunk, of a pixel of the branch: depth is uncertain at edges."""

CELL_RADII, CELLS = 0.125, 32
"""Spacing of the cuts, and of the positions of a cut, in radii of the branch; and number of positions on each side of the axis.
A cut whose inner half of positions is off the object shows a gap: ends are uncertain."""


def neck_share(branch: Floats, radius: float, trunk: SampledChain, at: float, scene: Scene) -> float:
    """Return the share of its diameter that a branch lacks in its narrowest cut before it meets a trunk.

    Parameters
    ----------
    branch
        (P, D) m (px in 2-D), P >= 2 points along the axis of the branch, beginning with the end at the trunk.
    radius
        radius of the branch, m (px in 2-D).
    trunk, at
        the trunk, and the arc length on it at which the branch ends, m (px in 2-D).
    scene
        what was captured: the image shows the background beside the object.

    Returns
    -------
    0 for a branch that keeps its width, 1 for one that ends before the trunk.
    """
    place, sample = trunk.at(at), int(np.abs(trunk.along - at).argmin())
    surface = float(trunk.radii[sample])
    towards = view_direction(place, scene)
    along = unit(across_view(trunk.direction(sample), towards))
    count = round((surface + ARM_RADII[1] * radius) / max(float(np.linalg.norm(branch[1] - branch[0])), 1e-12))
    line = across_view(branch[: max(2, count)] - place, towards)
    inside = np.flatnonzero(np.linalg.norm(line, axis=1) <= surface + radius)
    line = line[inside[-1] + 1 if len(inside) else 0 :]
    if not len(line):
        return 0.0
    away = unit(line[0] - (line[0] @ along) * along)
    height, shift = np.append(0.0, line @ away), np.append(0.0, line @ along)
    rising = np.concatenate(([True], np.diff(np.maximum.accumulate(height)) > 0))
    cell = CELL_RADII * radius
    cuts = np.arange(FIRST_CUT * surface, min(surface + LAST_CUT * radius, height.max()), cell)
    is_near = cuts < surface + NECK_END * radius
    if not is_near.any():
        return 0.0
    arcs = np.interp(cuts, height[rising], shift[rising])[:, None] + cell * np.arange(-CELLS, CELLS + 1)
    points = place + arcs[..., None] * along + cuts[:, None, None] * away
    is_beside = scene.is_beside(points.reshape(-1, len(place)), CLEARANCE_RADII * surface).reshape(arcs.shape)
    width = cell * _run_lengths(~is_beside)
    full = 2 * radius if is_near.all() else min(2 * radius, float(np.median(width[~is_near])))
    missing = full - width[is_near].min() - scene.pixel_at(place)
    return float(np.clip(missing / (2 * radius), 0, 1))


def _run_lengths(is_object: Bools) -> Ints:
    """Return the number of positions in the longest run of each cut on the object, of those runs near the branch's axis."""
    columns = is_object.shape[1] + 1
    first, end = np.array(runs(np.pad(is_object, ((0, 0), (0, 1))).ravel()), dtype=int).reshape(-1, 2).T
    cut, at = np.divmod(first, columns)
    length = end - first
    near = (at <= CELLS + CELLS // 2) & (at + length > CELLS - CELLS // 2)
    longest = np.zeros(len(is_object), dtype=int)
    np.maximum.at(longest, cut[near], length[near])
    return longest

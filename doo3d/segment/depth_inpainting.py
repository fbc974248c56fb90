"""Inpaint the depth of a mask where the object is visible in color and the sensor has no reading."""

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import spsolve

from ..geometry.disjoint_set import joined_groups
from ..scene.frame_facts import FrameFacts
from ..types import Floats, Ints
from .depth_filter import Readings

INPAINT_MIN_HOLE_PX = 2
"""Minimum distance in px from a reading at which depth is inpainted; smaller holes are closed by the voxels."""


def inpaint_readings(readings: Readings, facts: FrameFacts, max_slope: float) -> Readings:
    """Add readings in the holes of the depth: pixels of the mask without a reading.

    The depth solves Laplace's equation with the readings at the border of the hole and no flux through the edge of the mask:
    along a strand it is linear from reading to reading, and constant beyond the last reading. Pixels where the inpainted depth
    changes by more than `max_slope` lie between two strands and are left out.

    Parameters
    ----------
    readings
        the measured readings, without outliers.
    facts
        the mask of the object, with the depth. A pixel whose reading was removed as an outlier is no hole, and is not inpainted.
    max_slope
        m per pixel, the largest depth step between neighboring pixels of one surface.

    Returns
    -------
    The measured and the inpainted readings, in row-major order of their pixels. `depth` and `filtered` of an inpainted reading
    are equal. Holes in which every pixel lies within 2 px of a reading are not filled.
    """
    if not len(readings.pixels) or facts.readings == facts.count:
        return readings
    holes = facts.depth_holes(readings.pixels, INPAINT_MIN_HOLE_PX)
    if not len(holes):
        return readings
    corner = holes.min(axis=0) - 1
    width, height = holes.max(axis=0) + 2 - corner
    u, v = (readings.pixels - corner).T
    around = (u >= 0) & (v >= 0) & (u < width) & (v < height)
    measured = np.zeros((height, width))
    measured[v[around], u[around]] = readings.filtered[around]
    filled, inpainted = _solve_laplace((holes - corner) @ (1, width), measured.ravel(), width, max_slope)
    if not len(filled):
        return readings
    v, u = np.divmod(filled, width)
    pixels = np.concatenate((readings.pixels, np.column_stack((u, v)) + corner))
    order = np.argsort(pixels @ (1, facts.mask.shape[1]), kind="stable")  # timsort merges the two sorted parts
    return Readings(pixels[order], np.append(readings.depth, inpainted)[order], np.append(readings.filtered, inpainted)[order])


def _solve_laplace(pixels: Ints, measured: Floats, width: int, max_slope: float) -> tuple[Ints, Floats]:
    """Return the pixels of holes that can be inpainted, and their depth, m.

    The depth of each pixel is the mean of its neighbors that are in a hole or measured: a sparse linear system with an equation
    per pixel. Holes without a reading beside them, and pixels at which the result is too steep, are left out.

    Parameters
    ----------
    pixels
        (K,) int, row-major indices of the pixels in holes, ascending, none at the border of the image.
    measured
        (H * W,) m, the readings in row-major order; 0 = no reading.
    width
        px, width of the image.
    max_slope
        m per pixel, maximum step to a neighboring pixel.
    """
    pixels, neighbor, value = _with_reading_beside(pixels, measured, width)
    count, inside = len(pixels), neighbor >= 0
    if not count:
        return pixels, np.zeros(0)
    degree = (inside | (value > 0)).sum(axis=1)
    i = np.concatenate((np.nonzero(inside)[0], np.arange(count)))
    j = np.concatenate((neighbor[inside], np.arange(count)))
    entries = np.concatenate((np.full(len(i) - count, -1.0), degree))
    depth = np.asarray(spsolve(csr_matrix((entries, (i, j)), (count, count)).tocsc(), value.sum(axis=1)))
    beside = np.where(inside, depth[neighbor], value)
    slope = np.where(beside > 0, np.abs(beside - depth[:, None]), 0.0).max(axis=1)
    kept = (depth > 0) & (slope <= max_slope)
    return pixels[kept], depth[kept]


def _with_reading_beside(pixels: Ints, measured: Floats, width: int) -> tuple[Ints, Ints, Floats]:
    """Return the pixels of the holes that have a reading beside them, with their four neighbors.

    Returns
    -------
    pixels : (K,) int.
    neighbor : (K, 4) int, index in `pixels` of each neighbor, -1 = not in the hole.
    value : (K, 4) m, the reading at each neighbor, 0 = no reading.
    """
    beside = pixels[:, None] - np.array((1, width, -1, -width))
    found = np.minimum(np.searchsorted(pixels, beside), len(pixels) - 1)
    inside, value = pixels[found] == beside, measured[beside]
    label = joined_groups(np.column_stack((np.nonzero(inside)[0], found[inside])), len(pixels))
    kept = (np.bincount(label, weights=(value > 0).any(axis=1)) > 0)[label]
    number = np.cumsum(kept) - 1
    return pixels[kept], np.where(inside, number[found], -1)[kept], value[kept]

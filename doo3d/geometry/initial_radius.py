"""Spacing of surface points and radius of the object, before there is a chain."""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..kernels import neighborhood_spreads
from ..types import Floats, Foreground, Ints
from .mask import mask_radius
from .sparse_grid import SAMPLE_POINTS, SAMPLE_SEEDS, cloud_spacing

STRAND_SPACINGS = 3.0
"""Point spacings; parts of a cloud that are farther apart are strands of their own when the first radius is measured."""

MIN_STRAND_FRACTION, MIN_LARGE_FRACTION = 0.05, 0.8
"""Fraction of the points that a strand has at least, and that all such strands have together, to be looked at one by one."""


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
    strands = None if foreground.sampling is None else foreground.sampling.strands
    return max(_cloud_radius(foreground.points, apart, strands), apart)


def _cloud_radius(points: Floats, apart: float, number: Ints | None) -> float:
    """Return the median half-width in m of a cloud where it looks like a strip.

    Around each of some seeds the neighborhood grows until it is three times as long as it is wide. The variance
    across is then r^2 / 3 for the half shell that one camera sees (uniform over the projected width) and r^2 / 2
    for a whole tube, told apart by the variance in depth. Strands side by side with air between them are looked at one by one,
    since together they are wider than each; `number` is that of the strand of each sampled point, None if all touch.
    """
    sample = _sample(points)
    seeds = np.ascontiguousarray(sample[:: max(1, len(sample) // SAMPLE_SEEDS)])
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    radii: list[float] = []
    sample_apart = apart * math.sqrt(len(points) / len(sample))
    strands = [(sample, seeds)]
    if number is not None:
        own = number[:: max(1, len(sample) // SAMPLE_SEEDS)]
        strands = [(np.ascontiguousarray(sample[number == k]), seeds[own == k]) for k in range(int(number.max()) + 1)]
    for strand, own_seeds in strands:
        reach, seeds = 3 * sample_apart, np.ascontiguousarray(own_seeds)
        while len(seeds) and reach < extent:
            counts, _, covariances = neighborhood_spreads(strand, seeds, reach)
            thin, wide, length = np.linalg.eigvalsh(covariances.reshape(-1, 3, 3)).T
            long = (counts > 8) & (wide < length / 9)
            radii += np.sqrt(np.maximum(wide, 1e-18) * (3 - np.minimum(1.0, thin / np.maximum(wide, 1e-18))))[long].tolist()
            seeds = np.ascontiguousarray(seeds[~long])
            reach *= 1.3
    return float(np.median(radii)) if radii else extent / 6


def separate_strands(points: Floats, apart: float) -> tuple[float | None, Ints | None]:
    """Find the strands of a cloud that do not touch.

    Parameters
    ----------
    points
        (N, 3) m.
    apart
        m, typical distance between neighboring surface points.

    Returns
    -------
    gap : m, least distance between two strands; None if all touch.
    strands : (S,) number, from 0, of the strand of every k-th point, as `CloudSampling.strands` holds it; None if all touch.
    """
    sample = _sample(points)
    large, label = _parts(sample, STRAND_SPACINGS * apart * math.sqrt(len(points) / len(sample)))
    if not len(large):
        return None, None
    is_large = np.isin(label, large)
    gap = min(
        float(cKDTree(sample[(label != part) & is_large]).query(sample[label == part])[0].min()) for part in large[1:].tolist()
    )
    return gap, np.where(is_large, np.searchsorted(large, label), -1)


def strand_of_points(points: Floats, strands: Ints) -> Ints:
    """Return the number of the strand that each point of a cloud belongs to, (N,) from 0; in small parts that of the nearest.

    Parameters
    ----------
    points
        (N, 3) m, in the order of the points that `separate_strands` was given.
    strands
        (S,) number of the strand of every k-th point, as `separate_strands` returns it.
    """
    sample, is_large = _sample(points), strands >= 0
    first, _ = _distinct(sample[is_large])
    near = cKDTree(sample[is_large][first]).query(points)[1]
    return np.asarray(strands[is_large][first][near])


def _sample(points: Floats) -> Floats:
    return np.ascontiguousarray(points[:: max(1, len(points) // SAMPLE_POINTS)])


def _distinct(points: Floats) -> tuple[Ints, Ints]:
    """Return the row of the first of equal points, in the order given, (U,), and for each point which of these it is, (N,).

    Many equal points make a k-d tree as slow as comparing all with all.
    """
    _, first, own = np.unique(points, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[own.ravel()]


def _parts(sample: Floats, apart: float) -> tuple[Ints, Ints]:
    """Return the large parts of a cloud that lie farther than `apart` m from each other, and the part of each point, (N,).

    No parts if there is one only, or if many points are in small ones.
    """
    first, own = _distinct(sample)
    pairs = cKDTree(sample[first]).query_pairs(apart, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=(len(first), len(first)))
    label = connected_components(graph, directed=False)[1][own]
    size = np.bincount(label)
    large = np.flatnonzero(size >= MIN_STRAND_FRACTION * len(sample))
    if len(large) < 2 or size[large].sum() < MIN_LARGE_FRACTION * len(sample):
        large = large[:0]
    return large, label

"""Facts of a cloud: spacing of its points, strands that do not touch; and the first radius of the object."""

import math
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.cells import box_shape, cell_coords, cell_keys, neighbors_of
from ..kernels import connected_parts, neighborhood_sums
from ..types import Floats, Ints

SAMPLE_POINTS, SAMPLE_SEEDS = 8000, 80
"""Points of a cloud, and seeds among them, on which its density is measured."""

CELL_SPACINGS = 2.0
"""Point spacings; edge of the cells in which the points of a cloud are sorted: finer ones would be empty here and there on a
surface. The 3 x 3 x 3 around a point hold its neighbors, and points in cells side by side are of one strand."""

MIN_STRAND_FRACTION, MIN_LARGE_FRACTION = 0.05, 0.8
"""Fraction of the points that a strand has at least, and that all such strands have together, to be looked at one by one."""


class CloudFacts:
    """What the stages ask of the points of a cloud, measured on a sample of them when it is first asked for.

    points : (N, D) m.
    """

    def __init__(self, points: Floats) -> None:
        self.sample, self.count = sampled(points), len(points)

    @cached_property
    def spacing(self) -> float:
        """Typical distance between neighboring points of a surface in m, at least 1e-6; 1 mm for fewer than two points.

        It follows from the radius of the disc that holds a point's eight nearest neighbors.
        """
        nearest = min(8, len(self.sample) - 1)
        if nearest < 1:
            return 1e-3
        distance = cKDTree(self.sample).query(seeds_of(self.sample), k=[nearest + 1])[0]
        in_sample = float(np.median(distance)) * math.sqrt(math.pi / nearest)
        return max(in_sample * math.sqrt(len(self.sample) / self.count), 1e-6)

    @cached_property
    def strands(self) -> Ints:
        """The number, from 0, of the strand of each point of the sample, (S,); -1 in a small part; empty if all touch.

        Strands are the large connected components of the occupied cells. There are none if many points are in small ones.
        """
        if not len(self.sample):
            return np.zeros(0, dtype=np.int64)
        edge = CELL_SPACINGS * self.spacing * math.sqrt(self.count / len(self.sample))
        origin = self.sample.min(axis=0) - edge
        shape, _ = box_shape(self.sample, origin, edge, 1)
        if not shape:
            return np.zeros(0, dtype=np.int64)
        keys, cell = np.unique(cell_keys(self.sample, origin, edge, shape), return_inverse=True)
        part = connected_parts(neighbors_of(cell_coords(keys, shape)))[cell]
        size = np.bincount(part)
        large = np.flatnonzero(size >= MIN_STRAND_FRACTION * len(part))
        if len(large) < 2 or size[large].sum() < MIN_LARGE_FRACTION * len(part):
            return np.zeros(0, dtype=np.int64)
        return np.where(np.isin(part, large), np.searchsorted(large, part), -1)

    def strands_nearer(self, distance: float) -> bool:
        """Return whether two strands of the sample come nearer to each other than `distance` m; False if all touch."""
        if not len(self.strands):
            return False
        own = [self.sample[self.strands == k] for k in range(int(self.strands.max()) + 1)]
        trees = [cKDTree(points) for points in own]
        return any(trees[i].count_neighbors(trees[j], distance) > 0 for i in range(len(own)) for j in range(i))

    def strand_of(self, points: Floats) -> Ints:
        """Return the number of the strand that each of the points of the cloud, moved as it may be, is nearest to, (N,).

        points : (N, D) m, in the order of the points of the cloud. The strands lie where the points of the sample were moved to.
        If all touch, the number is 0.
        """
        if not len(self.strands):
            return np.zeros(len(points), dtype=np.int64)
        known = self.strands >= 0
        return np.asarray(self.strands[known][cKDTree(sampled(points)[known]).query(points)[1]])


def sampled(points: Floats) -> Floats:
    """Return every k-th of N points, (N, 3), on which the density of a cloud is measured; between 8,000 and 16,000 of more."""
    return points[:: max(1, len(points) // SAMPLE_POINTS)]


def seeds_of(sample: Floats) -> Floats:
    """Return every k-th of the sampled points, (S, 3), around which the density of a cloud is measured."""
    return sample[:: max(1, len(sample) // SAMPLE_SEEDS)]


def strip_half_widths(points: Floats, apart: float, number: Ints) -> Floats:
    """Return the half-widths of a cloud in m where it looks like a strip; a sixth of its diagonal where it nowhere does.

    Around each of some seeds the neighborhood grows until it is three times as long as it is wide. The variance
    across is then r^2 / 3 for the half shell that one camera sees (uniform over the projected width) and r^2 / 2
    for a whole tube, distinguished by the variance in depth. Strands side by side with air between them are looked at one by one,
    since together they are wider than each; `number` is that of the strand of each sampled point, empty if all touch.
    """
    sample = longest_first(sampled(points))
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    radii: list[float] = []
    sample_apart = apart * math.sqrt(len(points) / len(sample))
    strands = [(sample, seeds_of(sample))]
    if len(number):
        own = number[:: max(1, len(sample) // SAMPLE_SEEDS)]
        strands = [(sample[number == k], seeds_of(sample)[own == k]) for k in range(int(number.max()) + 1)]
    for strand, seeds in strands:
        strand, reach = np.ascontiguousarray(strand[np.argsort(strand[:, 0])]), 3 * sample_apart
        while len(seeds) and reach < extent:
            counts, _, covariances = spreads(strand, seeds, reach)
            thin, wide, length = np.linalg.eigvalsh(covariances).T
            long = (counts > 8) & (wide < length / 9)
            if long.any():
                thin, wide = thin[long], np.maximum(wide[long], 1e-18)
                radii += np.sqrt(wide * (3 - np.minimum(1.0, thin / wide))).tolist()
                seeds = seeds[~long]
            reach *= 1.3
    return np.array(radii or [extent / 6])


def longest_first(points: Floats) -> Floats:
    """Return points (N, 3) with their axes in another order: that along which they extend farthest is the first."""
    return points[:, np.argsort(-np.ptp(points, axis=0))] if len(points) else points


def spreads(points: Floats, centers: Floats, reach: float) -> tuple[Floats, Floats, Floats]:
    """Return how the points within `reach` of each of S centers spread, 0 without any.

    Parameters
    ----------
    points, centers
        (N, 3) and (S, 3), in one unit; the points in the order of their first coordinate.
    reach
        greatest distance of a point from a center.

    Returns
    -------
    count : (S,), number of points near each center.
    mean : (S, 3), their mean offset from it.
    covariance : (S, 3, 3).
    """
    sums = neighborhood_sums(points, np.ascontiguousarray(centers), reach)
    sums[:, 1:] /= np.maximum(sums[:, :1], 1)
    mean = sums[:, 1:4]
    return sums[:, 0], mean, sums[:, 4:].reshape(-1, 3, 3) - mean[:, :, None] * mean[:, None]

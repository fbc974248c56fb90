"""Facts of a cloud: spacing of its points, their neighbors, strands that do not touch; and the first radius of the object."""

from __future__ import annotations

import math

import numpy as np

from ..kernels import CloudFacts, neighborhood_spreads, values_at_ranks
from ..types import Floats, Foreground, Ints
from .frame_facts import facts_of

SAMPLE_POINTS, SAMPLE_SEEDS = 8000, 80
"""Points of a cloud, and seeds among them, on which its density is measured."""

STRAND_SPACINGS = 3.0
"""Point spacings; parts of a cloud that are farther apart are strands of their own when the first radius is measured."""

MIN_STRAND_FRACTION, MIN_LARGE_FRACTION = 0.05, 0.8
"""Fraction of the points that a strand has at least, and that all such strands have together, to be looked at one by one."""


def cloud_facts(points: Floats) -> CloudFacts:
    """Return the facts of a cloud of N points, (N, D) m; in 2-D they lie in the plane z = 0."""
    points = points if points.shape[1] == 3 else np.pad(points, ((0, 0), (0, 1)))
    return CloudFacts(
        np.ascontiguousarray(points), SAMPLE_POINTS, SAMPLE_SEEDS, STRAND_SPACINGS, MIN_STRAND_FRACTION, MIN_LARGE_FRACTION
    )


def sampled(points: Floats) -> Floats:
    """Return every k-th of N points, (N, 3), on which the density of a cloud is measured; between 8,000 and 16,000 of more."""
    return np.ascontiguousarray(points[:: max(1, len(points) // SAMPLE_POINTS)])


def seeds_of(sample: Floats) -> Floats:
    """Return every k-th of the sampled points, (S, 3), around which the density of a cloud is measured."""
    return np.ascontiguousarray(sample[:: max(1, len(sample) // SAMPLE_SEEDS)])


def point_spacing(foreground: Foreground) -> float:
    """Return the typical distance between neighboring surface points in m.

    With a camera it is the side of a pixel at the median depth. For a cloud it follows from the density of the points
    (`CloudFacts.spacing`).

    foreground : the object's points, (N, 3) m, N >= 1.
    """
    if foreground.camera is not None:
        return float(np.median(foreground.points[:, 2])) / foreground.camera.fx
    facts = foreground.cloud_facts or cloud_facts(foreground.points)
    return float(facts.spacing)


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
        return max(facts_of(foreground).radius(foreground.camera.fx) if radius is None else radius, apart)
    number = np.zeros(0, dtype=np.int64) if foreground.cloud_facts is None else foreground.cloud_facts.strands
    return max(_cloud_radius(foreground.points, apart, number), apart)


def _cloud_radius(points: Floats, apart: float, number: Ints) -> float:
    """Return the median half-width in m of a cloud where it looks like a strip.

    Around each of some seeds the neighborhood grows until it is three times as long as it is wide. The variance
    across is then r^2 / 3 for the half shell that one camera sees (uniform over the projected width) and r^2 / 2
    for a whole tube, told apart by the variance in depth. Strands side by side with air between them are looked at one by one,
    since together they are wider than each; `number` is that of the strand of each sampled point, empty if all touch.
    """
    sample = sampled(points)
    extent = float(np.linalg.norm(np.diff(values_at_ranks(np.ascontiguousarray(points), np.array([0, len(points) - 1])), axis=0)))
    radii: list[float] = []
    sample_apart = apart * math.sqrt(len(points) / len(sample))
    strands = [(sample, seeds_of(sample))]
    if len(number):
        own = number[:: max(1, len(sample) // SAMPLE_SEEDS)]
        strands = [(sample[number == k], seeds_of(sample)[own == k]) for k in range(int(number.max()) + 1)]
    for strand, seeds in strands:
        reach = 3 * sample_apart
        while len(seeds) and reach < extent:
            counts, _, covariances = neighborhood_spreads(strand, seeds, reach)
            thin, wide, length = np.linalg.eigvalsh(covariances.reshape(-1, 3, 3)).T
            long = (counts > 8) & (wide < length / 9)
            if long.any():
                thin, wide = thin[long], np.maximum(wide[long], 1e-18)
                radii += np.sqrt(wide * (3 - np.minimum(1.0, thin / wide))).tolist()
                seeds = np.ascontiguousarray(seeds[~long])
            reach *= 1.3
    return float(np.median(radii)) if radii else extent / 6

"""The axis of the object estimated at samples: what all ways of measuring it share."""

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.order_statistics import finite_median
from ..geometry.polyline import steps, whittaker_smooth
from ..geometry.radii import TOUCHING_RADII
from ..kernels import window_sum
from ..types import Bools, Floats
from .cross_sections import MIN_POINTS, CrossSections, SectionAxes, cross_sections, section_axes, thinned
from .samples import Samples

SMOOTHING_RADII = 1.2
"""Radii; details of the axis shorter than about 2 pi times this are smoothed."""

PATH_WEIGHT = 0.01
"""Weight of the filled path where nothing was seen, beside 1 where the surface was seen."""

DEPTH_WEIGHT = 0.06
"""Weight of depth, which a stereo camera measures with errors in waves along a strand, beside 1 for lateral offsets."""

GAP_WEIGHT = 0.3
"""Weight of a measurement at a sample in a filled gap, beside 1 elsewhere: it may be of something in front."""

RADIUS_TOLERANCE = 0.3
"""Relative difference from the path's radius at which a measurement weighs 1 / e."""

RING_OVERLAP = 40
"""Samples by which a ring is continued over its seam before it is smoothed."""

MAX_STRENGTH = 1e8
"""Weight of smoothness at most; it is 81 with samples as far apart as usual. Beyond, rounding makes the equations singular."""


@dataclass(frozen=True)
class Estimate:
    """The axis and the radius at S samples by one measurement.

    target : (S, D), where the axis lies. weight : (S, D, D), of that. radius, radii : (S,), of the paths and at the samples.
    """

    target: Floats
    weight: Floats
    radius: Floats
    radii: Floats


def sections(samples: Samples, points: Floats, sensor: Floats | None) -> tuple[SectionAxes, CrossSections]:
    """Return the axes of the cross-sections at samples, and the points of a cloud in them."""
    curves = samples.curves
    axes = section_axes(curves.points, curves.tangents, sensor)
    return axes, cross_sections(thinned(points), curves.points, axes, TOUCHING_RADII * samples.radius)


def smoothed_samples(samples: Samples, estimate: Estimate) -> Samples:
    """Return samples on the smoothed axes, with the estimated radii."""
    curves = samples.curves
    weight = estimate.weight + PATH_WEIGHT * np.eye(curves.points.shape[1])
    spacing = [finite_median(steps(points)) for points in curves]
    positions = np.empty_like(curves.points)
    for part, closed, step in zip(curves.parts, curves.closed.tolist(), spacing, strict=True):
        strength = (SMOOTHING_RADII * float(estimate.radius[part.start]) / max(step, 1e-9)) ** 4
        count = part.stop - part.start
        overlap = min(RING_OVERLAP, count) if closed else 0
        around = part.start + np.arange(-overlap, count + overlap) % count
        smooth = whittaker_smooth(estimate.target[around], weight[around], min(strength, MAX_STRENGTH))
        positions[part] = smooth[overlap : overlap + count]
    return replace(samples, curves=curves.with_points(positions), radius=estimate.radius, radii=estimate.radii)


def diagonal_weight(axes: SectionAxes, lateral: Floats, depth: Floats) -> Floats:
    """Return the weights (S, D, D) with (S,) along the lateral and (S,) along the depth axis."""
    weight = np.einsum("s,si,sj->sij", lateral, axes.lateral, axes.lateral)
    return np.asarray(weight + np.einsum("s,si,sj->sij", depth, axes.depth, axes.depth))


def trust(ratio: Floats) -> Floats:
    """Return how far to believe measurements whose radius is this multiple of the path's: 0 to 1."""
    return np.asarray(np.exp(-(((ratio - 1) / RADIUS_TOLERANCE) ** 2)))


def count_weight(count: Floats) -> Floats:
    """Return the weight of estimates from so many points: 1 at the median count, 0 below MIN_POINTS."""
    return np.asarray(np.minimum(1.0, count / median_count(count)) * (count >= MIN_POINTS))


def median_count(count: Floats) -> float:
    some = count[count > 0]
    return finite_median(some) if len(some) else 1.0


def with_radius(samples: Samples, measured: Floats, usable: Bools) -> tuple[Samples, Floats]:
    """Return the samples with the radius of their paths as measured (S,), and the radii at the samples (S,).

    The radius of a path is the median of what was measured along it outside of gaps; the radius so far where nothing usable was.
    """
    curves, usable = samples.curves, usable & ~samples.filled
    known = np.where(usable, measured, np.nan)
    median = np.array([finite_median(known[part]) for part in curves.parts])[curves.owner]
    samples = replace(samples, radius=np.where(np.isnan(median), samples.radius, median))
    near = trust(measured / samples.radius) > 0.5
    return samples, _along_paths(measured, usable & near, samples)


def _along_paths(measured: Floats, good: Bools, samples: Samples) -> Floats:
    """Return the radius at each sample: the pooled measurement where it is good, interpolated along the path elsewhere."""
    result = samples.radius.copy()
    window_half = 2 * samples.window_half
    count = window_sum(good.astype(float), samples.curves.owner, window_half)
    mean = window_sum(np.where(good, measured, 0.0), samples.curves.owner, window_half) / np.maximum(count, 1.0)
    for part in samples.curves.parts:
        index = np.flatnonzero(count[part] > 0)
        if len(index):
            result[part] = np.interp(np.arange(part.stop - part.start), index, mean[part][index])
    return result

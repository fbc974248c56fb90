"""The axis and the radius of the object in a cloud: from half shells, from circles, or along the lines of sparse points."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..geometry.noise import MAD_TO_DEVIATION, NOISE_RADII
from ..geometry.order_statistics import finite_median
from ..geometry.radii import TOUCHING_RADII
from ..kernels import nearest
from ..types import Bools, Floats
from .axis import (
    DEPTH_WEIGHT,
    GAP_WEIGHT,
    Estimate,
    count_weight,
    diagonal_weight,
    median_count,
    sections,
    smoothed_samples,
    trust,
    with_radius,
)
from .cross_sections import SectionAxes, are_half_shells, axis_depth, cross_sections, fit_circles, fit_half_shell, thinned
from .samples import Samples

MIN_SCATTER_SHARE = 1e-3
"""Least radius of a path of sparse points in their spacings: a wire of 5 mm seen every 0.5 m has ten times that, and points
exactly on a line would have none."""


def moved(samples: Samples, measure: Callable[..., Estimate], iterations: int, *data: Any) -> Samples:
    """Return samples moved to the axis by a measurement of it and a Whittaker smoother, as often as said.

    measure : function of the samples and `data` to the axis, its weights and the radii. iterations : 0 leaves the samples.
    """
    for _ in range(iterations):
        samples = smoothed_samples(samples, measure(samples, *data))
    return samples


def shows_half_shells(points: Floats, samples: Samples) -> bool:
    """Return whether the points of a cloud look like half shells (as one camera sees of a cylinder) seen from the origin.

    points : (N, 3) m, of the cloud. samples : samples along the paths on the seen surface, m.
    """
    axes, inside = sections(samples, points, None)
    return are_half_shells(inside, samples.curves.owner, samples.curves.points, axes, samples.window_half)


def _depth(samples: Samples, middle: Floats, axes: SectionAxes, points: Floats) -> tuple[Floats, Floats]:
    """Return how deep the axis lies behind positions (S, 3) in the middle of the silhouette, m, and the weight: (S,), (S,)."""
    inside = cross_sections(points, middle, axes, TOUCHING_RADII * samples.radius)
    depth, count = axis_depth(inside, samples.curves.owner, samples.radius, samples.window_half)
    usual = median_count(count)
    weight = np.minimum(1.0, count / usual) * np.where(count > 0.1 * usual, 1.0, 0.0)
    weight *= np.where(samples.filled, GAP_WEIGHT, 1.0) * DEPTH_WEIGHT
    depth = np.where(weight > 0, depth, 0.0)
    noise = depth_noise(middle + depth[:, None] * axes.depth, axes.depth, (weight > 0) & ~samples.filled, samples)
    return depth, weight * min(1.0, NOISE_RADII / max(noise, 1e-9)) ** 2


def depth_noise(positions: Floats, depth_axis: Floats, measured: Bools, samples: Samples) -> float:
    """Return the depth noise of a measured axis: its robust standard deviation, as a multiple of the object's radius.

    Parameters
    ----------
    positions
        (S, 3) m, measured positions of S samples on the axis.
    depth_axis
        (S, 3) unit, pointing away from the sensor at each position.
    measured
        (S,) bool, False for a position to leave out.
    samples
        the samples at which the positions were measured.

    Returns
    -------
    The noise in radii, 0 if there are too few samples. It is measured by second differences of positions so far apart that their
    pooled measurements share no points; the median over them ignores the bends.
    """
    step = 2 * samples.window_half + 1
    first, middle, last = slice(None, -2 * step), slice(step, -step), slice(2 * step, None)
    second_difference = positions[last] - 2 * positions[middle] + positions[first]
    change = np.abs(np.einsum("ij,ij->i", second_difference, depth_axis[middle]))
    usable = measured[first] & measured[middle] & measured[last] & (samples.curves.owner[first] == samples.curves.owner[last])
    relative = (change / samples.radius[middle])[usable]
    return MAD_TO_DEVIATION * finite_median(relative) / math.sqrt(6) if len(relative) else 0.0


def from_half_shells(samples: Samples, points: Floats, sensor: Floats | None) -> Estimate:
    """Estimate all from the points of a cloud of one view: offset and radius from their lateral spread."""
    axes, inside = sections(samples, points, sensor)
    middle, measured, count = fit_half_shell(inside, samples.curves.owner, samples.window_half)
    samples, radii = with_radius(samples, measured, _is_plausible(measured, samples))
    weight = count_weight(count) * np.where(samples.filled, GAP_WEIGHT, 1.0)
    lateral_weight = weight * trust(np.where(np.isfinite(measured), measured, 0.0) / samples.radius)
    between_sides = samples.curves.points + np.where(lateral_weight > 0.1, middle, 0.0)[:, None] * axes.lateral
    depth, depth_weight = _depth(samples, between_sides, axes, thinned(points))
    target = between_sides + depth[:, None] * axes.depth
    return Estimate(target, diagonal_weight(axes, lateral_weight, depth_weight), samples.radius, radii)


def from_circles(samples: Samples, points: Floats, sensor: Floats | None) -> Estimate:
    """Estimate all from the circle through each cross-section, for clouds of many views."""
    axes, inside = sections(samples, points, sensor)
    _, measured, _ = fit_circles(inside, samples.curves.owner, None, samples.window_half)
    samples, radii = with_radius(samples, measured, _is_plausible(measured, samples))
    center, _, count = fit_circles(inside, samples.curves.owner, samples.radius, samples.window_half)
    weight = count_weight(count) * np.where(samples.filled, GAP_WEIGHT, 1.0)
    weight *= np.linalg.norm(center, axis=1) < TOUCHING_RADII * samples.radius
    offset = center[:, :1] * axes.lateral + center[:, 1:] * axes.depth
    target = samples.curves.points + np.where(weight[:, None] > 0, offset, 0.0)
    return Estimate(target, diagonal_weight(axes, weight, weight), samples.radius, radii)


def from_lines(samples: Samples, points: Floats, spacing: float) -> Estimate:
    """Keep the axis, along which sparse points were moved, and take the radius of each path from how far its points lie off."""
    reach = TOUCHING_RADII * float(samples.radius.max())
    distance, near = nearest(thinned(points), samples.curves.points, reach)
    there = np.isfinite(distance)
    least = MIN_SCATTER_SHARE * spacing
    radius = samples.radius.copy()
    for part in samples.curves.parts:
        own = distance[there & (near >= part.start) & (near < part.stop)]
        if len(own):
            radius[part] = max(float(np.sqrt(np.mean(own**2))), least)
    weight = np.broadcast_to(np.eye(3), (len(radius), 3, 3))
    return Estimate(samples.curves.points, weight, radius, radius)


def _is_plausible(measured: Floats, samples: Samples) -> Bools:
    """Return which measured radii (S,), NaN or m, agree with the width seen; points of one line of a scanner do not."""
    return np.asarray((measured < 3 * samples.radius) & (measured > samples.radius / 3))

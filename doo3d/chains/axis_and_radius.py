"""The axis and the radius of the object estimated at samples: from the mask, from points of one view or from circles."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from .. import kernels
from ..geometry.noise import DEVIATIONS, MAD_TO_DEVIATION, NOISE_RADII
from ..geometry.order_statistics import finite_median
from ..geometry.polyline import LEAST_WEIGHT, steps, whittaker_smooth
from ..geometry.radii import OWN_RADII, TOUCHING_RADII
from ..kernels import nearest, window_sum
from ..scene.frame_facts import facts_of
from ..scene.support import BESIDE_PX
from ..types import Bools, Floats, Foreground
from .cross_sections import (
    CENTRAL_PART,
    MIN_POINTS,
    CrossSections,
    SectionAxes,
    are_half_shells,
    axis_depth,
    cross_sections,
    fit_circles,
    fit_half_shell,
    section_axes,
    thinned,
)
from .multiview import mask_sample, measure_in_view, median_radius
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

MAX_SUNK_RADII = 3.0
"""Radii by which an axis may be measured too low over the plane beside it, and still lie on it: a stereo camera sees a cable on a
table at 0.65 to 0.85 of its height, a thin wire not at all. What is lower is beyond the table."""

MIN_SCATTER_SHARE = 1e-3
"""Least radius of a path of sparse points in their spacings: a wire of 5 mm seen every 0.5 m has ten times that, and points
exactly on a line would have none."""

RING_OVERLAP = 40
"""Samples by which a ring is continued over its seam before it is smoothed."""

MAX_STRENGTH = 1e8
"""Weight of smoothness at most; it is 81 with samples as far apart as usual. Beyond, rounding makes the equations singular."""


@dataclass(frozen=True)
class _Estimate:
    """The axis and the radius at S samples by one measurement.

    target : (S, D), where the axis lies. weight : (S, D, D), of that. radius, radii : (S,), of the paths and at the samples.
    """

    target: Floats
    weight: Floats
    radius: Floats
    radii: Floats


def shows_half_shells(foreground: Foreground, samples: Samples) -> bool:
    """Tell whether the points of a cloud look like half shells (as one camera sees of a cylinder) seen from the origin.

    foreground : the cloud, without a viewpoint. samples : samples along the paths on the seen surface, m.
    """
    axes, sections = _sections(samples, foreground)
    return are_half_shells(sections, samples.curves.owner, samples.curves.points, axes, samples.window_half)


def estimate_axis_and_radius(samples: Samples, foreground: Foreground, iterations: int = 1) -> Samples:
    """Move samples from the seen surface to the axis of the object, and estimate the radius at each.

    The axis is measured in the mask (and depth) if there is one, else in the masks of the camera views, else in the points: as
    half shells if the viewpoint is known, else by fitting circles. Each path is then smoothed by a Whittaker smoother, weighted
    by how well the axis is known in each direction.

    Parameters
    ----------
    samples
        samples along all paths, m (px in 2-D).
    foreground
        the object's points, with mask, camera views or viewpoint if there are any.
    iterations
        how many times this is done; 0 leaves the samples as they are.

    Returns
    -------
    As many samples as given, in the same order, with new positions and radii, m (px in 2-D).
    """
    if foreground.mask is not None:
        return _in_mask(samples, foreground, foreground.mask, iterations)
    if foreground.sampling is not None and foreground.sampling.is_sparse:
        measure = _from_lines
    elif foreground.views:
        measure = _from_views
    else:
        measure = _from_circles if foreground.viewpoint is None else _from_half_shell
    for _ in range(iterations):
        samples = _smoothed_samples(samples, measure(samples, foreground))
    return samples


def _sections(samples: Samples, foreground: Foreground) -> tuple[SectionAxes, CrossSections]:
    """Return the axes of the cross-sections at samples, and the points of a cloud in them."""
    curves = samples.curves
    axes = section_axes(curves.points, curves.tangents, foreground.viewpoint)
    return axes, cross_sections(thinned(foreground.points), curves.points, axes, TOUCHING_RADII * samples.radius)


def _smoothed_samples(samples: Samples, estimate: _Estimate) -> Samples:
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


def _diagonal_weight(axes: SectionAxes, lateral: Floats, depth: Floats) -> Floats:
    """Return the weights (S, D, D) with (S,) along the lateral and (S,) along the depth axis."""
    weight = np.einsum("s,si,sj->sij", lateral, axes.lateral, axes.lateral)
    return np.asarray(weight + np.einsum("s,si,sj->sij", depth, axes.depth, axes.depth))


def _in_mask(samples: Samples, foreground: Foreground, mask: Bools, iterations: int) -> Samples:
    """Estimate the lateral offset and the radius from the mask, the depth from the surface points, and raise axes onto the plane.

    Axes measured lower than a radius over the plane are raised where the camera sees the plane beside the strand: not beyond the
    edge of a table, nor beside other things.
    """
    curves, camera, plane = samples.curves, foreground.camera, foreground.plane
    depth = np.zeros((0, 0)) if foreground.depth is None else foreground.depth
    positions, radius, radii = kernels.axes_in_mask(
        curves.points,
        curves.bounds,
        curves.closed,
        samples.filled,
        samples.radius,
        samples.window_half,
        *mask_sample(facts_of(foreground)),
        foreground.points[:0] if camera is None else thinned(foreground.points),
        np.zeros(0) if camera is None else camera.intrinsics,
        np.ascontiguousarray(depth, dtype=np.float32),
        np.ascontiguousarray(mask) if depth.size else np.zeros((0, 0), dtype=bool),
        np.zeros(0) if plane is None or not depth.size else np.append(plane.normal, plane.height),
        BESIDE_PX,
        iterations,
        touching_radii=TOUCHING_RADII,
        own_radii=OWN_RADII,
        sunk_radii=MAX_SUNK_RADII,
        central_part=CENTRAL_PART,
        smoothing_radii=SMOOTHING_RADII,
        max_strength=MAX_STRENGTH,
        ring_overlap=RING_OVERLAP,
        path_weight=PATH_WEIGHT,
        depth_weight=DEPTH_WEIGHT,
        gap_weight=GAP_WEIGHT,
        least_weight=LEAST_WEIGHT,
        radius_tolerance=RADIUS_TOLERANCE,
        noise_radii=NOISE_RADII,
        deviations=DEVIATIONS,
    )
    return replace(samples, curves=curves.with_points(positions), radius=radius, radii=radii)


def _depth(samples: Samples, middle: Floats, axes: SectionAxes, points: Floats) -> tuple[Floats, Floats]:
    """Return how deep the axis lies behind positions (S, 3) in the middle of the silhouette, m, and the weight: (S,), (S,)."""
    sections = cross_sections(points, middle, axes, TOUCHING_RADII * samples.radius)
    depth, count = axis_depth(sections, samples.curves.owner, samples.radius, samples.window_half)
    usual = _median_count(count)
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


def _from_half_shell(samples: Samples, foreground: Foreground) -> _Estimate:
    """Estimate all from the points of a cloud of one view: offset and radius from their lateral spread."""
    axes, sections = _sections(samples, foreground)
    middle, measured, count = fit_half_shell(sections, samples.curves.owner, samples.window_half)
    samples, radii = _with_radius(samples, measured, _is_plausible(measured, samples))
    weight = _count_weight(count) * np.where(samples.filled, GAP_WEIGHT, 1.0)
    lateral_weight = weight * _trust(np.where(np.isfinite(measured), measured, 0.0) / samples.radius)
    moved = samples.curves.points + np.where(lateral_weight > 0.1, middle, 0.0)[:, None] * axes.lateral
    depth, depth_weight = _depth(samples, moved, axes, thinned(foreground.points))
    target = moved + depth[:, None] * axes.depth
    return _Estimate(target, _diagonal_weight(axes, lateral_weight, depth_weight), samples.radius, radii)


def _from_circles(samples: Samples, foreground: Foreground) -> _Estimate:
    """Estimate all from the circle through each cross-section, for clouds of many views."""
    axes, sections = _sections(samples, foreground)
    _, measured, _ = fit_circles(sections, samples.curves.owner, None, samples.window_half)
    samples, radii = _with_radius(samples, measured, _is_plausible(measured, samples))
    center, _, count = fit_circles(sections, samples.curves.owner, samples.radius, samples.window_half)
    weight = _count_weight(count) * np.where(samples.filled, GAP_WEIGHT, 1.0)
    weight *= np.linalg.norm(center, axis=1) < TOUCHING_RADII * samples.radius
    offset = center[:, :1] * axes.lateral + center[:, 1:] * axes.depth
    target = samples.curves.points + np.where(weight[:, None] > 0, offset, 0.0)
    return _Estimate(target, _diagonal_weight(axes, weight, weight), samples.radius, radii)


def _from_lines(samples: Samples, foreground: Foreground) -> _Estimate:
    """Keep the axis, along which sparse points were moved, and take the radius of each path from how far its points lie off."""
    reach = TOUCHING_RADII * float(samples.radius.max())
    distance, near = nearest(thinned(foreground.points), samples.curves.points, reach)
    there = np.isfinite(distance)
    least = 0.0 if foreground.sampling is None else MIN_SCATTER_SHARE * foreground.sampling.spacing
    radius = samples.radius.copy()
    for part in samples.curves.parts:
        own = distance[there & (near >= part.start) & (near < part.stop)]
        if len(own):
            radius[part] = max(float(np.sqrt(np.mean(own**2))), least)
    weight = np.broadcast_to(np.eye(3), (len(radius), 3, 3))
    return _Estimate(samples.curves.points, weight, radius, radius)


def _from_views(samples: Samples, foreground: Foreground) -> _Estimate:
    """Estimate the axis from the masks of all views, whose rays together tell depth too, and from circles as far as believed."""
    measurements = [measured for view in foreground.views if (measured := measure_in_view(samples, view)) is not None]
    measured_radii = median_radius(measurements, len(samples.curves.points))
    samples, radii = _with_radius(samples, measured_radii, np.isfinite(measured_radii))
    axes, sections = _sections(samples, foreground)
    center, _, count = fit_circles(sections, samples.curves.owner, samples.radius, samples.window_half)
    believed = DEPTH_WEIGHT * _count_weight(count)
    believed *= np.linalg.norm(center, axis=1) < TOUCHING_RADII * samples.radius
    weight = _diagonal_weight(axes, believed, believed)
    pull = believed[:, None] * (center[:, :1] * axes.lateral + center[:, 1:] * axes.depth)
    for measured in measurements:
        trust = _trust(measured.radius / samples.radius[measured.sample]) * (measured.radius > 0)
        weight[measured.sample] += np.einsum("s,si,sj->sij", trust, measured.lateral, measured.lateral)
        pull[measured.sample] += (trust * measured.offset)[:, None] * measured.lateral
    gap_weight = np.where(samples.filled, GAP_WEIGHT, 1.0)[:, None]
    moved = np.linalg.solve(weight + 1e-9 * np.eye(3), pull[..., None])[..., 0]
    return _Estimate(samples.curves.points + moved, gap_weight[..., None] * weight, samples.radius, radii)


def _is_plausible(measured: Floats, samples: Samples) -> Bools:
    """Tell which radii (S,), NaN or m, are of the object seen across its width, which points of one line of a scanner are not."""
    return np.asarray((measured < 3 * samples.radius) & (measured > samples.radius / 3))


def _trust(ratio: Floats) -> Floats:
    """Return how far to believe measurements whose radius is this multiple of the path's: 0 to 1."""
    return np.asarray(np.exp(-(((ratio - 1) / RADIUS_TOLERANCE) ** 2)))


def _count_weight(count: Floats) -> Floats:
    """Return the weight of estimates from so many points: 1 at the median count, 0 below MIN_POINTS."""
    return np.asarray(np.minimum(1.0, count / _median_count(count)) * (count >= MIN_POINTS))


def _median_count(count: Floats) -> float:
    some = count[count > 0]
    return finite_median(some) if len(some) else 1.0


def _with_radius(samples: Samples, measured: Floats, usable: Bools) -> tuple[Samples, Floats]:
    """Return the samples with the radius of their paths as measured (S,), and the radii at the samples (S,).

    The radius of a path is the median of what was measured along it outside of gaps; the radius so far where nothing usable was.
    """
    curves, usable = samples.curves, usable & ~samples.filled
    known = np.where(usable, measured, np.nan)
    median = np.array([finite_median(known[part]) for part in curves.parts])[curves.owner]
    samples = replace(samples, radius=np.where(np.isnan(median), samples.radius, median))
    near = _trust(measured / samples.radius) > 0.5
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

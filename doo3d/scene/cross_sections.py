"""The cross-sections of a cylinder at samples along its axis: its surface points there, and the circle they lie on.

All functions work on S samples along all paths of a frame; `path` (S,) int is the index of the path of each, and estimates are
pooled over `window_half` samples of the same path on either side. A camera sees half a shell: its points lie in front of the
axis, pi / 4 of a radius in the mean. In the plane perpendicular to the axis a point with the lateral offset u from the axis lies
sqrt(r^2 - u^2) in front of the axis, where r is the radius.
"""

from dataclasses import dataclass

import numpy as np

from .. import kernels
from ..geometry.noise import DEVIATIONS, MAD_TO_DEVIATION, SURFACE_SAMPLES
from ..geometry.polyline import unit
from ..kernels import half_shell_spread, nearest, section_offsets, window_sum
from ..types import Array, Floats, Ints

MIN_POINTS = 5
"""Points that a circle is fitted to at least."""

DEPTH_IMAGE_KURTOSIS = 1.8
"""Kurtosis of the lateral offsets of a half shell in a depth image, whose points are spread evenly across; 1.5 for points spread
evenly over the surface."""

CENTRAL_PART = 0.8
"""Radii from the middle within which surface points measure the depth of the axis; farther out the surface falls away."""

GAUSS_NEWTON_STEPS = 8


@dataclass(frozen=True)
class SectionAxes:
    """Three perpendicular unit axes at each of S samples along an object: the frame of its cross-sections.

    An image has no depth axis, so in 2-D `depth` holds zero vectors.

    Attributes
    ----------
    tangent
        (S, D), D = 2 or 3, along the object.
    lateral
        (S, D), across the object, perpendicular to the line of sight.
    depth
        (S, D), across the object, pointing away from the sensor; arbitrary if the position of the sensor is unknown.
    """

    tangent: Floats
    lateral: Floats
    depth: Floats


def section_axes(positions: Floats, tangent: Floats, viewpoint: Floats | None) -> SectionAxes:
    """Return the axes of the cross-sections at S samples: along the object, across the line of sight, away from the sensor.

    The axes are right-handed: depth = tangent x lateral. Where the object points at the sensor, lateral and depth are arbitrary.

    Parameters
    ----------
    positions
        (S, 3) m, the samples; at least one.
    tangent
        (S, 3) unit, along the object at each sample.
    viewpoint
        (3,) m, position of the sensor in the frame of the samples. None if unknown: lateral and depth are then arbitrary, but
        turn little from one sample to the next.
    """
    seen_from = np.zeros(0) if viewpoint is None else viewpoint
    return SectionAxes(tangent, *kernels.section_axes(np.ascontiguousarray(positions), np.ascontiguousarray(tangent), seen_from))


def thinned(points: Array) -> Array:
    """Return every k-th of N points, k being the least that leaves at most SURFACE_SAMPLES (20,000) of them.

    Parameters
    ----------
    points
        (N, C), N points of C numbers each.

    Returns
    -------
    (K, C), the K points kept, in the order given; a contiguous array.
    """
    return np.ascontiguousarray(points[:: max(1, -(-len(points) // SURFACE_SAMPLES))])


@dataclass(frozen=True)
class CrossSections:
    """K surface points of the object, each in the cross-section of the nearest sample.

    Attributes
    ----------
    sample
        (K,) int, index of the sample that each point is nearest to.
    lateral
        (K,) m, offset of the point from that sample along the lateral axis (across the line of sight).
    depth
        (K,) m, offset of the point from that sample along the depth axis, positive away from the sensor.
    """

    sample: Ints
    lateral: Floats
    depth: Floats


def cross_sections(points: Floats, positions: Floats, axes: SectionAxes, reach: Floats) -> CrossSections:
    """Assign each surface point to the cross-section of the nearest sample.

    Parameters
    ----------
    points
        (N, 3) m, N surface points.
    positions
        (S, 3) m, S samples along the object.
    axes
        the axes of the cross-section at each sample.
    reach
        (S,) m, one per sample; a point farther than this from its nearest sample is left out.

    Returns
    -------
    The points that are near enough, in the order given, as sample index and offsets.
    """
    distance, near = nearest(points, positions, float(reach.max()))
    return CrossSections(*section_offsets(points, distance, near, positions, axes.lateral, axes.depth, reach))


def axis_depth(sections: CrossSections, path: Ints, radius: Floats, window_half: int) -> tuple[Floats, Floats]:
    """Estimate how far behind each sample the axis of the object lies.

    The samples must lie in the middle of the silhouette. The estimate is the mean of w + sqrt(r^2 - u^2) over the surface points
    with |u| < 0.8 r, where u and w are a point's lateral and depth offset from the sample and r is the radius. Points that
    differ by more than three standard deviations from the mean are left out.

    Parameters
    ----------
    sections
        surface points in the cross-sections of the samples.
    path
        (S,) int, index of the path of each of S samples.
    radius
        (S,) m, radius of the object at each sample.
    window_half
        number of samples on either side, on the same path, whose points are pooled with those of a sample.

    Returns
    -------
    depth : (S,) m from the sample to the axis, positive away from the sensor; 0 where there are no points.
    count : (S,) number of points in each mean, after pooling.
    """
    return kernels.axis_depth(
        sections.sample, sections.lateral, sections.depth, path, radius, window_half, CENTRAL_PART, DEVIATIONS * MAD_TO_DEVIATION
    )


def fit_half_shell(sections: CrossSections, path: Ints, window_half: int) -> tuple[Floats, Floats, Floats]:
    """Estimate middle and radius of the object at each sample from the lateral spread of the points that one camera sees.

    The camera sees the half of a cylinder (a half shell). The variance of the points' lateral offsets is r^2 / 3 for points
    spread evenly over the width, as in a depth image, and r^2 / 2 for points spread evenly over the surface, as after a voxel
    filter, where r is the radius. The kurtosis of the offsets (1.8 or 1.5) tells where between these two cases the points lie.

    Parameters
    ----------
    sections
        surface points in the cross-sections of the samples.
    path
        (S,) int, index of the path of each of S samples.
    window_half
        number of samples on either side, on the same path, whose points are pooled with those of a sample.

    Returns
    -------
    middle : (S,) m, lateral offset of the object's middle from the sample; 0 where there are no points.
    radii : (S,) m, radius at each sample; NaN where `count` is below MIN_POINTS (5).
    count : (S,) number of points at each sample, after pooling.
    """

    middle, variance, count, fourth = half_shell_spread(sections.sample, sections.lateral, path, window_half)
    kurtosis = float(np.mean(fourth)) if len(fourth) else DEPTH_IMAGE_KURTOSIS
    factor = float(np.clip(3 - (DEPTH_IMAGE_KURTOSIS - kurtosis) / 0.3, 2.0, 3.0))
    return middle, np.where(count >= MIN_POINTS, np.sqrt(factor * variance), np.nan), count


def are_half_shells(sections: CrossSections, path: Ints, positions: Floats, axes: SectionAxes, window_half: int) -> bool:
    """Return whether surface points look like half shells seen from the origin.

    A half shell is the half of a cylinder's surface that one camera sees. A circle is fitted to each cross-section. For a
    half shell the circle's center lies behind the mean of the points, as seen from there; for the points of a whole tube
    center and mean coincide. The result is True if the center lies more than 0.4 radii behind the mean, in the median over the
    samples; False if no sample has enough points.

    Parameters
    ----------
    sections
        surface points in the cross-sections of the samples.
    path
        (S,) int, index of the path of each of S samples.
    positions
        (S, 3) m, the samples.
    axes
        the axes of the cross-section at each sample.
    window_half
        number of samples on either side, on the same path, whose points are pooled with those of a sample.
    """
    center, radii, count = fit_circles(sections, path, None, window_half)
    mean = np.zeros_like(center)
    for column, values in enumerate((sections.lateral, sections.depth)):
        sums = np.bincount(sections.sample, values, len(path)).astype(float)  # of no values: int
        mean[:, column] = window_sum(sums, path, window_half) / np.maximum(count, 1e-9)
    good = (count >= MIN_POINTS) & np.isfinite(radii)
    behind = (center - mean)[good] / np.maximum(radii[good], 1e-9)[:, None]
    depth = behind[:, :1] * axes.lateral[good] + behind[:, 1:] * axes.depth[good]
    ray = unit(positions[good])
    return bool(good.any()) and float(np.median(np.einsum("ij,ij->i", depth, ray))) > 0.4


def fit_circles(sections: CrossSections, path: Ints, radius: Floats | None, window_half: int) -> tuple[Floats, Floats, Floats]:
    """Fit a circle to the points of each cross-section by least squares (Gauss-Newton, started from the fit of Kasa, 1976).

    Parameters
    ----------
    sections
        surface points in the cross-sections of the samples.
    path
        (S,) int, index of the path of each of S samples.
    radius
        (S,) m, fixes the radius of the circles, so that only their centers are fitted; None fits the radius too.
    window_half
        number of samples on either side, on the same path, whose points are pooled with those of a sample.

    Returns
    -------
    center : (S, 2) m, lateral and depth offset of the circle's center from the sample; finite but meaningless where `radii` is
        NaN.
    radii : (S,) m, radius of each circle; NaN where `count` is below MIN_POINTS (5), even if the radius was given.
    count : (S,) number of points at each sample, after pooling.
    """
    known = np.zeros(0) if radius is None else radius
    points = sections.sample, sections.lateral, sections.depth
    return kernels.fit_circles(*points, path, known, window_half, GAUSS_NEWTON_STEPS, MIN_POINTS)

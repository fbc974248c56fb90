"""The axis of the object in the masks of camera views: lateral offset and width in each."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.constants import golden

from .. import kernels
from ..geometry.noise import SURFACE_SAMPLES
from ..geometry.polyline import unit
from ..geometry.radii import TOUCHING_RADII
from ..types import Camera, CameraView, Floats, Ints
from .axis import DEPTH_WEIGHT, GAP_WEIGHT, Estimate, count_weight, diagonal_weight, sections, trust, with_radius
from .cross_sections import SectionAxes, fit_circles, section_axes
from .frame_facts import FrameFacts
from .samples import Samples


def mask_sample(facts: FrameFacts) -> tuple[Floats, float]:
    """Return about SURFACE_SAMPLES (20,000) pixels of a mask, evenly distributed, and how many pixels each stands for.

    Areas keep their share of the pixels: in each row every k-th pixel is kept, shifted from row to row by about the golden
    section of k, so that the pixels kept lie on a lattice that is nearly as fine in every direction.

    Returns (K, 2) px, (u, v), sorted by u and then v; all pixels of a mask that has not more.
    """
    step = max(1, math.ceil(facts.count / SURFACE_SAMPLES))
    coprime = (k for k in range(1, step) if math.gcd(k, step) == 1)
    slope = min(coprime, key=lambda k: abs(k - step / golden), default=0)
    pixels = facts.pixels
    kept = pixels[(pixels[:, 0] + slope * pixels[:, 1]) % step == 0]
    return kept.astype(float), facts.count / max(1, len(kept))


def measure_silhouette(
    positions: Floats, axes: SectionAxes, path: Ints, facts: FrameFacts, camera: Camera, reach: Floats, window_half: int
) -> tuple[Floats, Floats]:
    """Measure the middle and half the width of the object's mask at samples, across the object.

    Every pixel of the mask is assigned to the nearest sample in the image. The number of pixels of a sample, divided by the
    length of path in the image around the sample, is the width; the mean of their lateral offsets is the middle.

    Parameters
    ----------
    positions
        (S, 3) m in the camera's optical frame: the positions of S samples.
    axes
        the axes of the cross-section at each sample.
    path
        (S,) int, index of the path that each sample lies on; the samples of one path are consecutive.
    facts
        the mask.
    camera
        the intrinsics.
    reach
        (S,) m, one per sample; pixels farther than this from their sample are left out.
    window_half
        number of samples on either side, on the same path, whose pixels are pooled with those of a sample.

    Returns
    -------
    (S,) m, from each sample to the middle of the mask, positive along the lateral axis, and (S,) m, half the width; both 0 if no
    mask is near the sample.
    """
    sample = mask_sample(facts)
    return kernels.silhouette(positions, axes.tangent, axes.lateral, path, *sample, camera.intrinsics, reach, window_half)


@dataclass(frozen=True)
class ViewMeasurement:
    """Position and width of the object in the mask of one camera view, at the K samples that lie in that view.

    Attributes
    ----------
    sample
        (K,) int, index of each of the K samples in `Samples`, ascending.
    lateral
        (K, 3) unit, in the frame of the cloud: perpendicular to the object and to the camera's line of sight.
    offset
        (K,) m, from the sample to the middle of the mask, positive along `lateral`; 0 if no mask is near the sample.
    radius
        (K,) m, half the width of the mask; 0 if no mask is near the sample.
    """

    sample: Ints
    lateral: Floats
    offset: Floats
    radius: Floats


def measure_in_view(samples: Samples, view: CameraView) -> ViewMeasurement | None:
    """Measure the position and the width of the object's mask in one camera view, at samples along the object.

    Pixels of the mask farther than TOUCHING_RADII (2.2) radii from every sample are left out.

    samples : along the objects, m in the frame of the cloud. view : the camera, its pose (camera-to-cloud) and the mask.

    Returns the measurement; None if fewer than two samples lie in the view, or its mask is empty.
    """
    turn, position, camera = view.pose[:3, :3], view.pose[:3, 3], view.camera
    local = (samples.curves.points - position) @ turn
    pixels = camera.project(local)
    index = np.flatnonzero(((pixels >= 0) & (pixels <= (camera.width - 1, camera.height - 1))).all(axis=1))
    if len(index) < 2 or not view.mask.any():
        return None
    # stretches in view are paths of their own
    path = np.cumsum(np.concatenate(([0], (np.diff(index) > 1) | (np.diff(samples.curves.owner[index]) != 0))))
    local, along = local[index], unit(samples.curves.tangents[index] @ turn)
    axes = section_axes(local, along, np.zeros(3))
    limit = TOUCHING_RADII * samples.radius[index]
    facts = FrameFacts(np.ascontiguousarray(view.mask))
    seen = measure_silhouette(local, axes, path, facts, camera, limit, samples.window_half)
    return ViewMeasurement(index, axes.lateral @ turn.T, *seen)


def median_radius(measurements: Sequence[ViewMeasurement], count: int) -> Floats:
    """Return the median over all views of the object's radius at each sample.

    Parameters
    ----------
    measurements
        one per view; a radius of 0 (no mask near the sample) is left out.
    count
        number of all samples.

    Returns
    -------
    (count,) m; NaN at samples where no view shows the object.
    """
    table = np.full((len(measurements) + 1, count), np.nan)
    for row, measured in zip(table, measurements, strict=False):
        row[measured.sample] = np.where(measured.radius > 0, measured.radius, np.nan)
    some = np.isfinite(table).any(axis=0)
    result = np.full(count, np.nan)
    result[some] = np.nanmedian(table[:, some], axis=0)
    return result


def axis_in_views(samples: Samples, points: Floats, sensor: Floats | None, views: Sequence[CameraView]) -> Estimate:
    """Estimate the axis from the masks of all views, whose rays together tell depth too, and from circles as far as believed."""
    measurements = [measured for view in views if (measured := measure_in_view(samples, view)) is not None]
    measured_radii = median_radius(measurements, len(samples.curves.points))
    samples, radii = with_radius(samples, measured_radii, np.isfinite(measured_radii))
    axes, inside = sections(samples, points, sensor)
    center, _, count = fit_circles(inside, samples.curves.owner, samples.radius, samples.window_half)
    believed = DEPTH_WEIGHT * count_weight(count)
    believed *= np.linalg.norm(center, axis=1) < TOUCHING_RADII * samples.radius
    weight = diagonal_weight(axes, believed, believed)
    pull = believed[:, None] * (center[:, :1] * axes.lateral + center[:, 1:] * axes.depth)
    for measured in measurements:
        trusted = trust(measured.radius / samples.radius[measured.sample]) * (measured.radius > 0)
        weight[measured.sample] += np.einsum("s,si,sj->sij", trusted, measured.lateral, measured.lateral)
        pull[measured.sample] += (trusted * measured.offset)[:, None] * measured.lateral
    gap_weight = np.where(samples.filled, GAP_WEIGHT, 1.0)[:, None]
    moved = np.linalg.solve(weight + 1e-9 * np.eye(3), pull[..., None])[..., 0]
    return Estimate(samples.curves.points + moved, gap_weight[..., None] * weight, samples.radius, radii)

"""Samples measured in the view of each of many cameras: lateral offset and width of that view's mask."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...facts.frame_facts import FrameFacts
from ...geometry.polyline import unit
from ...types import CameraView, Floats, Ints
from .cross_sections import section_axes
from .samples import Samples
from .silhouette import MaskSample, measure_silhouette


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


def measure_in_view(samples: Samples, tangent: Floats, view: CameraView, reach: float) -> ViewMeasurement | None:
    """Measure the position and the width of the object's mask in one camera view, at samples along the object.

    Parameters
    ----------
    samples
        S samples along the objects, m in the frame of the cloud.
    tangent
        (S, 3) unit, along the object at each sample, in the frame of the cloud.
    view
        the camera, its pose (camera-to-cloud) and the mask.
    reach
        multiple of the object's radius; mask pixels farther than this from every sample are left out.

    Returns
    -------
    The measurement; None if fewer than two samples lie in the view, or its mask is empty.
    """
    turn, position, camera = view.pose[:3, :3], view.pose[:3, 3], view.camera
    local = (samples.curves.points - position) @ turn
    pixels = camera.project(local)
    inside = np.asarray(np.isfinite(pixels).all(axis=1))
    inside[inside] = ((pixels[inside] >= 0) & (pixels[inside] <= (camera.width - 1, camera.height - 1))).all(axis=1)
    index = np.flatnonzero(inside)
    if len(index) < 2 or not view.mask.any():
        return None
    # stretches in view are paths of their own
    path = np.cumsum(np.concatenate(([0], (np.diff(index) > 1) | (np.diff(samples.curves.owner[index]) != 0))))
    local, along = local[index], unit(tangent[index] @ turn)
    axes = section_axes(local, along, np.zeros(3))
    limit = reach * samples.radius[index]
    seen = measure_silhouette(
        local, axes, path, MaskSample.of(FrameFacts(np.ascontiguousarray(view.mask))), camera, limit, samples.window_half
    )
    return ViewMeasurement(index, axes.lateral @ turn.T, seen.offset, seen.radius)


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

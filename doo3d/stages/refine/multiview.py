"""Samples measured in the view of each of many cameras: lateral offset and width of that view's mask."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.mask import mask_pixels
from ...geometry.polyline import unit
from ...types import CameraView, Floats, Ints
from .cross_sections import section_axes
from .samples import Samples
from .silhouette import measure_silhouette


@dataclass(frozen=True)
class ViewMeasurement:
    """The mask of one view at the K samples that lie in the view.

    Attributes
    ----------
    sample
        (K,) int, indices of the samples.
    lateral
        (K, 3) unit, square to the path and to the ray of that camera.
    offset
        (K,) m, how far along `lateral` the middle of the mask lies.
    radius
        (K,) m, half the width of the mask; 0 where the mask is not.
    """

    sample: Ints
    lateral: Floats
    offset: Floats
    radius: Floats


def measure_in_view(samples: Samples, tangent: Floats, view: CameraView, reach: float) -> ViewMeasurement | None:
    """Measure the samples in one view; None if fewer than two of them lie in it.

    Parameters
    ----------
    samples
        S samples, in the frame of the cloud.
    tangent
        (S, 3) unit, of the paths there.
    view
        camera, pose and mask.
    reach
        radii; pixels farther from a sample do not belong to it.
    """
    turn, position, camera = view.pose[:3, :3], view.pose[:3, 3], view.camera
    local = (samples.positions - position) @ turn
    pixels = camera.project(local)
    inside = np.asarray(np.isfinite(pixels).all(axis=1))
    inside[inside] = ((pixels[inside] >= 0) & (pixels[inside] <= (camera.width - 1, camera.height - 1))).all(axis=1)
    index = np.flatnonzero(inside)
    if len(index) < 2 or not view.mask.any():
        return None
    # stretches in view are paths of their own
    path = np.cumsum(np.concatenate(([0], (np.diff(index) > 1) | (np.diff(samples.path[index]) != 0))))
    local, along = local[index], unit(tangent[index] @ turn)
    axes = section_axes(local, along, np.zeros(3))
    limit = reach * samples.radius[index]
    seen = measure_silhouette(local, axes, path, mask_pixels(view.mask), camera, limit, samples.window_half)
    return ViewMeasurement(index, axes.lateral @ turn.T, seen.offset, seen.radius)


def median_radius(measurements: Sequence[ViewMeasurement], count: int) -> Floats:
    """Return the median over all views of the radius at each of `count` samples, (S,) m; NaN where no view shows it."""
    table = np.full((len(measurements) + 1, count), np.nan)
    for row, measured in zip(table, measurements, strict=False):
        row[measured.sample] = np.where(measured.radius > 0, measured.radius, np.nan)
    some = np.isfinite(table).any(axis=0)
    result = np.full(count, np.nan)
    result[some] = np.nanmedian(table[:, some], axis=0)
    return result

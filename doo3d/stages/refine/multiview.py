"""Places along paths as each of many cameras saw them: what its mask says of them, sideways."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.mask import mask_pixels
from ...geometry.polyline import unit
from ...types import CameraView, Floats, Ints
from .cross_sections import frames_towards, silhouette
from .samples import Stations


@dataclass(frozen=True)
class Look:
    """What one mask says of the stations that its camera has in view.

    station : (K,) int, which. lateral : (K, 3) unit, sideways for that camera. offset : (K,) m, how far that way the middle of
    the mask lies. radius : (K,) m, half its width; 0 where the mask is not.
    """

    station: Ints
    lateral: Floats
    offset: Floats
    radius: Floats


def look_at(stations: Stations, tangent: Floats, view: CameraView, reach: float) -> Look | None:
    """The stations, with their tangents (S, 3), in one view; None where none is in it.

    reach : radii, pixels farther from a station do not belong to it.
    """
    turn, place, camera = view.pose[:3, :3], view.pose[:3, 3], view.camera
    local = (stations.places - place) @ turn
    pixels = camera.project(local)
    inside = np.asarray(np.isfinite(pixels).all(axis=1))
    inside[inside] = ((pixels[inside] >= 0) & (pixels[inside] <= (camera.width - 1, camera.height - 1))).all(axis=1)
    station = np.flatnonzero(inside)
    if len(station) < 2 or not view.mask.any():
        return None
    # stretches in view are paths of their own
    path = np.cumsum(np.concatenate(([0], (np.diff(station) > 1) | (np.diff(stations.path[station]) != 0))))
    local, along = local[station], unit(tangent[station] @ turn)
    frames = frames_towards(local, along, np.zeros(3))
    limit = reach * stations.radius[station]
    seen = silhouette(local, frames, path, mask_pixels(view.mask), camera, limit, stations.half)
    return Look(station, frames.lateral @ turn.T, seen.offset, seen.radius)


def median_radius(looks: list[Look], count: int) -> Floats:
    """The median of what the looks say of each of `count` stations, (S,) m; NaN where none of them sees it."""
    table = np.full((len(looks) + 1, count), np.nan)
    for row, look in zip(table, looks, strict=False):
        row[look.station] = np.where(look.radius > 0, look.radius, np.nan)
    some = np.isfinite(table).any(axis=0)
    result = np.full(count, np.nan)
    result[some] = np.nanmedian(table[:, some], axis=0)
    return result

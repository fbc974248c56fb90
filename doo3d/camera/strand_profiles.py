"""Sample color profiles across a strand, and compare them between two images."""

from dataclasses import dataclass

import cv2
import numpy as np

from ..geometry.polyline import arc_length, densify, unit
from ..types import Array, Bools, Floats

SPACING_PX = 2.0
"""Distance between the samples of a strand, px: finer ones contain the same pixels."""

PROFILE_SAMPLES = 11
"""Number of positions of a profile across a strand, evenly spaced."""

SURROUND_PX = 3.0
"""Length of a profile beyond either edge of the strand, px: the contrast to the surroundings is the evidence."""

NOISE_LEVELS = 6.0
"""Grey levels of 255, root mean square over a profile: weaker contrasts are noise."""


@dataclass
class StrandSamples:
    """Samples along a strand of the left image.

    Attributes
    ----------
    points
        (S, 2) px, positions.
    normals
        (S, 2) unit, across the strand.
    radius
        (S,) px, half-width.
    offsets
        (K,) px, positions of a profile along the normal.
    profiles
        (S, K, C), grey levels of each profile in C channels, minus their means.
    """

    points: Floats
    normals: Floats
    radius: Floats
    offsets: Floats
    profiles: Floats


@dataclass(frozen=True)
class TargetImage:
    """The right image, in which strands are searched.

    Attributes
    ----------
    image
        (H, W, C) float32, grey levels.
    near
        (H, W) bool, where the object may be; None: everywhere.
    """

    image: Array
    near: Bools | None

    def contains(self, places: Floats) -> Bools:
        """Return whether places (..., 2) px are in the image, where the object may be."""
        column, row = np.rint(places[..., 0]).astype(int), np.rint(places[..., 1]).astype(int)
        height, width = self.image.shape[:2]
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        if self.near is not None:
            inside[inside] = self.near[row[inside], column[inside]]
        return np.asarray(inside)

    def difference(self, samples: StrandSamples, places: Floats) -> Floats:
        """Return the difference of profiles at places from samples, 0 to 1: (S, Q).

        places : (S, Q, K, 2) px, of Q profiles for each of S samples.
        """
        return _difference(samples.profiles[:, None], _subtract_mean(_read_image(self.image, places)))


def sample_strand(line: Floats, radius: Floats, left: Array) -> StrandSamples:
    """Sample a strand of an image, with a profile at each sample.

    line : (P, 2) px. radius : (P,) px, half-width at each point. left : (H, W, C) float32.
    """
    points = densify(line, SPACING_PX)
    at = np.linspace(0.0, float(arc_length(line)[-1]), len(points))
    width = np.interp(at, arc_length(line), radius)
    tangents = unit(np.gradient(points, axis=0))
    normals = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1)
    offsets = np.linspace(-1.0, 1.0, PROFILE_SAMPLES) * (np.median(width) + SURROUND_PX)
    places = points[:, None] + offsets[:, None] * normals[:, None]
    return StrandSamples(points, normals, width, offsets, _subtract_mean(_read_image(left, places)))


def _read_image(image: Array, places: Floats) -> Floats:
    """Return the values (..., C) of an image at places (..., 2) px, interpolated.

    Outside, the nearest border pixel counts.
    """
    flat = places.reshape(-1, places.shape[-2], 2).astype(np.float32)
    parts = [
        cv2.remap(image, part[..., 0], part[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        for part in np.array_split(flat, len(flat) // 16384 + 1)
    ]
    return np.concatenate(parts).reshape(*places.shape[:-1], -1)


def _subtract_mean(profiles: Floats) -> Floats:
    """Return profiles (..., K, C) minus the mean of each channel."""
    return np.asarray(profiles - profiles.mean(axis=-2, keepdims=True))


def _difference(first: Floats, second: Floats) -> Floats:
    """Return the difference of profiles (..., K, C): 0 if equal, 1 if one is flat.

    It is the energy of the difference relative to the sum of both energies and of noise, at most 1.
    """
    energy = np.square(first).sum(axis=(-1, -2)) + np.square(second).sum(axis=(-1, -2))
    noise = first.shape[-2] * first.shape[-1] * NOISE_LEVELS**2
    return np.asarray(np.minimum(np.square(first - second).sum(axis=(-1, -2)) / (energy + noise), 1.0))

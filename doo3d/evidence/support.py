"""Bare surface: the supporting surface seen in plain view, where an object on it would have been seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from ..geometry.noise import COLOR_NOISE, MAD_TO_DEVIATION
from ..kernels import nearest, part_medians, polyline_tangents
from ..types import Array, Bools, Camera, Floats, Foreground, Ints

BESIDE_RADII = np.array([-4.0, -3.0, 3.0, 4.0])
"""Lateral offsets from the centre line at which the supporting surface is looked for: near, but beyond the rim of the mask."""

MAX_RISE_RADII = 8.0
"""Radii behind a joint up to which a reading beside it counts as the supporting surface. Farther back is another surface."""

RISE_WINDOW_RADII = 20.0
"""Length of chain over which the rise at an end is measured."""

MIN_RISE_READINGS = 6
"""Readings beside an end from which a rise and its noise are measured at least."""

MIN_RISE_NOISE_RATIO = 2.0
"""Least ratio of the rise to the noise of single readings: half the rise, the threshold, is then one standard deviation."""

COLOR_SAMPLES = 256
"""Colors at most that are kept of the object, and of the surface beside it."""

NEIGHBOR_SAMPLES = 3
"""The distance of a color to a set of samples is that to its third nearest one, so that two stray samples decide nothing."""

BARE_COLOR_SHARE = 0.7
"""Distance of a color to the object, as a share of its distances to object and surface, above which it is the surface's. Measured
on rendered scenes: holes in the mask lie below 0.3, bare tables above 0.8, occluders between 0.4 and 0.8."""

OBJECT_COLOR_SHARE = 1 - BARE_COLOR_SHARE
"""The same share below which a color is the object's alone: as sure as the other is of the surface."""

NEAR_ENDS = 0.1
"""m within which the nearest end is found quickly: gaps are wider by little."""

COLOR_STEP_BITS = 3
"""Low bits of each color channel that are ignored: steps of 8, about the noise of a camera, so that few colors are looked up."""

COLOR_STEPS = 256 >> COLOR_STEP_BITS
"""Steps of each color channel."""


@dataclass(frozen=True)
class Support:
    """What the surface beside an object looks like, to tell bare surface from a hole in the mask.

    Attributes
    ----------
    ends
        (E, 3) m, the ends of chains at which the rise was measured.
    rise
        (E,) m, distance by which the surface beside the chain lies behind the chain; NaN where depth does not resolve it.
    color
        (H, W, 3) uint8 RGB; None decides by depth alone.
    object_colors, surface_colors
        (K, 3) 8-bit Lab, samples of the object and of the surface beside it; empty without color.
    """

    ends: Floats
    rise: Floats
    color: Array | None
    object_colors: Floats
    surface_colors: Floats
    _shares: Floats = field(default_factory=lambda: np.full((COLOR_STEPS,) * 3, np.nan), repr=False, compare=False)

    @staticmethod
    def beside(chains: Sequence[Floats], radius: float, foreground: Foreground) -> Support | None:
        """Measure the surface beside chains; return None for a cloud and in 2-D.

        Parameters
        ----------
        chains
            joints of each chain, (N, 3) m in the camera's optical frame.
        radius
            radius of the object, m.
        foreground
            mask, depth, camera and color of the frame.
        """
        depth, mask, camera, color = foreground.depth, foreground.mask, foreground.camera, foreground.color
        if depth is None or mask is None or camera is None or not chains:
            return None
        joints, bounds = np.concatenate(chains), np.cumsum([0, *map(len, chains)])
        beside = _pixels_beside(joints, bounds, radius, camera)
        visible = _in_image(beside, mask.shape)
        u, v = np.where(visible[..., None], beside, 0).transpose(2, 0, 1)
        visible &= ~mask[v, u]
        behind = np.where(visible & (depth[v, u] > 0), depth[v, u] - joints[:, 2:], np.nan)
        behind[~(np.abs(behind) <= MAX_RISE_RADII * radius)] = np.nan
        ends, rise = _rise_at_ends(joints, bounds, behind, RISE_WINDOW_RADII * radius)
        if color is None:
            return Support(ends, rise, None, np.zeros((0, 3)), np.zeros((0, 3)))
        on = np.rint(camera.project(joints)).astype(np.int64)
        on = on[_in_image(on, mask.shape)]
        on = on[mask[on[:, 1], on[:, 0]]]
        return Support(ends, rise, color, _samples(color, on), _samples(color, beside[visible]))

    def bare_log_odds(self, points: Floats, pixels: Ints, readings: Floats, noise: float) -> Floats:
        """Return the log-odds that positions lie over bare surface, whose pixel is outside the mask and is not clearly nearer.

        Color decides where it is clearly that of the surface or that of the object. Elsewhere depth decides: at bare surface the
        reading is farther than the position by more than half the rise of the object over the surface.

        Parameters
        ----------
        points
            (N, 3) m in the camera's optical frame.
        pixels
            (N, 2) int, the pixel (u, v) that each position projects to.
        readings
            (N,) m, depth at these pixels.
        noise
            1/m, standard deviation of the readings in inverse depth.

        Returns
        -------
        (N,) nat; minus infinity where neither color nor depth tells.
        """
        share = self._object_shares(pixels)
        odds = np.log(share / (1 - share))
        undecided = np.flatnonzero((share >= OBJECT_COLOR_SHARE) & (share <= BARE_COLOR_SHARE))
        if len(undecided):
            z, reading = points[undecided, 2], readings[undecided]
            rise = self.rise[nearest(points[undecided], self.ends, NEAR_ENDS, limited=False)[1]]
            odds[undecided] = np.nan_to_num((reading - z - rise / 2) / (noise * reading * z), nan=-np.inf)
        return np.asarray(odds)

    def has_object_color(self, pixels: Ints) -> Bools:
        """Tell which pixels (N, 2), (u, v), have the color of the object without any of the surface beside it: (N,) bool."""
        return np.asarray(self._object_shares(pixels) < OBJECT_COLOR_SHARE)

    def _object_shares(self, pixels: Ints) -> Floats:
        """Return the distance of each pixel's color to the object, as a share of its distances to object and surface: (N,)."""
        if self.color is None or min(len(self.object_colors), len(self.surface_colors)) < NEIGHBOR_SAMPLES:
            return np.full(len(pixels), (OBJECT_COLOR_SHARE + BARE_COLOR_SHARE) / 2)
        steps = self.color[pixels[:, 1], pixels[:, 0]].astype(np.int64) >> COLOR_STEP_BITS
        red, green, blue = steps.T
        shares = self._shares[red, green, blue]
        missing = np.isnan(shares)
        if missing.any():
            lab = _lab(((steps[missing] << COLOR_STEP_BITS) + (1 << (COLOR_STEP_BITS - 1))).astype(np.uint8))
            to_object, to_surface = (
                COLOR_NOISE + _distance_to(lab, samples) for samples in (self.object_colors, self.surface_colors)
            )
            shares[missing] = to_object / (to_object + to_surface)
            self._shares[red[missing], green[missing], blue[missing]] = shares[missing]
        return np.asarray(shares)


def _pixels_beside(joints: Floats, bounds: Ints, radius: float, camera: Camera) -> Ints:
    """Return the pixels (N, 4, 2) beside the joints (N, 3) of all C chains, at BESIDE_RADII radii across; bounds : (C + 1,)."""
    projected = camera.project(joints)
    tangents = polyline_tangents(projected, bounds, np.zeros(len(bounds) - 1, dtype=bool))
    across = np.column_stack((-tangents[:, 1], tangents[:, 0]))
    radius_px = camera.fx * radius / joints[:, 2]
    beside = projected[:, None] + (radius_px[:, None] * BESIDE_RADII)[..., None] * across[:, None]
    return np.asarray(np.rint(beside), dtype=np.int64)


def _rise_at_ends(joints: Floats, bounds: Ints, behind: Floats, window: float) -> tuple[Floats, Floats]:
    """Return the ends (2 C, 3) of C chains, and the rise (2 C,) m at each; NaN where it is not told from zero.

    joints : (N, 3) of all chains. bounds : (C + 1,), first joint of each, and N. behind : (N, 4) m, beside each joint; NaN =
    unknown. The rise is the median of distances behind the chain, if they are not too few and not too noisy.
    """
    first, last = bounds[:-1], bounds[1:]
    spacing = np.linalg.norm(joints[first + 1] - joints[first], axis=1)
    count = np.maximum(2, (window / np.maximum(spacing, 1e-9)).astype(int))
    from_first = (first, np.minimum(first + count, last))
    to_last = (np.maximum(last - count, first), last)
    start, stop = (behind.shape[1] * np.column_stack(rows).ravel() for rows in zip(from_first, to_last, strict=True))
    rise, deviation, known = part_medians(behind.ravel(), start, stop)
    is_resolved = (known >= MIN_RISE_READINGS) & (rise > MIN_RISE_NOISE_RATIO * MAD_TO_DEVIATION * deviation)
    return joints[np.column_stack((first, last - 1)).ravel()], np.where(is_resolved, rise, np.nan)


def _in_image(pixels: Ints, shape: tuple[int, ...]) -> Bools:
    return np.asarray((pixels >= 0).all(axis=-1) & (pixels < (shape[1], shape[0])).all(axis=-1))


def _samples(color: Array, pixels: Ints) -> Floats:
    """Return the Lab colors (K, 3) of at most COLOR_SAMPLES pixels, evenly chosen."""
    chosen = pixels[:: max(1, -(-len(pixels) // COLOR_SAMPLES))]
    return _lab(color[chosen[:, 1], chosen[:, 0]])


def _lab(colors: Array) -> Floats:
    if not len(colors):
        return np.zeros((0, 3))
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(colors)[None], cv2.COLOR_RGB2LAB)[0], dtype=float)


def _distance_to(colors: Floats, samples: Floats) -> Floats:
    """Return the distance of each color to its third nearest sample: (N,)."""
    distance = np.linalg.norm(colors[:, None] - samples[None], axis=2)
    return np.asarray(np.partition(distance, NEIGHBOR_SAMPLES - 1, axis=1)[:, NEIGHBOR_SAMPLES - 1])

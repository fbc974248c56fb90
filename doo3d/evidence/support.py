"""The surface beneath and beside an object, seen in plain view, where an object on it would have been seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.noise import MAD_TO_DEVIATION
from ..kernels import ColorOdds, nearest, part_medians, polyline_tangents, sample_across
from ..types import Array, Bools, Camera, Floats, Foreground, Ints, Plane
from .appearance import HISTOGRAM_SMOOTHING, MIN_FREQUENCY, SHADES, SHADOW_SHARE

LATERAL_RADII = np.array([0.0, -4.0, -3.0, 3.0, 4.0])
"""Lateral offsets from the centre line: on it, and where the supporting surface is looked for: near, but beyond the rim of the
mask."""

MAX_RISE_RADII = 8.0
"""Radii behind a joint up to which a reading beside it counts as the supporting surface. Farther back is another surface."""

RISE_WINDOW_RADII = 20.0
"""Length of chain over which the rise at an end is measured."""

MIN_RISE_READINGS = 6
"""Readings beside an end from which a rise and its noise are measured at least."""

MIN_RISE_NOISE_RATIO = 2.0
"""Least ratio of the rise to the noise of single readings: half the rise, the threshold, is then one standard deviation."""

BESIDE_PX = np.linspace(4.0, 14.0, 6)
"""px beyond a strand's sides at which the surface beside it is read: a stereo camera shows the strand 6 to 8 px too wide."""

NEAR_ENDS = 0.1
"""m within which the nearest end is found quickly: gaps are wider by little."""


@dataclass(frozen=True)
class Support:
    """The surface beside an object: how far behind the object it is, and its colors, to tell it from a hole in the mask.

    Attributes
    ----------
    ends
        (E, 3) m, the ends of chains at which the rise was measured.
    rise
        (E,) m, distance by which the surface beside the chain lies behind the chain; NaN where depth does not resolve it.
    rise_noise
        (E,) m, standard deviation of single readings of the rise.
    colors
        the colors of the object along the chains against those beside them; None without color, and if one of them is not seen.
    plane
        the plane around the object, with the camera that sees it and half the height of the object over it, m: it tells bare
        surface where the rise is not resolved; None if there is no plane.
    """

    ends: Floats
    rise: Floats
    rise_noise: Floats
    colors: ColorOdds | None
    plane: tuple[Plane, Camera, float] | None = None

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
        depth, mask, camera = foreground.depth, foreground.mask, foreground.camera
        if depth is None or mask is None or camera is None or not chains:
            return None
        joints, bounds = np.concatenate(chains), np.cumsum([0, *map(len, chains)])
        projected = camera.project(joints)
        tangents = polyline_tangents(projected, bounds, np.zeros(len(chains), dtype=bool))
        offsets = (camera.fx * radius / joints[:, 2:]) * LATERAL_RADII
        pixels, readings = sample_across(projected, tangents[:, ::-1] * (-1, 1), offsets, mask, depth)
        behind = readings[:, 1:] - joints[:, 2:]
        behind[~(np.abs(behind) <= MAX_RISE_RADII * radius)] = np.nan
        colors = None if foreground.color is None else _colors(foreground.color, pixels, mask)
        plane = None if foreground.plane is None else (foreground.plane, camera, radius)
        return Support(*_rise_at_ends(joints, bounds, behind, RISE_WINDOW_RADII * radius), colors, plane)

    def bare_log_odds(self, points: Floats, pixels: Ints, readings: Floats, noise: float) -> Floats:
        """Return the log-odds that positions lie over bare surface, whose pixel is outside the mask and is not clearly nearer.

        The log-odds of color and depth are added. By depth they are the distance by which the reading is farther than the
        position with half the rise of the object over the surface, over the noise of both; where the rise is not known, the
        distance by which the reading is lower over the plane than half the object. Either is 0 where it is not known.

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
        (N,) nat; 0 where neither color nor depth tells.
        """
        end, z = nearest(points, self.ends, NEAR_ENDS, limited=False)[1], points[:, 2]
        deviation = np.hypot(noise * readings * z, self.rise_noise[end])
        by_depth = (readings - z - self.rise[end] / 2) / deviation
        if self.plane is not None and np.isnan(by_depth).any():
            plane, camera, middle = self.plane
            height = camera.unproject(pixels, readings) @ plane.normal - plane.height
            by_depth = np.where(np.isnan(by_depth), (middle - height) / deviation, by_depth)
        by_depth = np.nan_to_num(by_depth)
        return np.asarray(by_depth if self.colors is None else by_depth - self.colors.log_odds_at(pixels))

    def has_object_color(self, pixels: Ints) -> Bools:
        """Tell which pixels (N, 2), (u, v), have a color of the object rather than of the surface beside it: (N,) bool."""
        if self.colors is None:
            return np.zeros(len(pixels), dtype=bool)
        return np.asarray(self.colors.log_odds_at(pixels) > 0)


def _colors(color: Array, pixels: Ints, mask: Bools) -> ColorOdds | None:
    """Return the colors on the object against those beside it; None if either are too few.

    pixels : (N, A) row-major indices, on the centre line and then beside it; -1 outside the image.
    """
    inside, around = (
        some[(some >= 0) & (mask.ravel()[some] == own)] for some, own in ((pixels[:, 0], True), (pixels[:, 1:], False))
    )
    if min(len(inside), len(around)) < MIN_RISE_READINGS:
        return None
    shades = np.array(SHADES), SHADOW_SHARE
    return ColorOdds(np.ascontiguousarray(color), inside, around, *shades, HISTOGRAM_SMOOTHING, MIN_FREQUENCY)


def _rise_at_ends(joints: Floats, bounds: Ints, behind: Floats, window: float) -> tuple[Floats, Floats, Floats]:
    """Return the ends (2 C, 3) of C chains, and the rise and its noise (2 C,) m at each; NaN where it is not told from zero.

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
    noise = MAD_TO_DEVIATION * deviation
    is_resolved = (known >= MIN_RISE_READINGS) & (rise > MIN_RISE_NOISE_RATIO * noise)
    return joints[np.column_stack((first, last - 1)).ravel()], np.where(is_resolved, rise, np.nan), noise

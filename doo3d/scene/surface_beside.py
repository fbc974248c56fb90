"""The surface beneath and beside an object, seen in plain view, where an object on it would have been seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.curves import Curves
from ..kernels import surface_beside, surface_log_odds
from ..types import Array, Bools, Camera, Floats, Ints, Plane
from .appearance import Appearance
from .frame_facts import FrameFacts

LATERAL_RADII = np.array([-4.0, -3.0, 3.0, 4.0])
"""Lateral offsets from the centre line where the supporting surface is looked for: near, but beyond the rim of the mask."""

MIN_RISE_READINGS = 6
"""Readings beside an end from which a rise and its noise are measured at least."""

BESIDE_PX = np.linspace(4.0, 14.0, 6)
"""px beyond a strand's sides at which the surface beside it is read: a stereo camera shows the strand 6 to 8 px too wide."""


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
    colors: Appearance | None
    plane: tuple[Plane, Camera, float] | None = None

    @staticmethod
    def beside(chains: Curves, radius: float, frame: FrameFacts, camera: Camera, color: Array, plane: Plane | None) -> Support:
        """Measure the surface beside chains.

        Parameters
        ----------
        chains
            joints of each chain, at least one, (N, 3) m in the camera's optical frame.
        radius
            radius of the object, m.
        frame
            the mask and the depth of the frame.
        camera
            the intrinsics.
        color
            (H, W, 3) uint8 RGB; (0, 0, 3) without a color image.
        plane
            the plane around the object; None where there is none.
        """
        inside, around, rise, noise = surface_beside(
            chains.points, chains.bounds, camera.intrinsics, radius, LATERAL_RADII, frame.mask, frame.depth, MIN_RISE_READINGS
        )
        seen = min(len(inside), len(around))
        colors = None if not color.size or seen < MIN_RISE_READINGS else Appearance(color, inside, around)
        at_half = None if plane is None else (plane, camera, radius)
        return Support(chains.points[chains.tips], rise, noise, colors, at_half)

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
        camera: Floats = np.zeros(0)
        plane: Floats = np.zeros(0)
        if self.plane is not None:
            camera, plane = self.plane[1].intrinsics, np.array((*self.plane[0].normal, self.plane[0].height, self.plane[2]))
        rises = self.ends, self.rise, self.rise_noise
        by_depth = surface_log_odds(points, pixels, readings, noise, *rises, camera, plane)
        return np.asarray(by_depth if self.colors is None else by_depth - self.colors.log_odds_at(pixels))

    def has_object_color(self, pixels: Ints) -> Bools:
        """Return which pixels (N, 2), (u, v), have a color of the object rather than of the surface beside it: (N,) bool."""
        if self.colors is None:
            return np.zeros(len(pixels), dtype=bool)
        return np.asarray(self.colors.log_odds_at(pixels) > 0)

"""Tell by a depth image whether a position in space is seen, free, hidden, over bare surface, or unknown."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np

from ..types import Bools, Camera, Floats, Ints
from .frame_facts import FrameFacts
from .point_visibility import PointVisibility
from .surface_beside import Support

FRONT_PIXELS = 2
"""Pixels round a position in which nothing but the object may be in front of it, where the camera looks past the object."""

STATES = np.array((PointVisibility.SURFACE, PointVisibility.HIDDEN, PointVisibility.FREE))
"""The states of a position with a reading; of equal ones the first is the most likely."""


class StateLogOdds(NamedTuple):
    """The log-odds of each state of N positions, (N,) each, in nat; minus infinity for a state that the mask excludes.

    Attributes
    ----------
    seen
        the reading is of the object, at about the depth of the position.
    free
        the camera saw through the position.
    hidden
        something in front of the position hides it, or a hole in the mask.
    bare
        the pixel shows the bare surface that the object lies on; minus infinity where that is not known.
    unknown
        infinite without a reading and outside the image, where the other states have 0; minus infinity elsewhere.
    """

    seen: Floats
    free: Floats
    hidden: Floats
    bare: Floats
    unknown: Floats


@dataclass(frozen=True)
class DepthModel:
    """What one camera saw, to ask of any position in space whether it is seen, hidden or free.

    The noise of a depth sensor is constant in inverse depth. So the log-odds are differences in inverse depth, between a position
    with its margin and the reading there, over that noise: those of a logistic distribution, whose tails are longer than a
    Gaussian's, as a sensor's are. Noise twice as large halves them.

    Attributes
    ----------
    facts
        the mask of the object and the depth of the frame.
    camera
        the intrinsics.
    margin
        m. A reading must lie at least this far behind a position to show that the position is free, or in front to hide it.
    own_object_counts_as_free
        True if a reading of the object itself behind a position also shows that the position is free.
    support
        the surface beneath and beside the object; None tells no position BARE.
    """

    facts: FrameFacts
    camera: Camera
    margin: float
    own_object_counts_as_free: bool = False
    support: Support | None = None

    @cached_property
    def noise(self) -> float:
        """The standard deviation of the readings of the object in inverse depth, 1/m, above 0."""
        return max(self.facts.inverse_depth_noise, float(np.finfo(np.float32).eps))

    def log_odds(self, points: Floats) -> StateLogOdds:
        """Return the log-odds of the five states of each position.

        points : (N, 3) m in the camera's optical frame.
        """
        classes, odds, at, pixels, readings = self._ask(points, self.noise)
        unknown = np.where(classes <= PointVisibility.MASKED, np.inf, -np.inf)
        told = np.minimum(0.0, unknown)
        if self.support is not None and len(at):
            bare = self.support.bare_log_odds(points[at], pixels, readings, self.noise)
            told[at], odds[at, 1] = np.minimum(odds[at, 1], bare), np.minimum(odds[at, 1], -bare)
        return StateLogOdds(odds[:, 0], odds[:, 2], odds[:, 1], told, unknown)

    def classify(self, points: Floats) -> Ints:
        """Return the PointVisibility of each position, its most likely state.

        OUTSIDE, NO_DEPTH and MASKED are unknown, SURFACE is seen. Of states with equal log-odds, seen comes first, then hidden.

        Parameters
        ----------
        points
            (N, 3) m in the camera's optical frame.

        Returns
        -------
        (N,) int64, values of PointVisibility. Positions behind the camera or with NaN are OUTSIDE.
        """
        classes, _, at, pixels, readings = self._ask(points, 1.0)  # the noise decides only where a surface is known
        if self.support is not None and len(at):
            bare = self.support.bare_log_odds(points[at], pixels, readings, self.noise)
            classes[at[bare > 0]] = int(PointVisibility.BARE)
        return classes

    def is_outside(self, points: Floats) -> Bools:
        """Return which positions (N, D) are outside the image: (N,) bool."""
        return ~self._pixels_of(points)[0]

    def _ask(self, points: Floats, noise: float) -> tuple[Ints, Floats, Ints, Ints, Floats]:
        """Return the class of each position without BARE, and its log-odds (N, 3) of seen, hidden and free.

        Then the indices (K,) of the positions that may be over bare surface, their pixels (K, 2), and the readings there (K,).
        """
        inside, u, v = self._pixels_of(points)
        classes, odds = np.full(len(points), int(PointVisibility.OUTSIDE)), np.zeros((len(points), len(STATES)))
        at, on = np.flatnonzero(inside), self.facts.mask[v, u]
        classes[at] = np.where(on, PointVisibility.MASKED, PointVisibility.NO_DEPTH)
        reading = self.facts.depth[v, u].astype(float)
        known = reading > 0
        at, on, reading, pixels = at[known], on[known], reading[known], np.column_stack((u, v))[known]
        z = points[at, 2]
        # Differences in inverse depth have exactly the signs of those of depth: the classes do not depend on the noise.
        scale = noise * reading * z
        beyond, before = (reading - (z + self.margin)) / scale, ((z - self.margin) - reading) / scale
        free = beyond if self.own_object_counts_as_free else np.where(on, -np.inf, beyond)
        odds[at] = np.column_stack((np.where(on, -np.maximum(before, free), -np.inf), np.where(on, before, -beyond), free))
        classes[at] = STATES[odds[at].argmax(axis=1)]
        behind = (classes[at] == PointVisibility.HIDDEN) & ~on & (reading >= z - self.margin)
        return classes, odds, at[behind], pixels[behind], reading[behind]

    def _pixels_of(self, points: Floats) -> tuple[Bools, Ints, Ints]:
        """Return which of the positions (N, D) project into the image, (N,) bool, and the column and row of the pixel of each."""
        pixels = self.camera.project(points)
        height, width = self.facts.mask.shape
        inside = np.asarray(((pixels > -0.5) & (pixels < (width - 0.5, height - 0.5))).all(axis=1))
        u, v = np.rint(pixels[inside]).astype(np.int64).T
        return inside, u, v

    def is_beside(self, points: Floats, clearance: float) -> Bools:
        """Return at which positions the camera looks past the object: outside its mask, and not at something in front.

        Unlike FREE and BARE this trusts the mask, where depth is undecided: in gaps of a few pixels. A pixel without reading is
        in front if one next to it is. Pixels that clearly have the object's color are holes in the mask, and not beside it.

        Parameters
        ----------
        points
            (N, 3) m in the camera's optical frame.
        clearance
            m by which something in front of a position is nearer at least.

        Returns
        -------
        (N,) bool, False outside the image.
        """
        inside, u, v = self._pixels_of(points)
        beside = np.zeros(len(points), dtype=bool)
        if not inside.any():
            return beside
        left, top = max(u.min() - FRONT_PIXELS, 0), max(v.min() - FRONT_PIXELS, 0)
        part = np.s_[top : v.max() + FRONT_PIXELS + 1, left : u.max() + FRONT_PIXELS + 1]
        others = np.where(self.facts.mask[part] | (self.facts.depth[part] <= 0), np.inf, self.facts.depth[part]).astype(
            np.float32
        )
        nearest = cv2.erode(others, np.ones((2 * FRONT_PIXELS + 1, 2 * FRONT_PIXELS + 1), np.uint8))
        shown = ~self.facts.mask[v, u] & (nearest[v - top, u - left] >= points[inside, 2] - clearance)
        if self.support is not None and shown.any():
            shown[shown] = ~self.support.has_object_color(np.column_stack((u, v))[shown])
        beside[inside] = shown
        return beside

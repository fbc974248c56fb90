"""Tell by a depth image whether a position in space is seen, free, hidden, over bare surface, or unknown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np

from ..config import VisibilityConfig
from ..types import Array, Bools, Camera, CameraView, Floats, Foreground, Ints
from .frame_facts import FrameFacts, facts_of
from .support import Support

FRONT_PIXELS = 2
"""Pixels round a position in which nothing but the object may be in front of it, where the camera looks past the object."""

MARGIN_RADII = 1.2
"""Radii; least distance behind a position of depth that shows free space: an object on a table is two radii thick."""


class PointVisibility(IntEnum):
    """What the depth image says about a position in space, compared with the reading at the pixel where the position projects to.

    - OUTSIDE: the position projects outside the image.
    - NO_DEPTH: its pixel has no reading and is outside the object's mask.
    - MASKED: its pixel has no reading, but is in the object's mask.
    - SURFACE: the reading is of the object, at about the depth of the position.
    - HIDDEN: something in front of the position hides it, or a surface at about its depth that stands out as the object does.
    - FREE: the reading is farther than the position, so that the camera saw through it.
    - BARE: the reading is of the bare surface that the object lies on. Only told if the surface beside the object is known.
    """

    OUTSIDE = 0
    """The position is not in the image."""
    NO_DEPTH = 1
    """Its pixel has no reading and is outside the object's mask."""
    MASKED = 2
    """Its pixel has no reading, but is in the object's mask."""
    SURFACE = 3
    """Its pixel is in the object's mask, with a reading at about the same depth (or behind it, if that is not free)."""
    HIDDEN = 4
    """The reading is nearer, so that something is in front of the position; or about as far, at a hole in the mask."""
    FREE = 5
    """The reading is farther, so that the camera saw through the position. A reading of the object itself counts only if
    `own_object_counts_as_free` is set."""
    BARE = 6
    """Its pixel shows the bare surface that the object lies on, so that no object is there."""


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

    In 2-D there is only a mask: positions are pixels (u, v), the object is seen inside the mask, and everything outside counts
    as free.

    Attributes
    ----------
    depth
        (H, W) m, 0 = no reading; None in 2-D.
    mask
        (H, W) bool, the pixels of the object.
    camera
        the intrinsics; None in 2-D.
    margin
        m. A reading must lie at least this far behind a position to show that the position is free, or in front to hide it.
    own_object_counts_as_free
        True if a reading of the object itself behind a position also shows that the position is free.
    support
        the surface beneath and beside the object; None tells no position BARE.
    facts
        the facts of mask and depth, if they are made.
    """

    depth: Array | None
    mask: Bools
    camera: Camera | None
    margin: float
    own_object_counts_as_free: bool = False
    support: Support | None = None
    facts: FrameFacts | None = None

    @staticmethod
    def of(foreground: Foreground, config: VisibilityConfig, radius: float) -> DepthModel | MultiViewDepthModel | None:
        """Return the model of the frame that a foreground was segmented from; None for a cloud without camera views.

        Parameters
        ----------
        foreground
            the object's points, with the mask and depth of the frame or the camera views of a fused cloud.
        config
            section `visibility` of the settings; `margin` is raised to MARGIN_RADII (1.2) radii.
        radius
            radius of the object, m (px in 2-D).
        """
        margin, own = max(config.margin, MARGIN_RADII * radius), config.own_object_counts_as_free
        if foreground.views:
            return MultiViewDepthModel.of_views(foreground.views, margin, own)
        if foreground.mask is None:
            return None
        return DepthModel(foreground.depth, foreground.mask, foreground.camera, margin, own, facts=facts_of(foreground))

    @cached_property
    def noise(self) -> float:
        """The standard deviation of the readings of the object in inverse depth, 1/m, above 0; 1 in 2-D."""
        if self.depth is None:
            return 1.0
        facts = self.facts or FrameFacts(self.mask, self.depth)
        return max(facts.inverse_depth_noise, float(np.finfo(np.float32).eps))

    def log_odds(self, points: Floats) -> StateLogOdds:
        """Return the log-odds of the five states of each position. In 2-D they are infinite: the mask decides.

        points : (N, 3) m in the camera's optical frame, or (N, 2) px in 2-D.
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
            (N, 3) m in the camera's optical frame, or (N, 2) px in 2-D.

        Returns
        -------
        (N,) int64, values of PointVisibility. Positions behind the camera or with NaN are OUTSIDE. In 2-D a position in the
        image is SURFACE in the mask, and FREE elsewhere.
        """
        classes, _, at, pixels, readings = self._ask(points, 1.0)  # the noise decides only where a surface is known
        if self.support is not None and len(at):
            bare = self.support.bare_log_odds(points[at], pixels, readings, self.noise)
            classes[at[bare > 0]] = int(PointVisibility.BARE)
        return classes

    def is_outside(self, points: Floats) -> Bools:
        """Tell which positions (N, D) are outside the image: (N,) bool."""
        return ~self._pixels_of(points)[0]

    def _ask(self, points: Floats, noise: float) -> tuple[Ints, Floats, Ints, Ints, Floats]:
        """Return the class of each position without BARE, and its log-odds (N, 3) of seen, hidden and free.

        Then the indices (K,) of the positions that may be over bare surface, their pixels (K, 2), and the readings there (K,).
        """
        inside, u, v = self._pixels_of(points)
        classes, odds = np.full(len(points), int(PointVisibility.OUTSIDE)), np.zeros((len(points), len(STATES)))
        at, on = np.flatnonzero(inside), self.mask[v, u]
        if self.depth is None:
            classes[at] = np.where(on, PointVisibility.SURFACE, PointVisibility.FREE)
            odds[at] = np.where(on[:, None], (np.inf, -np.inf, -np.inf), (-np.inf, -np.inf, np.inf))
            return classes, odds, at[:0], np.zeros((0, 2), dtype=np.int64), np.zeros(0)
        classes[at] = np.where(on, PointVisibility.MASKED, PointVisibility.NO_DEPTH)
        reading = self.depth[v, u].astype(float)
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

    def pixel_at(self, point: Floats) -> float:
        """Return the width that a pixel shows at the depth of a position, m; 1 px in 2-D."""
        return 1.0 if self.camera is None else float(point[2]) / self.camera.fx

    def _pixels_of(self, points: Floats) -> tuple[Bools, Ints, Ints]:
        """Return which of the positions (N, D) project into the image, (N,) bool, and the column and row of the pixel of each."""
        pixels = points if self.camera is None else self.camera.project(points)
        height, width = self.mask.shape
        inside = np.asarray(((pixels > -0.5) & (pixels < (width - 0.5, height - 0.5))).all(axis=1))
        u, v = np.rint(pixels[inside]).astype(np.int64).T
        return inside, u, v

    def is_beside(self, points: Floats, clearance: float) -> Bools:
        """Tell at which positions the camera looks past the object: outside its mask, and not at something in front.

        Unlike FREE and BARE this trusts the mask, where depth is undecided: in gaps of a few pixels. A pixel without reading is
        in front if one next to it is. Pixels that clearly have the object's color are holes in the mask, and not beside it.

        Parameters
        ----------
        points
            (N, 3) m in the camera's optical frame, or (N, 2) px in 2-D.
        clearance
            m by which something in front of a position is nearer at least. In 2-D it is not used.

        Returns
        -------
        (N,) bool, False outside the image.
        """
        inside, u, v = self._pixels_of(points)
        beside = np.zeros(len(points), dtype=bool)
        if not inside.any():
            return beside
        shown = ~self.mask[v, u]
        if self.depth is not None:
            left, top = max(u.min() - FRONT_PIXELS, 0), max(v.min() - FRONT_PIXELS, 0)
            part = np.s_[top : v.max() + FRONT_PIXELS + 1, left : u.max() + FRONT_PIXELS + 1]
            others = np.where(self.mask[part] | (self.depth[part] <= 0), np.inf, self.depth[part]).astype(np.float32)
            nearest = cv2.erode(others, np.ones((2 * FRONT_PIXELS + 1, 2 * FRONT_PIXELS + 1), np.uint8))
            shown &= nearest[v - top, u - left] >= points[inside, 2] - clearance
        if self.support is not None and shown.any():
            shown[shown] = ~self.support.has_object_color(np.column_stack((u, v))[shown])
        beside[inside] = shown
        return beside


@dataclass(frozen=True)
class MultiViewDepthModel:
    """What several cameras saw of an object, for a cloud that was fused from their views.

    Attributes
    ----------
    each
        for each view, the model in its own camera frame, and the pose (4, 4), camera to cloud: p_cloud = pose @ p_camera, m.
    """

    each: tuple[tuple[DepthModel, Floats], ...] = ()

    @staticmethod
    def of_views(views: Sequence[CameraView], margin: float, own_object_counts_as_free: bool) -> MultiViewDepthModel:
        """Return the model of all views of a fused cloud, for positions in the frame of the cloud.

        Parameters
        ----------
        views
            the camera, pose, mask and depth of each view.
        margin
            m. A reading must lie at least this far behind a position to show that the position is free, or in front to hide it.
        own_object_counts_as_free
            True if a reading of the object itself behind a position also shows that the position is free.
        """
        models = (DepthModel(view.depth, view.mask, view.camera, margin, own_object_counts_as_free) for view in views)
        return MultiViewDepthModel(tuple(zip(models, (view.pose for view in views), strict=True)))

    def classify(self, points: Floats) -> Ints:
        """Return the PointVisibility of each position, from all views together.

        A position is FREE if more views saw through it than saw the object there. Otherwise it is the first of SURFACE, MASKED,
        HIDDEN and NO_DEPTH that it is in any view; OUTSIDE if it is in no view's image.

        Parameters
        ----------
        points
            (N, 3) m in the frame of the cloud.

        Returns
        -------
        (N,) int64, values of PointVisibility.
        """
        classes = self._in_each_view(points)
        result = np.full(len(points), int(PointVisibility.OUTSIDE), dtype=np.int64)
        for kind in (PointVisibility.NO_DEPTH, PointVisibility.HIDDEN, PointVisibility.MASKED, PointVisibility.SURFACE):
            result[(classes == kind).any(axis=0)] = int(kind)
        free, object_seen = _votes(classes)
        result[free > object_seen] = int(PointVisibility.FREE)
        return result

    def is_outside(self, points: Floats) -> Bools:
        """Tell which positions (N, 3) m in the frame of the cloud are outside the images of all views: (N,) bool."""
        return np.asarray((self._in_each_view(points) == int(PointVisibility.OUTSIDE)).all(axis=0))

    def pixel_at(self, point: Floats) -> float:
        """Return the width that a pixel shows at the depth of a position, in the view where it is the smallest, m."""
        return min(one.pixel_at((point - pose[:3, 3]) @ pose[:3, :3]) for one, pose in self.each)

    def is_beside(self, points: Floats, clearance: float) -> Bools:
        """Tell at which positions more views look past the object than see it: (N, 3) m in the cloud's frame -> (N,) bool."""
        return np.asarray(self.classify(points) == PointVisibility.FREE)

    def contradicted_by_views(self, points: Floats) -> Bools:
        """Tell which points are probably empty space, although they are in the cloud.

        A point is probably empty if at least one view saw through it, and at least as many views saw through it as saw the
        object there.

        Parameters
        ----------
        points
            (N, 3) m in the frame of the cloud.

        Returns
        -------
        (N,) bool, True for a point that is probably empty space.
        """
        free, object_seen = _votes(self._in_each_view(points))
        return np.asarray((free > 0) & (free >= object_seen))

    def _in_each_view(self, points: Floats) -> Ints:
        """Return the PointVisibility (E, N) in each of E views."""
        return np.array([one.classify((points - pose[:3, 3]) @ pose[:3, :3]) for one, pose in self.each])


def _votes(classes: Ints) -> tuple[Ints, Ints]:
    """Return how many of the classes (E, N) are FREE and how many are the object: (N,) and (N,)."""
    of_object = (classes == PointVisibility.SURFACE) | (classes == PointVisibility.MASKED)
    return (classes == PointVisibility.FREE).sum(axis=0), of_object.sum(axis=0)

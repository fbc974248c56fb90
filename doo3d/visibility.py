"""What the camera says about a place: seen there, hidden, seen through, or no reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from .config import VisibilityConfig
from .geometry.polyline import steps
from .types import Array, Bools, Camera, CameraView, Floats, Foreground, Ints

STEP, HIDES = 0.25, 0.6  # radii


MARGIN_RADII = 1.2
"""Radii; least distance behind a place of depth that shows free space: what lies on a table hides it, and is two radii thick."""


class PointVisibility(IntEnum):
    """What the depth image says about a point."""

    OUTSIDE = 0
    """Not in the image."""
    NO_DEPTH = 1
    """No reading at that pixel."""
    MASKED = 2
    """No reading, but the pixel belongs to the object: colour saw it."""
    SURFACE = 3
    """The reading is the object, about where the point is."""
    HIDDEN = 4
    """The reading is nearer: something is in front."""
    FREE = 5
    """The reading is farther and not the object (or `through` is set): the camera saw through the place."""


@dataclass(frozen=True)
class Visibility:
    """A depth image, (H, W) m with 0 = none, the object's mask (H, W) bool, and the camera that took them.

    In 2-D there are only the mask and points in pixels, and what is outside the mask counts as seen through.
    """

    depth: Array | None
    mask: Bools
    camera: Camera | None
    margin: float
    through: bool = False

    @staticmethod
    def of(foreground: Foreground, config: VisibilityConfig, radius: float) -> Visibility | None:
        """What the frame of a foreground says, for an object of this radius, m; None for clouds, which have no camera."""
        margin = max(config.margin, MARGIN_RADII * radius)
        if foreground.views:
            return MultiViewVisibility.together(foreground.views, margin, config.own_object_counts_as_free)
        if foreground.mask is None:
            return None
        return Visibility(foreground.depth, foreground.mask, foreground.camera, margin, config.own_object_counts_as_free)

    def classify(self, points: Floats) -> Ints:
        """What is said about points (N, 3) m in the camera frame, (N, 2) px in 2-D: (N,) of `PointVisibility`."""
        pixels = self.camera.project(points) if self.camera is not None else points
        height, width = self.mask.shape
        inside = np.asarray(np.isfinite(pixels).all(axis=1))
        inside[inside] = ((pixels[inside] > -0.5) & (pixels[inside] < (width - 0.5, height - 0.5))).all(axis=1)
        result = np.full(len(points), int(PointVisibility.OUTSIDE), dtype=np.int64)
        u, v = np.rint(pixels[inside]).astype(np.int64).T
        if self.depth is None:
            result[inside] = np.where(self.mask[v, u], int(PointVisibility.SURFACE), int(PointVisibility.FREE))
            return result
        measured, masked, z = self.depth[v, u], self.mask[v, u], points[inside, 2]
        said = np.where(masked, int(PointVisibility.SURFACE), int(PointVisibility.HIDDEN))
        said[measured < z - self.margin] = int(PointVisibility.HIDDEN)
        said[(measured > z + self.margin) & (self.through | ~masked)] = int(PointVisibility.FREE)
        said[measured <= 0] = np.where(masked, int(PointVisibility.MASKED), int(PointVisibility.NO_DEPTH))[measured <= 0]
        result[inside] = said
        return result

    def exits_view(self, ends: Floats, directions: Floats, reach: float) -> Bools:
        """Which of the ends (E, D), going on by `reach` in their directions (E, D), leave the view: (E,) bool."""
        return np.asarray(self.classify(ends + reach * directions) == PointVisibility.OUTSIDE)

    def is_exposed(self, ends: Floats, directions: Floats, radius: float, reach: float) -> Bools:
        """Beyond which of the ends (E, D), within `reach` m in their directions (E, D), the camera sees through before
        anything hides what would go on there: (E,) bool. In 2-D nothing is known to hide, and no end is exposed.

        radius : m; what hides is at least HIDES of it nearer. A strand on another one is nearer by two, at its border by one.
        """
        if self.depth is None or self.camera is None:
            return np.zeros(len(ends), dtype=bool)
        ways = ends[:, None] + np.arange(STEP * radius, reach * (1 + 1e-9), STEP * radius)[:, None] * directions[:, None]
        points = ways.reshape(-1, ends.shape[1])
        free = replace(self, through=True).classify(points) == PointVisibility.FREE
        hidden = replace(self, margin=HIDES * radius).classify(points) == PointVisibility.HIDDEN
        free, hidden = free.reshape(ways.shape[:2]), hidden.reshape(ways.shape[:2])
        first = np.where(free.any(axis=1), free.argmax(axis=1), ways.shape[1])
        return np.asarray(first < np.where(hidden.any(axis=1), hidden.argmax(axis=1), ways.shape[1]))

    def masked(self, points: Floats) -> Bools:
        """Which of the points (N, 3) have no depth, but belong to the object by the mask: (N,) bool."""
        return np.asarray(self.classify(points) == PointVisibility.MASKED)

    def lengths(self, paths: Sequence[Floats]) -> Floats:
        """How much of each path (P, D), m (px in 2-D), runs where the camera saw through or out of its view, and how much where
        it has no reading: (K, 2).

        What leaves the view may come back, but where is anyone's guess.
        """
        points, after = np.concatenate(paths), np.cumsum([len(path) for path in paths])
        said = self.classify((points[1:] + points[:-1]) / 2)
        step = steps(points)
        step[after[:-1] - 1] = 0
        told = np.zeros((len(points), 2))
        told[:-1, 0] = np.where((said == PointVisibility.FREE) | (said == PointVisibility.OUTSIDE), step, 0)
        told[:-1, 1] = np.where(said == PointVisibility.NO_DEPTH, step, 0)
        return np.asarray(np.add.reduceat(told, np.append(0, after[:-1])))


@dataclass(frozen=True)
class MultiViewVisibility(Visibility):
    """What many cameras say about a cloud that was made of their views: each with its pose (4, 4)."""

    each: tuple[tuple[Visibility, Floats], ...] = ()

    @staticmethod
    def together(views: Sequence[CameraView], margin: float, through: bool) -> MultiViewVisibility:
        """Of all views."""
        each = tuple((Visibility(view.depth, view.mask, view.camera, margin, through), view.pose) for view in views)
        return MultiViewVisibility(None, np.zeros((0, 0), dtype=bool), None, margin, through, each)

    def classify(self, points: Floats) -> Ints:
        """What they say together about points (N, 3) m in the frame of the cloud: (N,) of `PointVisibility`.

        FREE where more of them saw through a place than saw the object there; else the most telling of what else is said.
        """
        said = self._said(points)
        result = np.full(len(points), int(PointVisibility.OUTSIDE), dtype=np.int64)
        for seen in (PointVisibility.NO_DEPTH, PointVisibility.HIDDEN, PointVisibility.MASKED, PointVisibility.SURFACE):
            result[(said == seen).any(axis=0)] = int(seen)
        free, taken = _votes(said)
        result[free > taken] = int(PointVisibility.FREE)
        return result

    def denied(self, points: Floats) -> Bools:
        """Which of the points (N, 3) m as many of them saw through as saw the object there, at least: (N,) bool."""
        free, taken = _votes(self._said(points))
        return np.asarray((free > 0) & (free >= taken))

    def _said(self, points: Floats) -> Ints:
        return np.array([one.classify((points - pose[:3, 3]) @ pose[:3, :3]) for one, pose in self.each])


def _votes(said: Ints) -> tuple[Ints, Ints]:
    """How many of what each says (E, N) are FREE, and how many the object: (N,) and (N,)."""
    return (said == PointVisibility.FREE).sum(axis=0), ((said == PointVisibility.SURFACE) | (said == PointVisibility.MASKED)).sum(
        axis=0
    )

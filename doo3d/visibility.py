"""Visibility: what the camera says about a position in space: seen there, hidden, free space, no depth, out of view."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import cv2
import numpy as np

from .bare_surface import BareSurface
from .config import VisibilityConfig
from .geometry.polyline import steps, unit
from .geometry.radii import STEP_RADII
from .kernels import classify_positions
from .types import Array, Bools, Camera, CameraView, Floats, Foreground, Ints

TIP_LOOKAHEAD_RADII = np.array([3.0, 4.0, 5.0])
"""Radii ahead of an end at which a tip is told: a chain may stop two radii before the tip, where thinning ends."""

TIP_FAN = np.radians((-25.0, 0.0, 25.0))
"""Directions in the image, from straight on, in which the mask ends at a tip: the tangent of an end is that uncertain."""

OCCLUDER_MARGIN_RADII = 0.6
"""Radii by which an occluder is nearer at least. A strand on top of another one is nearer by two, at its border by one."""

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


CLASSES = np.arange(PointVisibility.BARE, dtype=np.int64)
"""The classes that depth and mask tell, in order."""

OPEN = (PointVisibility.OUTSIDE, PointVisibility.FREE, PointVisibility.BARE)
"""Classes of positions where the camera would have seen an object, or that are outside its view."""


@dataclass(frozen=True)
class Visibility:
    """What one camera saw, to ask of any position in space whether it is seen, hidden or free.

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
    bare
        what the surface beside the object looks like; None tells no position BARE.
    """

    depth: Array | None
    mask: Bools
    camera: Camera | None
    margin: float
    own_object_counts_as_free: bool = False
    bare: BareSurface | None = None

    @staticmethod
    def of(foreground: Foreground, config: VisibilityConfig, radius: float) -> Visibility | None:
        """Return the visibility in the frame that a foreground was segmented from; None for a cloud without camera views.

        For a cloud fused from camera views it is a MultiViewVisibility.

        Parameters
        ----------
        foreground
            the object's points, with the mask and depth of the frame or the camera views of a fused cloud.
        config
            section `visibility` of the settings; `margin` is raised to MARGIN_RADII (1.2) radii.
        radius
            radius of the object, m (px in 2-D).
        """
        margin = max(config.margin, MARGIN_RADII * radius)
        if foreground.views:
            return MultiViewVisibility.of_views(foreground.views, margin, config.own_object_counts_as_free)
        if foreground.mask is None:
            return None
        return Visibility(foreground.depth, foreground.mask, foreground.camera, margin, config.own_object_counts_as_free)

    def classify(self, points: Floats) -> Ints:
        """Return the PointVisibility of each position: OUTSIDE, NO_DEPTH, MASKED, SURFACE, HIDDEN or FREE.

        Parameters
        ----------
        points
            (N, 3) m in the camera's optical frame, or (N, 2) px in 2-D.

        Returns
        -------
        (N,) int64, values of PointVisibility. Positions behind the camera or with NaN are OUTSIDE. In 2-D a position in the
        image is SURFACE in the mask, and FREE elsewhere.
        """
        if self.depth is None or self.camera is None:
            inside, u, v = self._pixels_of(points)
            result = np.full(len(points), int(PointVisibility.OUTSIDE), dtype=np.int64)
            result[inside] = np.where(self.mask[v, u], int(PointVisibility.SURFACE), int(PointVisibility.FREE))
            return result
        camera = np.array((self.camera.fx, self.camera.fy, self.camera.cx, self.camera.cy))
        depth, mask = np.ascontiguousarray(self.depth, dtype=np.float32), np.ascontiguousarray(self.mask)
        classes, behind, pixels, readings = classify_positions(
            points, camera, depth, mask, self.margin, self.own_object_counts_as_free, CLASSES
        )
        if self.bare is not None and len(behind):
            classes[behind[self.bare.is_bare(points[behind], pixels, readings)]] = int(PointVisibility.BARE)
        return classes

    def pixel_at(self, point: Floats) -> float:
        """Return the width that a pixel shows at the depth of a position, m; 1 px in 2-D."""
        return 1.0 if self.camera is None else float(point[2]) / self.camera.fx

    def _pixels_of(self, points: Floats) -> tuple[Bools, Ints, Ints]:
        """Return which of the positions (N, D) project into the image, (N,) bool, and the column and row of the pixel of each."""
        pixels = self.camera.project(points) if self.camera is not None else points
        height, width = self.mask.shape
        inside = np.asarray(np.isfinite(pixels).all(axis=1))
        inside[inside] = ((pixels[inside] > -0.5) & (pixels[inside] < (width - 0.5, height - 0.5))).all(axis=1)
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
        if self.bare is not None and shown.any():
            shown[shown] = ~self.bare.has_object_color(np.column_stack((u, v))[shown])
        beside[inside] = shown
        return beside

    def with_bare_surface(self, chains: Sequence[Floats], radius: float, foreground: Foreground) -> Visibility:
        """Return a copy that tells bare surface from holes in the mask, as measured beside chains.

        Parameters
        ----------
        chains
            joints of each chain, (N, D) m in the camera's optical frame (px in 2-D).
        radius
            radius of the object, m (px in 2-D).
        foreground
            the foreground that this visibility was made of.

        Returns
        -------
        The copy; itself in 2-D and for a fused cloud.
        """
        bare = BareSurface.beside(chains, radius, foreground)
        return self if bare is None else replace(self, bare=bare)

    def exits_view(self, ends: Floats, directions: Floats, reach: float) -> Bools:
        """Tell which chain ends would be outside the image if they went straight on by `reach`.

        Parameters
        ----------
        ends
            (E, D) m (px in 2-D), positions of E ends.
        directions
            (E, D) unit vectors, pointing out of the chains.
        reach
            m (px in 2-D), length by which the ends are extrapolated.

        Returns
        -------
        (E,) bool
        """
        return np.asarray(self.classify(ends + reach * directions) == PointVisibility.OUTSIDE)

    def is_exposed(self, ends: Floats, directions: Floats, radius: float, reach: float) -> Bools:
        """Tell which chain ends are in plain view, so that nothing can hide a continuation.

        An end is exposed if, on its straight continuation, a position in free space comes before any position that an occluder
        hides.

        Parameters
        ----------
        ends
            (E, D) m in the camera's optical frame, positions of E ends.
        directions
            (E, D) unit vectors, pointing out of the chains.
        radius
            radius of the object, m. An occluder is at least OCCLUDER_MARGIN_RADII (0.6) radii nearer to the camera than the
            position.
        reach
            m, how far ahead of the end to look.

        Returns
        -------
        (E,) bool; all False in 2-D and for a fused cloud, which have no single depth image.
        """
        if self.depth is None or self.camera is None:
            return np.zeros(len(ends), dtype=bool)
        step = STEP_RADII / 2 * radius
        ahead = ends[:, None] + np.arange(step, reach * (1 + 1e-9), step)[:, None] * directions[:, None]
        points = ahead.reshape(-1, ends.shape[1])
        free = replace(self, own_object_counts_as_free=True).classify(points) == PointVisibility.FREE
        hidden = replace(self, margin=OCCLUDER_MARGIN_RADII * radius).classify(points) == PointVisibility.HIDDEN
        free, hidden = free.reshape(ahead.shape[:2]), hidden.reshape(ahead.shape[:2])
        first_free = np.where(free.any(axis=1), free.argmax(axis=1), ahead.shape[1])
        return np.asarray(first_free < np.where(hidden.any(axis=1), hidden.argmax(axis=1), ahead.shape[1]))

    def are_tips(self, ends: Floats, directions: Floats, radius: float) -> Bools:
        """Tell which chain ends are tips in plain view: the mask does not go on ahead, and the space ahead is open.

        Where the mask goes on, the object does too, and only its depth is lost.

        Parameters
        ----------
        ends
            (E, 3) m in the camera's optical frame, positions of E ends.
        directions
            (E, 3) unit vectors, pointing out of the chains.
        radius
            radius of the object, m.

        Returns
        -------
        (E,) bool; all False in 2-D and for clouds.
        """
        if self.depth is None or self.camera is None:
            return np.zeros(len(ends), dtype=bool)
        ahead = ends[:, None] + radius * TIP_LOOKAHEAD_RADII[:, None] * directions[:, None]
        is_open = np.isin(self.classify(ahead.reshape(-1, 3)), OPEN).reshape(ahead.shape[:2]).mean(axis=1) >= 0.5
        at = self.camera.project(ends)
        forward = unit(self.camera.project(ends + radius * directions) - at)
        turned = np.cos(TIP_FAN)[:, None, None] * forward + np.sin(TIP_FAN)[:, None, None] * forward[:, ::-1] * (-1, 1)
        reach = (self.camera.fx * radius / ends[:, 2])[:, None, None] * TIP_LOOKAHEAD_RADII[:, None]
        height, width = self.mask.shape
        u, v = np.rint(at[:, None] + reach * turned[:, :, None]).astype(np.int64).clip(0, (width - 1, height - 1)).T
        return np.asarray(is_open & ~self.mask[v, u].any(axis=(0, 2)))

    def is_masked_without_depth(self, points: Floats) -> Bools:
        """Tell which points project to a pixel of the object's mask that has no depth reading.

        points : (N, 3) m in the camera's optical frame (of a fused cloud: in its frame). Returns (N,) bool; all False in 2-D.
        """
        return np.asarray(self.classify(points) == PointVisibility.MASKED)

    def gap_lengths(self, paths: Sequence[Floats]) -> Floats:
        """Return how much of each polyline runs through free space, through places without a reading, and over bare surface.

        A stretch outside the image counts as free: the path could turn back from there anywhere. A step counts by its midpoint.

        Parameters
        ----------
        paths
            K >= 1 polylines, each (P, D) of P points, m (px in 2-D).

        Returns
        -------
        (K, 3) m (px in 2-D): the length in free space or outside the image, without a reading, and over bare surface.
        """
        points, after = np.concatenate(paths), np.cumsum([len(path) for path in paths])
        classes = self.classify((points[1:] + points[:-1]) / 2)
        step = steps(points)
        step[after[:-1] - 1] = 0
        lengths = np.zeros((len(points), 3))
        lengths[:-1, 0] = np.where((classes == PointVisibility.FREE) | (classes == PointVisibility.OUTSIDE), step, 0)
        lengths[:-1, 1] = np.where(classes == PointVisibility.NO_DEPTH, step, 0)
        lengths[:-1, 2] = np.where(classes == PointVisibility.BARE, step, 0)
        return np.asarray(np.add.reduceat(lengths, np.append(0, after[:-1])))


@dataclass(frozen=True)
class MultiViewVisibility(Visibility):
    """What several cameras saw of an object, for a cloud that was fused from their views.

    Attributes
    ----------
    each
        for each view, the visibility in its own camera frame, and the pose (4, 4), camera to cloud: p_cloud = pose @ p_camera, m.
    """

    each: tuple[tuple[Visibility, Floats], ...] = ()

    @staticmethod
    def of_views(views: Sequence[CameraView], margin: float, own_object_counts_as_free: bool) -> MultiViewVisibility:
        """Return the joint visibility in all views of a fused cloud, for positions in the frame of the cloud.

        Parameters
        ----------
        views
            the camera, pose, mask and depth of each view.
        margin
            m. A reading must lie at least this far behind a position to show that the position is free, or in front to hide it.
        own_object_counts_as_free
            True if a reading of the object itself behind a position also shows that the position is free.
        """
        each = tuple(
            (Visibility(view.depth, view.mask, view.camera, margin, own_object_counts_as_free), view.pose) for view in views
        )
        return MultiViewVisibility(None, np.zeros((0, 0), dtype=bool), None, margin, own_object_counts_as_free, each=each)

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

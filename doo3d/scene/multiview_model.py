"""What several cameras together say of positions in space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..types import Bools, CameraView, Floats, Ints
from .depth_model import DepthModel
from .frame_facts import FrameFacts
from .point_visibility import PointVisibility


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
        models = (DepthModel(FrameFacts(view.mask, view.depth), view.camera, margin, own_object_counts_as_free) for view in views)
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

    def pixel_at(self, point: Floats) -> float:
        """Return the width that a pixel shows at the depth of a position, in the view where it is the smallest, m."""
        return min(float(((point - pose[:3, 3]) @ pose[:3, :3])[2]) / one.camera.fx for one, pose in self.each)

    def contradicted_by_views(self, points: Floats) -> Bools:
        """Return which points are probably empty space, although they are in the cloud.

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

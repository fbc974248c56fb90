"""A cloud that was fused from camera views, which together say which space is empty."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import cached_property

from ..types import CameraView, Floats, Ints
from . import axis_in_cloud
from .axis_in_views import axis_in_views
from .cloud import CloudScene
from .frame import MARGIN_RADII
from .multiview_model import MultiViewDepthModel
from .samples import Samples


@dataclass(frozen=True, eq=False, kw_only=True)
class FusedScene(CloudScene):
    """The points of a fused cloud, m, in the frame of the cloud.

    Attributes
    ----------
    views
        the camera, pose, mask and depth of each view.
    """

    views: tuple[CameraView, ...]

    @staticmethod
    def of(cloud: CloudScene, views: tuple[CameraView, ...]) -> FusedScene:
        """Return a cloud with the views that it was fused from."""
        return FusedScene(**{each.name: getattr(cloud, each.name) for each in fields(cloud)}, views=views)

    @property
    def max_turn(self) -> float:
        """The angle in radians by which an object may turn across a gap: half a turn, since the views show where it is hidden."""
        return math.pi

    @property
    def shows_surface(self) -> bool:
        """False: the views say more than the points."""
        return False

    @property
    def sees_space(self) -> bool:
        """The views say which space is empty."""
        return True

    @cached_property
    def model(self) -> MultiViewDepthModel:
        """What all depth images together say of positions."""
        settings = self.config.visibility
        margin = max(settings.margin, MARGIN_RADII * self.radius)
        return MultiViewDepthModel.of_views(self.views, margin, settings.own_object_counts_as_free)

    def classify(self, points: Floats) -> Ints:
        """Return the `PointVisibility` of each of N positions (N, 3) m, (N,) int64, by a vote of the views."""
        return self.model.classify(points)

    def pixel_at(self, point: Floats) -> float:
        """Return the width that a pixel shows at the depth of a position (3,), in the view where it is the smallest, m."""
        return self.model.pixel_at(point)

    def measure_axis(self, samples: Samples, iterations: int) -> Samples:
        """Return samples on the axis: by the masks of all views together, and circles fitted to the cross-sections."""
        return axis_in_cloud.moved(samples, axis_in_views, iterations, self.points, self.sensor, self.views)

"""A cloud of points, of one sensor or of several scans, without an image: which space is empty is unknown."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..geometry.projection import Projection, axes_along
from ..geometry.radii import STEP_RADII
from ..kernels import CrossingStrands
from ..types import Camera, CloudSampling, Floats, Ints
from . import axis_in_cloud
from .cloud_facts import CloudFacts, strip_half_widths
from .frame import SIZE_OVER_SPACING
from .point_visibility import PointVisibility
from .samples import Samples
from .scene import Scene
from .touching_strands import NOT_TOUCHING, Parted, part_strands
from .upper_strand import cloud_log_odds

SPARSE_RADIUS_OVER_SPACING = 0.5
"""Least radius in spacings along the strands of a cloud of sparse points, which bridges join: it sets the scale of all stages."""

SPARSE_GAP_SPACING, SURFACE_GAP_SPACING = 0.001, 0.004
"""m; spacing of points along strands, and on surfaces, for which the settings of gaps in the section `merge` hold."""

SPARSE_MAX_TURN, CLOUD_MAX_TURN, BRANCHED_MAX_TURN = math.pi / 2, 0.9 * math.pi, 0.9
"""Radians; turn across a gap at most: between sparse points, and strands that touch side by side, whose ends lie beside each
other; in any other cloud; and in one of branched objects. A cable turns less, two branches of a trunk that was not measured turn
more."""

FROM_ABOVE = np.diag((1.0, 1.0, -1.0))
"""Axes of the view of a cloud without a viewpoint: x right, y down in the view, along -z."""

UNIT_CAMERA = Camera(1.0, 1.0, 0.0, 0.0, 1, 1)
"""Intrinsics of the view of a cloud with a viewpoint: positions are tangents of angles."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CloudScene(Scene):
    """The points of a cloud, m.

    Attributes
    ----------
    filtered
        (N, 3) m, the points with the noise averaged away; the points themselves where nothing was averaged.
    bridges
        (K, 3) m, points between neighbors along the strands of a cloud of sparse points; (0, 3) elsewhere.
    sampling
        how the points lie on the strands; a spacing of 0 where it was not measured.
    facts
        what follows from the points; that of no points where they are sparse.
    sensor
        (3,) m, position of the sensor in the frame of the points; None if unknown.
    """

    filtered: Floats
    bridges: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    sampling: CloudSampling = field(default_factory=lambda: CloudSampling(0.0))
    facts: CloudFacts = field(default_factory=lambda: CloudFacts(np.zeros((0, 3))), repr=False)
    sensor: Floats | None = None

    @property
    def viewpoint(self) -> Floats | None:
        """The position of the sensor in the frame of the points, (3,) m; None if it is unknown."""
        return self.sensor

    @property
    def lacks_viewpoint(self) -> bool:
        """Whether the position of the sensor is unknown, and the points show surfaces, which may reveal it."""
        return self.sensor is None and not self.is_sparse

    def seen_from(self, sensor: Floats) -> CloudScene:
        """Return the scene with a position of the sensor, (3,) m."""
        return self.changed(sensor=sensor)

    @property
    def is_sparse(self) -> bool:
        """Whether the points lie one behind the other along the strands, and show no surface."""
        return self.sampling.is_sparse

    @property
    def spacing(self) -> float:
        """The distance between neighboring points, m: along the strand where points are sparse, on the surface otherwise."""
        return self.sampling.spacing

    @cached_property
    def radius(self) -> float:
        """The radius of the object, m: as configured; by the width of strips of points; of sparse points by their scatter.

        Of strands that touch side by side it is that at which their normals meet.
        """
        if self.sampling.scatter is not None:
            least = max(self.sampling.scatter, SPARSE_RADIUS_OVER_SPACING * self.sampling.spacing)
            return self.config.voxelize.radius or least
        return self.parted.radius or self.config.voxelize.radius or max(float(np.median(self.widths)), self.facts.spacing)

    @cached_property
    def widths(self) -> Floats:
        """The half-widths of the cloud where it looks like a strip, m; the configured radius alone if there is one."""
        given = self.config.voxelize.radius
        return np.array([given]) if given else strip_half_widths(self.points, self.facts.spacing, self.facts.strands)

    @cached_property
    def parted(self) -> Parted:
        """The strands that touch side by side; none of branched objects, whose trunks are bundles."""
        if self.is_sparse or not self.shows_surface or self.config.merge.branches:
            return NOT_TOUCHING
        return part_strands(self.points, self.widths, self.spacing, np.zeros(3) if self.sensor is None else self.sensor)

    @cached_property
    def voxel(self) -> float:
        """The edge of a voxel, m."""
        by_radius = self.voxel_factor * STEP_RADII * self.radius
        least = 0.0 if self.is_sparse else SIZE_OVER_SPACING * self.facts.spacing
        return self.config.voxelize.size or max(by_radius, least)

    @property
    def point_gap(self) -> float:
        """The distance between neighboring surface points, m, up to which there is no gap between them."""
        return max(self.voxel, self.sampling.spacing) if self.is_sparse else self.voxel

    @property
    def gap_unit(self) -> float:
        """The factor by which gaps may be longer and cost less than the settings of merging say.

        Gaps in a cloud are counted in spacings of its points. The settings suit points 1 mm apart along strands; where points
        show surfaces, they suit all spacings up to 4 mm.
        """
        if self.sampling.scatter is not None:
            return max(self.sampling.spacing, 2 * self.sampling.scatter) / SPARSE_GAP_SPACING
        return max(1.0, self.sampling.spacing / SURFACE_GAP_SPACING)

    @property
    def max_turn(self) -> float:
        """The angle in radians by which an object may turn across a gap, unless the number of chains is given.

        It is less than half a turn: no camera shows whether a turn is hidden, and the ends of strands beside each other are no
        turn of one strand.
        """
        if self.is_sparse or self.parted.radius:
            return SPARSE_MAX_TURN
        return BRANCHED_MAX_TURN if self.config.merge.branches else CLOUD_MAX_TURN

    @property
    def shows_surface(self) -> bool:
        """Whether the points show surfaces."""
        return not self.is_sparse

    @property
    def sees_space(self) -> bool:
        """Nothing is known about empty space."""
        return False

    def classify(self, points: Floats) -> Ints:
        """Return NO_DEPTH for each of N positions (N, 3): nothing is known."""
        return np.full(len(points), int(PointVisibility.NO_DEPTH))

    @cached_property
    def view(self) -> Projection:
        """The view from the sensor towards the middle of the points, positions as tangents (x / z, y / z).

        Where the sensor's position is unknown it is that from above, against the z axis, positions in m.
        """
        if self.sensor is None:
            return Projection.parallel(np.zeros(3), FROM_ABOVE)
        # np.mean over the first axis takes five times as long
        middle = np.einsum("nd->d", self.points) / len(self.points)
        return Projection.perspective(self.sensor, axes_along(middle - self.sensor), UNIT_CAMERA)

    def ray_noise(self, depth: Floats) -> tuple[Floats, Floats]:
        """Return the spacing of the points, and 0 for the noise along rays, which is unknown: (N,) m each."""
        return self.sampling.spacing + 0.0 * depth, 0.0 * depth

    def measure_axis(self, samples: Samples, iterations: int) -> Samples:
        """Return samples on the axis: by half shells if the sensor's position is known, else by circles.

        Sparse points were moved to the axis before, and only the radius is measured.
        """
        how = axis_in_cloud.from_circles if self.sensor is None else axis_in_cloud.from_half_shells
        if self.is_sparse:
            return axis_in_cloud.moved(samples, axis_in_cloud.from_lines, iterations, self.points, self.sampling.spacing)
        return axis_in_cloud.moved(samples, how, iterations, self.points, self.sensor)

    def upper(self, strands: CrossingStrands, half_width: Floats) -> Floats:
        """Return the log-odds, (C,) nat, that the first of two strands is the upper one, by the points nearest to the sensor."""
        return cloud_log_odds(strands, half_width, self.points, self.view)

"""What every stage after voxelization gets of a frame."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

from ..geometry.projection import Projection
from ..types import Foreground, VoxelGrid
from .view import projection_of
from .visibility import Visibility

SPARSE_GAP_SPACING, SURFACE_GAP_SPACING = 0.001, 0.004
"""m; spacing of points along strands, and on surfaces, for which the settings of gaps in the section `merge` hold."""


SPARSE_MAX_TURN, CLOUD_MAX_TURN, BRANCHED_MAX_TURN = math.pi / 2, 0.9 * math.pi, 0.9
"""Radians; turn across a gap at most, between sparse points, in any other cloud, and in one of branched objects: a cable turns
less, two branches of a trunk that was not measured turn more."""


@dataclass(frozen=True)
class FrameContext:
    """The data of one frame that every stage after voxelization gets: points, voxels, visibility, segment length.

    Attributes
    ----------
    foreground
        the object's points, mask and camera. `foreground.viewpoint` is the position of the sensor, or None if unknown.
    grid
        the seen surface as voxels, each with the mean of its points; in 2-D the pixels of the mask.
    visibility
        tells whether a position is on the object, hidden behind something or in free space; None for a cloud without camera
        views.
    segment_length
        length of the segments of every chain, m (px in 2-D).
    branches
        whether objects may branch, so that their strands differ in width, and short ones are no clutter.
    clearance
        factor of the distance from other branches up to which paths are cut back at junctions.
    """

    foreground: Foreground
    grid: VoxelGrid
    visibility: Visibility | None
    segment_length: float
    branches: bool = False
    clearance: float = 1.0

    @property
    def ranks_by_confidence(self) -> bool:
        """Whether a wanted number of chains is chosen by confidence, not by length: the object is not given, and not branched."""
        return not self.foreground.is_told and not self.branches

    @cached_property
    def view(self) -> Projection:
        """Return the view in which crossings and the shape of chains are judged."""
        return projection_of(self.foreground)

    @property
    def radius(self) -> float:
        """The first estimate of the object's radius, m (px in 2-D): as configured, or measured from its seen width."""
        return self.grid.radius

    @property
    def voxel(self) -> float:
        """The edge of a voxel, m (1 px in 2-D)."""
        return self.grid.size

    @property
    def point_gap(self) -> float:
        """The distance between neighboring surface points, m (px in 2-D), up to which there is no gap between them."""
        sampling = self.foreground.sampling
        return max(self.voxel, sampling.spacing) if sampling is not None and sampling.is_sparse else self.voxel

    @property
    def gap_unit(self) -> float:
        """The factor by which gaps may be longer and cost less than the settings of merging say; 1 except for some clouds.

        Gaps in a cloud are counted in spacings of its points. The settings suit points 1 mm apart along strands; where points
        show surfaces, they suit all spacings up to 4 mm.
        """
        sampling = self.foreground.sampling
        if sampling is None:
            return 1.0
        if sampling.scatter is not None:
            return max(sampling.spacing, 2 * sampling.scatter) / SPARSE_GAP_SPACING
        return max(1.0, sampling.spacing / SURFACE_GAP_SPACING)

    @property
    def max_turn(self) -> float:
        """The angle in radians by which an object may turn across a gap, unless the number of chains is set.

        Half a turn, but less in a cloud: no camera tells there whether a turn is hidden, and the ends of strands beside each
        other are no turn of one strand.
        """
        sampling = self.foreground.sampling
        if sampling is None or self.visibility is not None:
            return math.pi
        if sampling.is_sparse:
            return SPARSE_MAX_TURN
        return BRANCHED_MAX_TURN if self.branches else CLOUD_MAX_TURN

    @property
    def shows_surface(self) -> bool:
        """Whether the data are a cloud of points on surfaces, without camera views."""
        sampling = self.foreground.sampling
        return sampling is not None and not sampling.is_sparse and self.visibility is None

    def seen_from(self, foreground: Foreground) -> FrameContext:
        """Return a copy of the context with `foreground` in place of the present one."""
        return replace(self, foreground=foreground)

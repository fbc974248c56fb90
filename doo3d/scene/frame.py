"""A frame of a depth camera: a mask, and the depth of the whole image."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from typing_extensions import Self

from ..geometry.curves import Curves
from ..geometry.limits import MAX_BRANCHES
from ..geometry.projection import Projection
from ..geometry.radii import STEP_RADII
from ..kernels import CrossingStrands, strand_sides
from ..types import Array, Bools, Camera, Floats, Ints
from .answers import NO_LINES, ColorSides, MaskLines
from .axis_in_mask import axis_in_mask_and_depth
from .depth_model import DepthModel
from .depth_support import DepthSupport, depth_support
from .ends_in_view import are_exposed, tip_log_odds
from .frame_facts import FrameFacts
from .masked import NO_COLOR, MaskedScene
from .samples import Samples
from .scene import Scene
from .strand_sides import SIDES
from .surface_beside import Support
from .upper_strand import color_log_odds, depth_log_odds

VIEW_EDGE, SIZE_OVER_SPACING = 0.8, 1.6
"""Edge of a voxel of a frame over that of a cloud: the image shows exactly where a strand is. Least edge in point spacings: finer
grids of evenly spread points have holes that closing cannot mend."""

MARGIN_RADII = 1.2
"""Radii; least distance behind a position of depth that shows free space: an object on a table is two radii thick."""

BRANCHES_NOTE = (
    "merge: the mask's skeleton has {} branches, so gaps between chains are not looked for along them; that is done up to {}"
)


@dataclass(frozen=True, eq=False, kw_only=True)
class FrameScene(MaskedScene):
    """A frame of a depth camera, in the camera's optical frame, m.

    Attributes
    ----------
    filtered
        (N, 3) m, the points with the depth noise averaged away, at the price of detail.
    camera
        the intrinsics.
    support
        the surface beside the object; None until chains are there beside which it is measured.
    """

    filtered: Floats
    camera: Camera
    support: Support | None = field(default=None, repr=False)

    @property
    def depth(self) -> Array:
        """The depth of the whole frame, (H, W) float32 m, 0 = no reading."""
        return self.facts.depth

    @property
    def viewpoint(self) -> Floats:
        """The position of the sensor: the origin."""
        return np.zeros(3)

    def of_layer(self, facts: FrameFacts) -> Self:
        """Return the frame with the pixels of one layer alone; facts : the mask of the layer."""
        own = facts.mask[self.pixels[:, 1], self.pixels[:, 0]]
        return self.changed(facts=facts, pixels=self.pixels[own], points=self.points[own], filtered=self.filtered[own], layers=())

    @cached_property
    def spacing(self) -> float:
        """The side of a pixel at the median depth of the object, m."""
        return float(np.median(self.points[:, 2])) / self.camera.fx

    @cached_property
    def radius(self) -> float:
        """The radius of the object, m: as configured, or the median half-width of the mask, each pixel at its own depth."""
        return self.config.voxelize.radius or max(self.facts.radius(self.camera.fx), self.spacing)

    @cached_property
    def voxel(self) -> float:
        """The edge of a voxel at the median depth, m."""
        by_radius = VIEW_EDGE * self.voxel_factor * STEP_RADII * self.radius
        return self.config.voxelize.size or max(by_radius, VIEW_EDGE * SIZE_OVER_SPACING * self.spacing)

    def is_wide(self, radius: float) -> bool:
        """Return whether an object is wider than `segment.max_width`, where nobody said what the object is; radius : m."""
        return not self.object_given and 2 * radius > self.config.segment.max_width

    @property
    def may_be_reinterpreted(self) -> bool:
        """Whether the object is given: for such frames the evidence was weighed for choosing between interpretations."""
        return self.object_given

    @cached_property
    def model(self) -> DepthModel:
        """What the depth image says of positions."""
        settings = self.config.visibility
        margin = max(settings.margin, MARGIN_RADII * self.radius)
        return DepthModel(self.facts, self.camera, margin, settings.own_object_counts_as_free, self.support)

    def classify(self, points: Floats) -> Ints:
        """Return the `PointVisibility` of each of N positions (N, 3) m, (N,) int64."""
        return self.model.classify(points)

    def exits_view(self, ends: Floats, directions: Floats, reach: float) -> Bools:
        """Return which chain ends would be outside the image if they went straight on by `reach` m."""
        return self.model.is_outside(ends + reach * directions)

    def is_exposed(self, ends: Floats, directions: Floats, radius: float, reach: float) -> Bools:
        """Return which chain ends are in plain view, so that nothing can hide a continuation."""
        return are_exposed(self.model, ends, directions, radius, reach)

    def tips(self, ends: Floats, directions: Floats, radius: float) -> Floats:
        """Return the log-odds that ends are tips in plain view, (E,) nat."""
        return tip_log_odds(self.model, ends, directions, radius)

    def is_beside(self, points: Floats, clearance: float) -> Bools:
        """Return at which positions (N, 3) m the camera looks past the object, (N,)."""
        return self.model.is_beside(points, clearance)

    def pixel_at(self, point: Floats) -> float:
        """Return the width that a pixel shows at the depth of a position (3,), m."""
        return float(point[2]) / self.camera.fx

    def with_support(self, chains: Curves) -> Scene:
        """Return the scene with the surface beside chains measured: bare surface is distinguished from holes in the mask then."""
        if not len(chains):
            return self
        return self.changed(support=Support.beside(chains, self.radius, self.facts, self.camera, self.color, self.plane))

    def depth_support(self, chains: Curves, radius: Sequence[float]) -> DepthSupport:
        """Return how well the readings support the segments of chains; radius : of each, m."""
        return depth_support(chains, radius, self.depth, self.mask, self.camera, self.plane)

    def strand_lines(self, depth: float) -> tuple[MaskLines, tuple[str, ...]]:
        """Return the middle lines of the strands in the mask, for the object's radius at a depth in m, and notes.

        There are none where the object behind a place makes it free space: a pile fills the mask between any two ends.
        """
        if self.config.visibility.own_object_counts_as_free:
            return NO_LINES, ()
        branches = len(self.whole.skeleton[1]) - 1
        if branches > MAX_BRANCHES:
            return NO_LINES, (BRANCHES_NOTE.format(branches, MAX_BRANCHES),)
        radius = self.camera.fx * self.radius / depth
        return MaskLines(self.whole.strand_lines(radius), radius, self.camera.intrinsics), ()

    def strand_sides(self, view: Floats, across: Floats, reach: Floats, radius: float) -> ColorSides:
        """Return whether a strand rises from its sides; its color is not asked, since depth shows a strand of any color."""
        flat, _ = strand_sides(view, across, reach, radius, self.depth, NO_COLOR, self.mask, *SIDES)
        return ColorSides(flat)

    @cached_property
    def view(self) -> Projection:
        """The camera's pinhole projection, px."""
        return Projection.of_camera(self.camera)

    def in_image(self, points: Floats) -> Floats:
        """Return the pixels (N, 2) at which positions (N, 3) m are seen."""
        return self.camera.project(points)

    def ray_noise(self, depth: Floats) -> tuple[Floats, Floats]:
        """Return the pitch of pixels across rays, and the noise of readings along them, at depths (N,) m: (N,) m each."""
        return 1 / self.camera.fx * depth, self.facts.inverse_depth_noise * depth**2

    def measure_axis(self, samples: Samples, iterations: int) -> Samples:
        """Return samples on the axis: lateral offset and radius by the mask, the rest by depth."""
        return axis_in_mask_and_depth(samples, self.facts, self.points, self.camera, self.plane, iterations)

    def upper(self, strands: CrossingStrands, half_width: Floats) -> Floats:
        """Return the log-odds, (C,) nat, that the first of two strands is the upper one, by depth and by color."""
        by_depth = depth_log_odds(strands, self.depth, self.mask)
        return by_depth + color_log_odds(strands, self.color, self.config.crossings)

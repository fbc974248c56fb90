"""A photograph: the mask is all that is known of space."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from typing_extensions import Self

from ..geometry.projection import Projection
from ..kernels import CrossingStrands, strand_sides
from ..types import Array, Floats, Ints
from .answers import NO_LINES, ColorSides, MaskLines
from .axis_in_mask import axis_in_mask
from .frame_facts import NO_DEPTH, FrameFacts
from .masked import NO_NUMBERS, MaskedScene
from .point_visibility import PointVisibility
from .samples import Samples
from .strand_sides import SIDES, doubt_of
from .upper_strand import color_log_odds

MIN_MASK_RADIUS_PX = 0.5
"""px; least radius of a mask: a line of single pixels."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ImageScene(MaskedScene):
    """An image without depth: positions are pixels (u, v), the object is seen inside the mask, and all else counts as free.

    Attributes
    ----------
    probability
        (H, W) float32, the probability that a pixel belongs to a thin object, by the network; (0, 0) where none was asked.
    """

    probability: Array = field(default_factory=NO_NUMBERS.copy)

    @cached_property
    def radius(self) -> float:
        """The radius of the object, px: as configured, or the median half-width of the mask."""
        return self.config.voxelize.radius or max(self.facts.radius(), MIN_MASK_RADIUS_PX)

    def of_layer(self, facts: FrameFacts) -> Self:
        """Return the image with the pixels of one layer alone; facts : the mask of the layer."""
        return self.changed(facts=facts, pixels=facts.pixels, points=facts.pixels.astype(float), layers=())

    def strand_lines(self, depth: float) -> tuple[MaskLines, tuple[str, ...]]:
        if not self.layers:
            return NO_LINES, ()
        return MaskLines(self.whole.strand_lines(self.radius), self.radius, np.array((1.0, 1.0, 0.0, 0.0))), ()

    @property
    def spacing(self) -> float:
        """The distance between neighboring pixels: one."""
        return 1.0

    @property
    def voxel(self) -> float:
        """The edge of a voxel: one pixel."""
        return 1.0

    @property
    def view(self) -> Projection:
        """The view of an image is the image."""
        return Projection.planar()

    def classify(self, points: Floats) -> Ints:
        """Return for each position (N, 2) px whether it is OUTSIDE the image, on the object (SURFACE) or FREE, (N,) int64."""
        height, width = self.mask.shape
        inside = np.asarray(((points > -0.5) & (points < (width - 0.5, height - 0.5))).all(axis=1))
        u, v = np.rint(points[inside]).astype(np.int64).T
        classes = np.full(len(points), int(PointVisibility.OUTSIDE))
        classes[inside] = np.where(self.mask[v, u], PointVisibility.SURFACE, PointVisibility.FREE)
        return classes

    def strand_sides(self, view: Floats, across: Floats, reach: Floats, radius: float) -> ColorSides:
        """Return how a strand stands out from its sides in color, and what the network says of the pixels on its axis."""
        sides = strand_sides(view, across, reach, radius, NO_DEPTH, self.color, self.mask, *SIDES)
        return ColorSides(*sides, doubt_of(view, self.probability))

    def measure_axis(self, samples: Samples, iterations: int) -> Samples:
        """Return samples in the middle between the sides of the mask, with half its width as the radius."""
        return axis_in_mask(samples, self.facts, iterations)

    def upper(self, strands: CrossingStrands, half_width: Floats) -> Floats:
        """Return the log-odds, (C,) nat, that the first of two strands is the upper one, by their colors in the overlap."""
        return color_log_odds(strands, self.color, self.config.crossings)

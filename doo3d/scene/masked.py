"""What images with a mask have in common, with depth or without."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..geometry.curves import Curves
from ..types import Array, Bools, Floats, Ints
from .claims import unclaimed_shares
from .frame_facts import FrameFacts
from .scene import Scene

if TYPE_CHECKING:
    from typing_extensions import Self

NO_PIXELS: Bools = np.zeros((0, 0), dtype=bool)
NO_NUMBERS: Array = np.zeros((0, 0), dtype=np.uint8)
NO_COLOR: Array = np.zeros((0, 0, 3), dtype=np.uint8)


@dataclass(frozen=True, eq=False, kw_only=True)
class MaskedScene(Scene):
    """An image with the mask of the object.

    Attributes
    ----------
    facts
        what follows from the mask, and from the depth in it.
    pixels
        (N, 2) int, the pixel (u, v) = (column, row) of each point.
    color
        (H, W, 3) uint8 RGB, the color image; (0, 0, 3) where there is none.
    side_by_side
        (H, W) bool, the pixels of strands that touch or nearly touch side by side, and of the gaps between; (0, 0) without such
        strands.
    colors
        (H, W) uint8, the number of the color of the strand at each pixel, from 1, 0 for none; (0, 0) unless strands of different
        colors run side by side.
    is_clean
        whether the mask holds no noise of depth: it is given, of a photograph, of strands that their color tells, or judged by
        the network. False if it was looked for by shape alone.
    """

    facts: FrameFacts = field(repr=False)
    pixels: Ints
    color: Array = field(default_factory=NO_COLOR.copy)
    side_by_side: Bools = field(default_factory=NO_PIXELS.copy)
    colors: Array = field(default_factory=NO_NUMBERS.copy)
    layers: tuple[FrameFacts, ...] = field(default=(), repr=False)
    is_clean: bool = True

    @property
    def mask(self) -> Bools:
        """The pixels of the object, (H, W) bool, with a depth reading or without."""
        return self.facts.mask

    def point_colors(self) -> Array:
        """Return the color of each point, (N, 3) uint8 RGB; (0, 3) where there is no color image."""
        return self.color[self.pixels[:, 1], self.pixels[:, 0]] if self.color.size else super().point_colors()

    def in_mask(self, pixels: Floats) -> Bools:
        """Return which pixels (..., 2) are in the image and in the mask of all layers together: (...) bool."""
        mask = self.whole.mask
        inside = np.asarray(((pixels >= 0) & (pixels < mask.shape[::-1])).all(axis=-1))
        u, v = np.moveaxis(np.where(inside[..., None], pixels, 0).astype(int), -1, 0)
        return np.asarray(inside & mask[v, u])

    def unclaimed(self, view: Curves, reach: Floats) -> Floats:
        """Return for each of C curves the share of the pixels of the mask that are near no curve, (C,).

        In a mask that may hold noise of depth, the connected parts count that a curve runs through: others say nothing about it.

        view : samples of the curves, px. reach : (S,) px, the radius at each sample.
        """
        return unclaimed_shares(view, reach, self.facts, self.is_clean)

    def share_side_by_side(self, points: Floats) -> float:
        """Return the share of N positions (N, D) at which strands of the mask run side by side, 0 to 1."""
        if not self.side_by_side.size:
            return 0.0
        return float(self.side_by_side[self._nearest_pixels(points)].mean())

    @cached_property
    def whole(self) -> FrameFacts:
        """What follows from the whole mask, with the borders between strands of different colors."""
        return FrameFacts(self.colors > 0, self.facts.depth) if self.layers else self.facts

    @cached_property
    def each_layer(self) -> tuple[Self, ...]:
        """The scene once for each color of strand, with the pixels of that color alone; the scene itself where there is one."""
        return tuple(self.of_layer(facts) for facts in self.layers) or (self,)

    @abstractmethod
    def of_layer(self, facts: FrameFacts) -> Self:
        """Return the scene with the pixels of one layer alone; facts : the mask of the layer."""

    def layer_of(self, lines: Curves) -> Ints:
        """Return the layer that most points of each of C lines lie in, (C,), an index of `each_layer`; lines : m (px in 2-D)."""
        if not self.layers:
            return super().layer_of(lines)
        votes = np.zeros((len(lines), len(self.layers) + 1), dtype=np.int64)
        np.add.at(votes, (lines.owner, self.colors[self._nearest_pixels(lines.points)]), 1)
        return np.asarray(votes[:, 1:].argmax(axis=1))

    def _nearest_pixels(self, points: Floats) -> tuple[Ints, Ints]:
        """Return the rows and columns in the image, (N,) each, that are nearest to positions (N, D)."""
        pixels = np.rint(np.nan_to_num(self.in_image(points)))
        u, v = np.clip(pixels, 0, np.array(self.mask.shape[::-1]) - 1).astype(np.int64).T
        return v, u

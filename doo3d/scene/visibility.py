"""Visibility: what the camera says about paths and ends: how much of a path is open, and whether the object ends at an end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..config import VisibilityConfig
from ..geometry.curves import Curves
from ..geometry.polyline import steps, unit
from ..geometry.radii import STEP_RADII
from ..types import Bools, Floats, Foreground, Ints
from .depth_model import DepthModel, MultiViewDepthModel, PointVisibility
from .support import Support

TIP_LOOKAHEAD_RADII = np.array([3.0, 4.0, 5.0])
"""Radii ahead of an end at which a tip is told: a chain may stop two radii before the tip, where thinning ends."""

TIP_FAN = np.radians(25.0) * np.array((-1, 0, 1))
"""Directions in the image, from straight on, in which the mask ends at a tip: the tangent of an end is that uncertain."""

OCCLUDER_MARGIN_RADII = 0.6
"""Radii by which an occluder is nearer at least. A strand on top of another one is nearer by two, at its border by one."""


@dataclass(frozen=True)
class Visibility:
    """What the cameras of a frame say about a path, or about what follows an end of a chain.

    Attributes
    ----------
    model
        what they say about each position.
    """

    model: DepthModel | MultiViewDepthModel

    @staticmethod
    def of(foreground: Foreground, config: VisibilityConfig, radius: float) -> Visibility | None:
        """Return the visibility in the frame of a foreground; None for a cloud without camera views.

        foreground, config, radius : as for `DepthModel.of`.
        """
        model = DepthModel.of(foreground, config, radius)
        return None if model is None else Visibility(model)

    def with_support(self, chains: Curves, radius: float, foreground: Foreground) -> Visibility:
        """Return a copy that tells bare surface from holes in the mask, as measured beside chains; itself where none is seen.

        chains : the joints of chains, m (px in 2-D). radius : of the object, m. foreground : the one of the model.

        In 2-D and in a fused cloud, of which no single depth image shows the surface beside the chains, it is the same.
        """
        support = Support.beside(chains, radius, foreground)
        if support is None or not isinstance(self.model, DepthModel):
            return self
        return Visibility(replace(self.model, support=support))

    def exits_view(self, ends: Floats, directions: Floats, reach: float) -> Bools:
        """Tell which chain ends would be outside the image if they went straight on by `reach`: cut off there, and not `tips`.

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
        return self.model.is_outside(ends + reach * directions)

    def is_exposed(self, ends: Floats, directions: Floats, radius: float, reach: float) -> Bools:
        """Tell which chain ends are in plain view, so that nothing can hide a continuation.

        Unlike `tips` this does not ask whether the mask goes on: an end in plain view may lie on the object.

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
        model = self.model
        if not isinstance(model, DepthModel) or model.depth is None:
            return np.zeros(len(ends), dtype=bool)
        step = STEP_RADII / 2 * radius
        ahead = ends[:, None] + np.arange(step, reach * (1 + 1e-9), step)[:, None] * directions[:, None]
        points = ahead.reshape(-1, ends.shape[1])
        free = replace(model, own_object_counts_as_free=True).classify(points) == PointVisibility.FREE
        hidden = replace(model, margin=OCCLUDER_MARGIN_RADII * radius).classify(points) == PointVisibility.HIDDEN
        free, hidden = free.reshape(ahead.shape[:2]), hidden.reshape(ahead.shape[:2])
        first_free = np.where(free.any(axis=1), free.argmax(axis=1), ahead.shape[1])
        return np.asarray(first_free < np.where(hidden.any(axis=1), hidden.argmax(axis=1), ahead.shape[1]))

    def tips(self, ends: Floats, directions: Floats, radius: float) -> Floats:
        """Return the log-odds that ends are tips in plain view: the mask does not go on ahead, and space there is open.

        Where the mask goes on, the object does too, and only its depth is lost. Ahead, the median over TIP_LOOKAHEAD_RADII counts
        of the log-odds that a position is free or bare; nothing is known to be beyond the border of the image.

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
        (E,) nat, above 0 for a tip in plain view; minus infinity where the mask goes on, in 2-D and for clouds.
        """
        model = self.model
        if not isinstance(model, DepthModel) or model.depth is None or model.camera is None:
            return np.full(len(ends), -np.inf)
        ahead = ends[:, None] + radius * TIP_LOOKAHEAD_RADII[:, None] * directions[:, None]
        state = model.log_odds(ahead.reshape(-1, 3))
        is_open = np.median(np.maximum(state.free, state.bare).reshape(ahead.shape[:2]), axis=1)
        at = model.camera.project(ends)
        forward = unit(model.camera.project(ends + radius * directions) - at)
        turned = np.cos(TIP_FAN)[:, None, None] * forward + np.sin(TIP_FAN)[:, None, None] * forward[:, ::-1] * (-1, 1)
        reach = (model.camera.fx * radius / ends[:, 2])[:, None, None] * TIP_LOOKAHEAD_RADII[:, None]
        height, width = model.mask.shape
        u, v = np.rint(at[:, None] + reach * turned[:, :, None]).astype(np.int64).clip(0, (width - 1, height - 1)).T
        return np.where(model.mask[v, u].any(axis=(0, 2)), -np.inf, is_open)

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
        return self.lengths(np.concatenate(paths), np.cumsum([0, *map(len, paths)]))

    def lengths(self, points: Floats, bounds: Ints) -> Floats:
        """Return the same as `gap_lengths` of K polylines whose points (N, D) are one after the other; bounds : (K + 1,)."""
        owner = np.repeat(np.arange(len(bounds) - 1), np.diff(bounds))
        classes = self.model.classify((points[1:] + points[:-1]) / 2)
        kinds = [PointVisibility.FREE, PointVisibility.OUTSIDE], [PointVisibility.NO_DEPTH], [PointVisibility.BARE]
        length = np.where(owner[1:] == owner[:-1], steps(points), 0.0)
        sums = [np.bincount(owner[1:], length * np.isin(classes, kind), len(bounds) - 1) for kind in kinds]
        return np.column_stack(sums)

"""Where strands cross in the view, and which of them is on top."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ...config import CrossingsConfig
from ...geometry.intersections import Intersections, PolylineSet, find_intersections
from ...geometry.projection import Projection, axes_along
from ...kernels.sampling import sample_bilinear
from ...types import Array, Camera, Chain, Crossing, Floats, Foreground, SegmentRef
from .. import FrameContext
from .depth_order import Look, by_color, by_surface, strands

SPREAD = 0.5
"""Thicknesses by which a difference in depth may be wrong, as a standard deviation; strands that touch are 1 apart."""

UNSEEN = 1.0
"""The same where a strand was not seen on both sides of the crossing."""

MEASURED = 0.75
"""Share of the surfaces beyond the crossing, beside that of the chains there: the lower one's was not seen at the crossing."""

SURFACE = 4.0
"""Log odds when the surface in the overlap is just where one strand's should be, and a thickness from the other's."""

COLOR = 3.0
"""Log odds per log ratio by which one strand's colours tell those in the overlap better, up to MOST of that."""

MOST = 2.0

TELLING = 0.35
"""A log ratio of colours that is less than this says nothing: so much comes from light and texture."""

NOISE = 6.0
"""Grey levels of 255 by which colours along a strand differ anyway."""

NEAREST = 8
"""Points of a cloud of which the nearest to the sensor is taken for the surface."""

FROM_ABOVE = np.diag((1.0, 1.0, -1.0))
"""Axes of the view of a cloud without a viewpoint: x right, y down in the view, along -z."""

UNIT_CAMERA = Camera(1.0, 1.0, 0.0, 0.0, 1, 1)
"""Intrinsics of the view of a cloud with a viewpoint: positions are tangents of angles."""


def find_crossings(chains: list[Chain], context: FrameContext, config: CrossingsConfig) -> tuple[Crossing, ...]:
    """Every place where two strands, of one chain or of two, cross in the view; in the order of the chains and along them.

    The view is the camera's; that of a cloud is from its viewpoint, or from above, along its z axis, where that is unknown. In
    2-D there is no depth, and only color tells which strand is upper: where it does not, it is the first, with confidence 0.
    """
    if not chains:
        return ()
    foreground = context.foreground
    closed = [chain.closed for chain in chains]
    view = projection_of(foreground)
    flat, away = [view.project(chain.joints) for chain in chains], [view.distance(chain.joints) for chain in chains]
    found = find_intersections(flat, closed)
    if not len(found.angle):
        return ()
    radius = np.array([chain.radius for chain in chains])[found.chain]
    lines = PolylineSet.from_polylines([np.column_stack(both) for both in zip(flat, away, strict=True)], closed)
    odds = _odds(found, lines, radius, view, foreground if config.use_color else replace(foreground, color=None))
    return tuple(_crossing(found, k, chains, float(value)) for k, value in enumerate(odds))


def _crossing(found: Intersections, k: int, chains: list[Chain], odds: float) -> Crossing:
    """The crossing `k`, with log odds that the first strand is the upper."""
    places = [SegmentRef(int(chain), int(segment)) for chain, segment in zip(found.chain[k], found.segment[k], strict=True)]
    upper = 0 if odds >= 0 else 1
    joints = chains[places[upper].chain].joints[places[upper].segment :][:2]
    part = float(found.t[k, upper])
    return Crossing(places[upper], places[1 - upper], joints[0] * (1 - part) + joints[1] * part, float(np.tanh(abs(odds) / 2)))


def _odds(found: Intersections, lines: PolylineSet, radius: Floats, view: Projection, foreground: Foreground) -> Floats:
    """Log odds that the first strand of each crossing is the upper: (C,). radius : (C, 2) of the strands."""
    depth = lines.interpolate(found.chain, found.segment + found.t)[..., 2]
    seen = strands(found, lines, radius * view.scale(depth))
    odds = np.zeros(len(depth))
    if foreground.points.shape[1] == 3:
        thick = np.maximum(radius.sum(axis=1), 1e-9)
        front, miss = by_surface(seen, _surface(foreground, view, seen.place, seen.half), depth, radius)
        apart = (depth[:, 1] - depth[:, 0]) / thick
        spread = np.where(np.isfinite(front), SPREAD, UNSEEN)
        apart = np.where(np.isfinite(front), MEASURED * front / thick + (1 - MEASURED) * apart, apart)
        odds += 2 * np.clip(apart, -1.5, 1.5) / spread**2
        odds += SURFACE * np.nan_to_num(np.clip(miss / thick, -1.0, 1.0))
    color = foreground.color
    if color is not None:
        ratio = by_color(seen, lambda places: _shades(color, places), NOISE)
        odds += COLOR * np.where(np.abs(ratio) >= TELLING, np.clip(ratio, -MOST, MOST), 0.0)
    return odds


def projection_of(foreground: Foreground) -> Projection:
    """Return the projection of a camera, from a viewpoint, from above, or, in 2-D, of the image."""
    if foreground.points.shape[1] == 2:
        return Projection.planar()
    if foreground.camera is not None:
        return Projection.of_camera(foreground.camera)
    viewpoint = foreground.viewpoint
    if viewpoint is None:
        return Projection.parallel(np.zeros(3), FROM_ABOVE)
    return Projection.perspective(viewpoint, axes_along(foreground.points.mean(axis=0) - viewpoint), UNIT_CAMERA)


def _surface(foreground: Foreground, view: Projection, places: Floats, half: Floats) -> Look:
    """Where the surface lies at places in the view: the depth image's pixels of the object, or points of the cloud near there."""
    if foreground.depth is not None and foreground.mask is not None:
        depth, mask = foreground.depth, foreground.mask

        def measured(at: Floats) -> Floats:
            found = _nearest(depth, at)
            return np.where((found > 0) & (_nearest(mask, at) > 0), found, np.nan)

        return measured
    flat, away = view.project(foreground.points), view.distance(foreground.points)
    width = float(half.max())
    near = np.zeros(len(flat), dtype=bool)
    for place in places:
        near |= (np.abs(flat - place) < 20 * width).all(axis=1)
    if not near.any():
        return lambda at: np.full(at.shape[:-1], np.nan)
    tree, known = cKDTree(flat[near]), np.append(away[near], np.inf)

    def look(at: Floats) -> Floats:
        asked = np.where(np.isfinite(at), at, 1e9)
        found = known[tree.query(asked.reshape(-1, 2), NEAREST, distance_upper_bound=0.5 * width)[1]].min(axis=1)
        return np.where(np.isfinite(found), found, np.nan).reshape(at.shape[:-1])

    return look


def _nearest(image: Array, places: Floats) -> Floats:
    """The image's pixels (H, W) or (H, W, K) at places (..., 2) px; NaN outside."""
    height, width = image.shape[:2]
    u, v = np.rint(places[..., 0]), np.rint(places[..., 1])
    inside = (u >= 0) & (v >= 0) & (u < width) & (v < height)
    found = image[np.where(inside, v, 0).astype(int), np.where(inside, u, 0).astype(int)].astype(float)
    return np.where(inside if image.ndim == 2 else inside[..., None], found, np.nan)


def _shades(image: Array, places: Floats) -> Floats:
    """Colours (..., 3) of the image between the four pixels round each place (..., 2) px; NaN outside."""
    return np.asarray(sample_bilinear(np.ascontiguousarray(image), places.reshape(-1, 2))).reshape(*places.shape[:-1], -1)

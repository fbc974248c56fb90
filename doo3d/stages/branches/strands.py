"""Strands: the chains of a frame as dense samples along their axes, with radius, tangents and ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...geometry.polyline import angle, arc_length, resample, unit
from ...kernels import end_tangents
from ...types import Bools, Chain, Floats, Ints

SPACING_RADII = 0.4
"""Radii between the samples of a strand."""

MAX_SAMPLES = 50_000
"""Samples of all strands of a frame at most; harnesses have a tenth of that. Beyond, samples lie farther apart."""

TANGENT_RADII, TANGENT_SEGMENTS = 8.0, 4.0
"""Length of strand from which tangent and curvature of an end are taken: radii, and segments at least."""

ARM_RADII = (2.0, 8.0)
"""Radii from a place between which the direction and the radius of a strand beside it are measured."""

INSIDE_DEPTH_RADII = 2.0
"""Sums of radii by which depth may place a strand before or behind the one that it runs in."""

PART_RADII = 0.7
"""Radii of a branch from the surface of its trunk to its axis up to which the branch runs along the trunk, not away from it."""

HalfWidth = Callable[[Floats], Floats]


KINK_RADII, MIN_KINK_SAMPLES = 10.0, 4
"""Radii of strand beside a place from which its direction and curvature there are taken, and samples at least."""


@dataclass(frozen=True)
class SampledChain:
    """One chain as S samples along its axis.

    Attributes
    ----------
    points
        (S, D) m (px in 2-D), evenly spaced, both ends included.
    along
        (S,) m (px in 2-D), arc length of each sample.
    radii
        (S,) m (px in 2-D), radius at each sample.
    occluded
        (S,) bool, whether the sample was filled in, not seen.
    radius
        m (px in 2-D), of the whole strand.
    closed
        True for a ring.
    half_widths
        (S,) px, half-width of the mask at each sample, in an image; None otherwise. `radii` are smoothed along a strand, and hide
        where a thick one was joined to a thin one.
    """

    points: Floats
    along: Floats
    radii: Floats
    occluded: Bools
    radius: float
    closed: bool
    half_widths: Floats | None = None

    @property
    def length(self) -> float:
        """The length of the strand, m (px in 2-D)."""
        return float(self.along[-1])

    @property
    def widths(self) -> Floats:
        """Half the width of the strand at each sample, (S,) m (px in 2-D): as the mask shows it, if there is one."""
        return self.radii if self.half_widths is None else self.half_widths

    def at(self, position: float) -> Floats:
        """Return the point of the axis at an arc length, (D,)."""
        return np.asarray(resample(self.points, np.array([position]))[0])

    def is_near_end(self, position: float, limit: float) -> bool:
        """Tell whether a position lies within `limit` of an end, m (px in 2-D); a ring has none."""
        return not self.closed and min(position, self.length - position) < limit

    def direction(self, sample: int) -> Floats:
        """Return the tangent of the axis at a sample, (D,) unit."""
        return unit(self.points[min(sample + 2, len(self.points) - 1)] - self.points[max(sample - 2, 0)])

    def radius_near(self, position: float, side: int) -> float:
        """Return the median radius beside a position, before it (side -1) or after it (1), m (px in 2-D)."""
        offset = side * (self.along - position)
        low, high = (factor * self.radius for factor in ARM_RADII)
        chosen = (offset > low) & (offset < high) & ~self.occluded
        if not chosen.any():
            chosen = (offset > 0) & ~self.occluded
        return float(np.median(self.widths[chosen])) if chosen.any() else self.radius

    def kink(self, position: float, clear: float, towards: Floats | None) -> float:
        """Return the angle in radians by which the strand bends at a position, beyond the curvature of both sides.

        Parameters
        ----------
        position
            arc length, m (px in 2-D).
        clear
            m (px in 2-D) to both sides that are left out, since another strand bends the axis there.
        towards
            (3,) unit, the view direction, along which the axis is less certain and is not looked at; None looks at all.

        Returns
        -------
        0 to pi; 0 where one side is too short to tell.
        """
        before, after = (self.heading(position, side, clear, towards) for side in (-1, 1))
        return 0.0 if before is None or after is None else float(angle(-before, after))

    def heading(self, position: float, side: int, clear: float, towards: Floats | None) -> Floats | None:
        """Return the direction (D,) unit in which the strand comes to a position from before it (side -1) or after it (1).

        clear, towards : as for `kink`. Returns None where that side is too short to tell.
        """
        length = KINK_RADII * self.radius
        points = across_view(self.points, towards)
        offset = side * (self.along - position)
        chosen = points[(offset >= clear) & (offset <= clear + length)]
        if len(chosen) < MIN_KINK_SAMPLES:
            return None
        line = np.ascontiguousarray(chosen if side < 0 else chosen[::-1])
        tangents, curvatures = end_tangents(line, np.array([0, len(line)]), length)
        return unit(tangents[1] + clear * curvatures[1])

    def arm(self, position: float, side: int, clear: float) -> Floats:
        """Return the direction (D,) unit in which the strand leaves a position, before it (side -1) or after it (1).

        clear : m (px in 2-D) beside the position that are left out, since the other strand bends the axis there.
        """
        near, far = position + side * clear, position + side * (clear + ARM_RADII[1] * self.radius)
        near, far = (float(np.clip(value, 0, self.length)) for value in (near, far))
        if abs(far - near) < self.radius:
            near = position
        return unit(self.at(far) - self.at(near))


def across_view(vectors: Floats, towards: Floats | None) -> Floats:
    """Return vectors (N, 3) without their part along the view direction, (3,) unit; as they are if that is None."""
    return vectors if towards is None else vectors - (vectors @ towards)[:, None] * towards


def stretch_inside(branch: SampledChain, at: float, trunk: SampledChain, viewpoint: Floats | None = None) -> tuple[float, float]:
    """Return the stretch of a strand round a place, as two arc lengths, on which its axis runs inside another strand.

    Parameters
    ----------
    branch
        the strand that runs through the other one.
    at
        arc length on it, m (px in 2-D), where the axes meet.
    trunk
        the other strand.
    viewpoint
        (3,) m, where the camera is, along whose view depth is uncertain; None in 2-D, and where it is unknown.
    """
    is_inside, _ = inside(branch, trunk, viewpoint)
    middle = int(np.abs(branch.along - at).argmin())
    outside = np.flatnonzero(~is_inside)
    before, after = outside[outside < middle], outside[outside > middle]
    low = float(branch.along[before[-1]]) if len(before) else 0.0
    high = float(branch.along[after[0]]) if len(after) else branch.length
    return low, high


def inside(strand: SampledChain, other: SampledChain, viewpoint: Floats | None = None) -> tuple[Bools, Ints]:
    """Tell where the axis of a strand runs inside another strand, or hardly outside.

    strand, other, viewpoint : as for `stretch_inside`. Returns (S,) bool for the S samples of the strand, and (S,) the nearest
    samples of the other strand: as the camera sees them, where it is known.
    """
    if viewpoint is None:
        nearest = cKDTree(other.points).query(strand.points)[1]
        offset, depth = other.points[nearest] - strand.points, np.zeros(len(strand.points))
    else:
        towards = unit(strand.points - viewpoint)
        nearest = cKDTree(unit(other.points - viewpoint)).query(towards)[1]
        offset = other.points[nearest] - strand.points
        depth = (offset * towards).sum(axis=1)
        offset = offset - depth[:, None] * towards
    is_inside = np.linalg.norm(offset, axis=1) < other.radii[nearest] + PART_RADII * strand.radius
    return is_inside & (np.abs(depth) < INSIDE_DEPTH_RADII * (other.radii[nearest] + strand.radius)), nearest


def strands_of(chains: Sequence[Chain], half_width: HalfWidth | None = None) -> list[SampledChain]:
    """Return chains as strands, in the same order.

    half_width : function from positions (S, 2) px to the half-width (S,) of the mask there, in an image; None otherwise.
    """
    strands = []
    least_spacing = sum(chain.length for chain in chains) / MAX_SAMPLES
    for chain in chains:
        radius = chain.radius if chain.radius > 0 else chain.segment_length
        along = arc_length(chain.joints)
        at = np.linspace(0, along[-1], max(2, round(along[-1] / max(SPACING_RADII * radius, least_spacing)) + 1))
        segment = np.minimum((at / chain.segment_length).astype(int), len(chain.occluded) - 1)
        measured = np.where(np.isfinite(chain.radii) & (chain.radii > 0), chain.radii, radius)
        radii = np.interp(at, along, measured)
        points, occluded = resample(chain.joints, at), chain.occluded[segment]
        widths = None if half_width is None else half_width(points)
        if widths is not None:
            widths, occluded = np.where(widths > 0, widths, radii), occluded | (widths <= 0)
        strands.append(SampledChain(points, at, radii, occluded, radius, chain.closed, widths))
    return strands


def box_distances(points: Floats, strands: Sequence[SampledChain]) -> Floats:
    """Return the distance of each of E points (E, D) from the bounding box of each of S strands, (E, S) m (px in 2-D)."""
    low, high = (np.array([limit(strand.points, axis=0) for strand in strands]) for limit in (np.min, np.max))
    outside = np.maximum(np.maximum(low[None] - points[:, None], points[:, None] - high[None]), 0.0)
    return np.asarray(np.linalg.norm(outside, axis=2))


@dataclass(frozen=True)
class FreeEnds:
    """The E ends of open strands: (E,) strand and side (0 first, 1 last); (E, D) position, outward unit tangent, curvature."""

    strand: Ints
    side: Ints
    points: Floats
    tangents: Floats
    curvatures: Floats


def free_ends(chains: Sequence[Chain], strands: Sequence[SampledChain]) -> FreeEnds:
    """Measure the ends of all chains that are no rings."""
    tangents, curvatures = [], []
    for chain, strand in zip(chains, strands, strict=True):
        window = max(TANGENT_RADII * strand.radius, TANGENT_SEGMENTS * chain.segment_length)
        both = end_tangents(np.ascontiguousarray(chain.joints), np.array([0, len(chain.joints)]), window)
        tangents.append(both[0])
        curvatures.append(both[1])
    is_open = np.repeat([not strand.closed for strand in strands], 2)
    points = np.concatenate([strand.points[[0, -1]] for strand in strands])
    rows = np.flatnonzero(is_open)
    return FreeEnds(rows // 2, rows % 2, points[rows], np.concatenate(tangents)[rows], np.concatenate(curvatures)[rows])

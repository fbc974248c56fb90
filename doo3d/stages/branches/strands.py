"""Sample the chains of a frame densely along their axes, with radius, tangents and ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from ...geometry.curves import Curves
from ...geometry.limits import MAX_SAMPLES
from ...geometry.polyline import angle, arc_length, resample, unit
from ...geometry.radii import STEP_RADII
from ...types import Bools, Chain, Floats, Ints

ARM_RADII = (2.0, 8.0)
"""Distances from a position, in radii, between which direction and radius of a strand on one side of it are measured. The second
is also the length over which tangent and curvature are measured, and that from which on a strand may touch itself."""

MIN_STEPS = 4
"""Fewest samples, or segments, over which tangent and curvature are measured."""

NODE_RADII = 3.0
"""Distance from a junction or a tip, in radii of the strand, within which all belongs to it: a crossing in the view, a second
junction, a rest of a strand, a tail, a branch at the tip of its trunk. Detected trees are scored with the same distance."""

MIN_ANGLE = 0.35
"""Smallest angle, radians, at which one strand crosses another or leads to it: at less, the two run side by side.
Chosen: half and twice of it give the same 138 of 180 harnesses."""

INSIDE_DEPTH_RADII = 2.0
"""Largest difference in depth, in sums of radii, of a strand inside another: depth is uncertain where strands merge."""

JUNCTION_RADII = 0.8
"""Distance up to which a branch is inside its trunk, from the surface of that, in radii of the branch; and from a junction, in
radii of the strand, within which the axis of a piece is replaced by a straight line to it."""

HalfWidth = Callable[[Floats], Floats]


@dataclass(frozen=True)
class SampledChain:
    """One chain as S samples along its axis.

    Attributes
    ----------
    chain
        the chain itself.
    points
        (S, D) m (px in 2-D), evenly spaced, both ends included.
    along
        (S,) m (px in 2-D), arc length of each sample.
    radii
        (S,) m (px in 2-D), radius at each sample.
    occluded
        (S,) bool, whether the sample was filled in, not seen.
    radius
        m (px in 2-D), radius of the whole strand; the length of a segment if it is unknown.
    half_widths
        (S,) px, half-width of the mask at each sample, in an image; None otherwise. Unlike `radii`, half-widths are not smoothed
        along the strand, so they show where a thick strand was joined to a thin one.
    """

    chain: Chain
    points: Floats
    along: Floats
    radii: Floats
    occluded: Bools
    radius: float
    half_widths: Floats | None = None

    @property
    def closed(self) -> bool:
        """Whether the strand is a ring."""
        return self.chain.closed

    @cached_property
    def ends(self) -> tuple[Floats, Floats]:
        """The outward tangents and the curvature vectors of both ends, 1/m (1/px), (2, D) each."""
        return Curves.of([self.chain.joints]).ends(max(ARM_RADII[1] * self.radius, MIN_STEPS * self.chain.segment_length))

    @property
    def length(self) -> float:
        """The length of the strand, m (px in 2-D)."""
        return float(self.along[-1])

    @property
    def widths(self) -> Floats:
        """Half the width of the strand at each sample, (S,) m (px in 2-D): `half_widths`, or `radii` without a mask."""
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
        """Return the median radius on one side of a position, m (px in 2-D); side : -1 before the position, 1 after it."""
        offset = side * (self.along - position)
        low, high = (factor * self.radius for factor in ARM_RADII)
        chosen = (offset > low) & (offset < high) & ~self.occluded
        if not chosen.any():
            chosen = (offset > 0) & ~self.occluded
        return float(np.median(self.widths[chosen])) if chosen.any() else self.radius

    def kink(self, position: float, clear: float, towards: Floats | None) -> float:
        """Return the angle in radians between the two sides of a position, extrapolated to it with their curvature.

        Parameters
        ----------
        position
            arc length, m (px in 2-D).
        clear
            m (px in 2-D) on both sides that are left out, since a contact with another strand disturbs the axis there.
        towards
            (3,) unit, the view direction; the component along it is left out, since depth is less certain. None keeps it.

        Returns
        -------
        0 to pi; 0 if one side is too short to measure.
        """
        before, after = (self.heading(position, side, clear, towards) for side in (-1, 1))
        return 0.0 if before is None or after is None else float(angle(-before, after))

    def heading(self, position: float, side: int, clear: float, towards: Floats | None) -> Floats | None:
        """Return the direction of motion along one side of the strand towards a position, extrapolated with its curvature.

        Parameters
        ----------
        position
            arc length, m (px in 2-D).
        side
            -1 for the samples before the position, 1 for those after it.
        clear
            m (px in 2-D) beside the position that are left out, since a contact with another strand disturbs the axis there.
        towards
            (3,) unit, the view direction; the component along it is left out. None keeps it.

        Returns
        -------
        (D,) unit; None if the side is too short to measure.
        """
        length = ARM_RADII[1] * self.radius
        points = across_view(self.points, towards)
        offset = side * (self.along - position)
        chosen = points[(offset >= clear) & (offset <= clear + length)]
        if len(chosen) < MIN_STEPS:
            return None
        tangents, curvatures = Curves.of([chosen if side < 0 else chosen[::-1]]).ends(length)
        return unit(tangents[1] + clear * curvatures[1])

    def arm(self, position: float, side: int, clear: float) -> Floats:
        """Return the unit direction (D,) from a position along one side of the strand, as a chord.

        Parameters
        ----------
        position
            arc length, m (px in 2-D).
        side
            -1 for the part before the position, 1 for the part after it.
        clear
            m (px in 2-D) beside the position that are left out, since a contact with another strand disturbs the axis there.
        """
        near, far = position + side * clear, position + side * (clear + ARM_RADII[1] * self.radius)
        near, far = (float(np.clip(value, 0, self.length)) for value in (near, far))
        if abs(far - near) < self.radius:
            near = position
        return unit(self.at(far) - self.at(near))


def across_view(vectors: Floats, towards: Floats | None) -> Floats:
    """Return vectors (N, 3) without their component along the view direction `towards`, (3,) unit; unchanged if it is None."""
    return vectors if towards is None else vectors - (vectors @ towards)[:, None] * towards


def stretch_inside(branch: SampledChain, at: float, trunk: SampledChain, viewpoint: Floats | None = None) -> tuple[float, float]:
    """Return the two arc lengths between which the axis of a branch runs inside a trunk.

    Parameters
    ----------
    branch
        the strand that passes through the trunk.
    at
        arc length on the branch at which the axes meet, m (px in 2-D).
    trunk
        the strand that is passed through.
    viewpoint
        (3,) m, position of the camera: differences along its view count less. None in 2-D, and where it is unknown.
    """
    is_inside, _ = inside(branch, trunk, viewpoint)
    middle = int(np.abs(branch.along - at).argmin())
    outside = np.flatnonzero(~is_inside)
    before, after = outside[outside < middle], outside[outside > middle]
    low = float(branch.along[before[-1]]) if len(before) else 0.0
    high = float(branch.along[after[0]]) if len(after) else branch.length
    return low, high


def inside(strand: SampledChain, other: SampledChain, viewpoint: Floats | None = None) -> tuple[Bools, Ints]:
    """Tell which samples of a strand lie inside another strand, or within JUNCTION_RADII (0.8) radii of its surface.

    Parameters
    ----------
    strand
        the strand of S samples.
    other
        the strand around it.
    viewpoint
        (3,) m, position of the camera: differences along its view count less. None in 2-D, and where it is unknown.

    Returns
    -------
    is_inside : (S,) bool.
    nearest : (S,) int, index of the nearest sample of the other strand; nearest in the view if the viewpoint is known.
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
    is_inside = np.linalg.norm(offset, axis=1) < other.radii[nearest] + JUNCTION_RADII * strand.radius
    return is_inside & (np.abs(depth) < INSIDE_DEPTH_RADII * (other.radii[nearest] + strand.radius)), nearest


def strands_of(
    chains: Sequence[Chain], half_width: HalfWidth | None = None, known: Sequence[SampledChain] = ()
) -> list[SampledChain]:
    """Sample chains along their axes, half a radius apart, in the same order.

    Parameters
    ----------
    chains
        the chains, m (px in 2-D).
    half_width
        function from positions (S, 2) px to the half-width (S,) px of the mask there, for an image; None otherwise.
    known
        samples made before: a chain that is among theirs is not sampled again.
    """
    strands = {id(strand.chain): strand for strand in known}
    least_spacing = sum(chain.length for chain in chains) / MAX_SAMPLES
    for chain in (chain for chain in chains if id(chain) not in strands):
        radius = chain.radius if chain.radius > 0 else chain.segment_length
        along = arc_length(chain.joints)
        at = np.linspace(0, along[-1], max(2, round(along[-1] / max(STEP_RADII * radius, least_spacing)) + 1))
        segment = np.minimum((at / chain.segment_length).astype(int), len(chain.occluded) - 1)
        measured = np.where(np.isfinite(chain.radii) & (chain.radii > 0), chain.radii, radius)
        radii = np.interp(at, along, measured)
        points, occluded = resample(chain.joints, at), chain.occluded[segment]
        widths = None if half_width is None else half_width(points)
        if widths is not None:
            widths, occluded = np.where(widths > 0, widths, radii), occluded | (widths <= 0)
        strands[id(chain)] = SampledChain(chain, points, at, radii, occluded, radius, widths)
    return [strands[id(chain)] for chain in chains]


def box_distances(points: Floats, strands: Sequence[SampledChain]) -> Floats:
    """Return the distance of each of E points (E, D) from the bounding box of each of S strands, (E, S) m (px in 2-D)."""
    low, high = (np.array([limit(strand.points, axis=0) for strand in strands]) for limit in (np.min, np.max))
    outside = np.maximum(np.maximum(low[None] - points[:, None], points[:, None] - high[None]), 0.0)
    return np.asarray(np.linalg.norm(outside, axis=2))


@dataclass(frozen=True)
class FreeEnds:
    """The E ends of open strands.

    Attributes
    ----------
    strand, side
        (E,) int, index of the strand, and 0 for its first end, 1 for its last.
    points
        (E, D) m (px in 2-D), positions.
    tangents, curvatures
        (E, D) outward unit tangents, and curvature vectors, 1/m (1/px).
    """

    strand: Ints
    side: Ints
    points: Floats
    tangents: Floats
    curvatures: Floats


def free_ends(strands: Sequence[SampledChain]) -> FreeEnds:
    """Return position, tangent and curvature of the ends of all open strands."""
    rows = np.flatnonzero(np.repeat([not strand.closed for strand in strands], 2))
    points = np.concatenate([strand.points[[0, -1]] for strand in strands])
    tangents, curvatures = (np.concatenate(each) for each in zip(*(strand.ends for strand in strands), strict=True))
    return FreeEnds(rows // 2, rows % 2, points[rows], tangents[rows], curvatures[rows])

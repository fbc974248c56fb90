"""Sample the chains of a frame densely along their axes, with radius, tangents and ends; and candidates for their contacts."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from ...geometry.curves import Curves
from ...geometry.limits import MAX_SAMPLES
from ...geometry.polyline import arc_length, resample, unit
from ...geometry.radii import NODE_RADII, STEP_RADII
from ...scene.scene import Scene
from ...types import Bools, Chain, Floats, Ints
from ..ends import End, Ends

ARM_RADII = (2.0, 8.0)
"""Distances from a position, in radii, between which direction and radius of a strand on one side are measured. The second is
also the length over which the tangents of ends are measured."""

MIN_STEPS = 4
"""Fewest segments over which the tangents of ends are measured."""

JUNCTION_RADII = 0.8
"""Distance from a trunk's surface, in radii of the branch, up to which the branch is inside; and distance from a junction, in
radii of the strand, within which the axis of a piece is replaced by a straight line to the junction."""


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
    """

    chain: Chain
    points: Floats
    along: Floats
    radii: Floats
    occluded: Bools
    radius: float

    @cached_property
    def ends(self) -> Floats:
        """The outward tangents of both ends, (2, D)."""
        return Curves.of([self.chain.joints]).ends(max(ARM_RADII[1] * self.radius, MIN_STEPS * self.chain.segment_length))

    @cached_property
    def end_radii(self) -> tuple[float, float]:
        """The radius beside each end, m (px in 2-D)."""
        return self.radius_near(0.0, 1), self.radius_near(self.length, -1)

    @cached_property
    def near_ends(self) -> Bools:
        """The samples that belong to a tip, within NODE_RADII (3) radii of an end, (S,) bool; none of a ring."""
        from_end = np.minimum(self.along, self.length - self.along)
        return np.asarray((from_end <= NODE_RADII * self.radii) & (not self.chain.closed))

    @cached_property
    def tree(self) -> cKDTree:
        """The k-d tree of the samples."""
        return cKDTree(self.points)

    @property
    def length(self) -> float:
        """The length of the strand, m (px in 2-D)."""
        return float(self.along[-1])

    def at(self, position: float) -> Floats:
        """Return the point of the axis at an arc length, (D,)."""
        return np.asarray(resample(self.points, np.array([position]))[0])

    def is_near_end(self, position: float, limit: float) -> bool:
        """Return whether an arc length is within `limit` of an end, m (px in 2-D); a ring has no ends."""
        return not self.chain.closed and min(position, self.length - position) < limit

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
        return float(np.median(self.radii[chosen])) if chosen.any() else self.radius

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


def view_direction(point: Floats, scene: Scene) -> Floats:
    """Return the direction from the viewpoint to a position, (D,) unit; zeros in an image, and where no viewpoint is known."""
    return np.zeros(len(point)) if scene.viewpoint is None else unit(point - scene.viewpoint)


def across_view(vectors: Floats, towards: Floats) -> Floats:
    """Return vectors (..., D) without their component along the view direction `towards`, (D,) unit or zeros."""
    return vectors - (vectors @ towards)[..., None] * towards


def stretch_inside(branch: SampledChain, at: float, trunk: SampledChain) -> tuple[float, float]:
    """Return the two arc lengths between which the axis of a branch runs inside a trunk, or within 0.8 radii of its surface.

    Parameters
    ----------
    branch
        the strand that passes through the trunk.
    at
        arc length on the branch at which the axes meet, m (px in 2-D).
    trunk
        the strand that is passed through.
    """
    before, after = np.flatnonzero(branch.along < at)[::-1], np.flatnonzero(branch.along > at)
    return _first_outside(branch, before, trunk, 0.0), _first_outside(branch, after, trunk, branch.length)


def _first_outside(branch: SampledChain, samples: Ints, trunk: SampledChain, otherwise: float) -> float:
    """Return the arc length of the first of some samples of a branch that is more than 0.8 radii outside of a trunk's surface.

    otherwise : returned if there is no such sample.
    """
    start = 0
    while start < len(samples):  # nearly always one of the first is outside
        some = samples[start : 2 * start + 16]
        distance, nearest = trunk.tree.query(branch.points[some])
        outside = some[distance >= trunk.radii[nearest] + JUNCTION_RADII * branch.radius]
        if len(outside):
            return float(branch.along[outside[0]])
        start += len(some)
    return otherwise


def strands_of(chains: Sequence[Chain], known: Sequence[SampledChain] = ()) -> list[SampledChain]:
    """Sample chains along their axes, half a radius apart, in the same order.

    Parameters
    ----------
    chains
        the chains, m (px in 2-D).
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
        strands[id(chain)] = SampledChain(chain, points, at, radii, occluded, radius)
    return [strands[id(chain)] for chain in chains]


def box_distances(points: Floats, strands: Sequence[SampledChain]) -> Floats:
    """Return the distance of each of E points (E, D) from the bounding box of each of S strands, (E, S) m (px in 2-D)."""
    low, high = (np.array([limit(strand.points, axis=0) for strand in strands]) for limit in (np.min, np.max))
    outside = np.maximum(np.maximum(low[None] - points[:, None], points[:, None] - high[None]), 0.0)
    return np.asarray(np.linalg.norm(outside, axis=2))


def ends_of_strands(strands: Sequence[SampledChain], scene: Scene) -> Ends:
    """Return the ends of all strands, in their order."""
    points = np.concatenate([strand.points[[0, -1]] for strand in strands])
    tangents = np.concatenate([strand.ends for strand in strands])
    closed = np.repeat([strand.chain.closed for strand in strands], 2)
    return Ends(points, tangents, closed, scene.radius, scene.config.merge, scene.gap_unit)


@dataclass(frozen=True)
class ContactCandidate:
    """A possible contact of two strands, and so a junction; or a possible link of two ends across a gap of a cloud.

    Attributes
    ----------
    gain
        cost of the best other explanation minus that of a junction or link, cost units; above 0 if these are likely.
    position
        (D,) m (px in 2-D), where the axes meet.
    bodies
        (strand, arc length) of each strand that runs through the junction.
    ends
        the ends at the junction. Bodies and ends are two together: an end that is attached to a strand, two strands that pass
        each other, or two ends that are linked across a gap.
    """

    gain: float
    position: Floats
    bodies: tuple[tuple[int, float], ...] = ()
    ends: tuple[End, ...] = ()

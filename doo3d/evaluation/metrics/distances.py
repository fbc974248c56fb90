"""Measure the distances of chains from the axes of the cables that they follow."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from ...types import Bools, Chain, Floats, Ints
from ..scenes.model import Truth
from .alignment import ChainAlignment, align_chain, axis_tolerance

OFF_RADII, MIN_OFF_DISTANCE = 1.5, 0.005
"""A chain is off a cable of radius r beyond max(1.5 r, 5 mm) from the axis where the cable is seen."""

WINDOW_SEGMENTS = 2
"""Distance along the axis, in segments, within which the axis sample nearest to a point is searched."""

SAMPLE_SPACING = 0.001
"""Greatest distance in m between the measured points of a chain."""


@dataclass(frozen=True)
class ChainDistances:
    """The distances of Q points of a chain from the axes of the cables that the chain follows.

    Attributes
    ----------
    distance
        (Q,) m from the axis; NaN where the chain follows no cable.
    seen
        (Q,) bool, whether the camera sees the cable there; True where the chain follows no cable.
    off
        (Q,) bool, whether the point is farther from the axis than allowed, or the chain follows no cable there.
    """

    distance: Floats
    seen: Bools
    off: Bools

    @property
    def off_fraction(self) -> float:
        """The fraction, 0 to 1, of the chain's points that are farther from the cable's axis than allowed, or on no cable."""
        return float(self.off.mean())


def measure_distances(chain: Chain, alignment: ChainAlignment, truths: tuple[Truth, ...]) -> ChainDistances:
    """Measure the distances of points along a chain from the axes of the cables that the chain follows.

    Parameters
    ----------
    chain
        the chain, joints in m, in the frame of the cables.
    alignment
        the alignment of `chain` with `truths`, from `align_chain`.
    truths
        the true cables.

    Returns
    -------
    ChainDistances
        for points at most 1 mm apart along the chain. A point is `off` beyond max(1.5 radii, 5 mm) where the cable is seen, and
        beyond max(2.5 radii, 10 mm, a fifth of the length of the hidden run) where it is hidden.
    """
    points, joint = sample_chain(chain)
    distance = np.full(len(points), np.nan)
    seen, off = np.ones(len(points), dtype=bool), np.ones(len(points), dtype=bool)
    for stretch in alignment.stretches:
        on = np.flatnonzero((joint >= stretch.joints[0] - 0.5) & (joint <= stretch.joints[-1] + 0.5))
        truth, arcs = truths[stretch.cable], np.interp(joint[on], stretch.joints, stretch.arcs)
        sample, offset, tangent = _nearest_on_axis(points[on], arcs, chain.segment_length, truth)
        along = np.clip(np.einsum("ij,ij->i", offset, tangent), -truth.spacing, truth.spacing)
        distance[on] = np.linalg.norm(offset - along[:, None] * tangent, axis=1)
        seen[on] = True if truth.seen is None else truth.seen[sample]
        limit = np.where(seen[on], max(OFF_RADII * truth.radius, MIN_OFF_DISTANCE), axis_tolerance(truth)[sample])
        off[on] = distance[on] > limit
    return ChainDistances(distance, seen, off)


def sample_chain(chain: Chain, first: int = 0, last: int | None = None) -> tuple[Floats, Floats]:
    """Return evenly spaced points along a chain from one joint to another, at most 1 mm apart.

    Parameters
    ----------
    chain
        the chain, joints in m.
    first, last
        indices of the joints where the points begin and end; `last` None stands for the chain's last joint.

    Returns
    -------
    points : (Q, 3) m, Q points.
    joint : (Q,) position of each point along the chain, in joints: 2.5 is halfway from joint 2 to joint 3.
    """
    last = len(chain.joints) - 1 if last is None else last
    per_segment = max(1, int(np.ceil(chain.segment_length / SAMPLE_SPACING)))
    joint = np.linspace(first, last, (last - first) * per_segment + 1)
    index = np.minimum(joint.astype(int), len(chain.joints) - 2)
    t = (joint - index)[:, None]
    return chain.joints[index] * (1 - t) + chain.joints[index + 1] * t, joint


def _nearest_on_axis(points: Floats, arcs: Floats, max_shift: float, truth: Truth) -> tuple[Ints, Floats, Floats]:
    """Return the axis sample nearest to each of K points, searched within `max_shift` (m) of the point's arc length.

    Returns
    -------
    sample : (K,) index of the axis sample.
    offset : (K, 3) m, from the sample to the point.
    tangent : (K, 3) unit tangent of the axis there.
    """
    spacing, count = truth.spacing, len(truth.axis)
    window = np.arange(-int(max_shift / spacing) - 2, int(max_shift / spacing) + 3)
    index = np.round(arcs / spacing).astype(int)[:, None] + window
    index = index % count if truth.closed else np.clip(index, 0, count - 1)
    distances = np.linalg.norm(truth.axis[index] - points[:, None], axis=-1)
    sample = index[np.arange(len(points)), distances.argmin(axis=1)]
    tangent = np.gradient(truth.axis, axis=0)[sample]
    return sample, points - truth.axis[sample], tangent / np.linalg.norm(tangent, axis=1, keepdims=True)


def joint_errors(chain: Chain, truths: Sequence[Truth]) -> Floats:
    """Return the distances in m of a chain's joints from the true axis, perpendicular to it.

    chain : the chain of N segments, m, in the camera's optical frame. truths : the true cables in the same frame.

    Returns
    -------
    (N + 1, 2) m, 0 or more: the parts across and along the ray from the camera to the joint; NaN for joints on no cable.
    """
    result = np.full((len(chain.joints), 2), np.nan)
    for stretch in align_chain(chain, tuple(truths)).stretches:
        joints = np.arange(stretch.joints.min(), stretch.joints.max() + 1)
        order = np.argsort(stretch.joints)
        arcs = np.interp(joints, stretch.joints[order], stretch.arcs[order])
        truth, points = truths[stretch.cable], chain.joints[joints]
        _, offset, tangent = _nearest_on_axis(points, arcs, WINDOW_SEGMENTS * chain.segment_length, truth)
        offset -= (offset * tangent).sum(axis=1, keepdims=True) * tangent
        ray = points / np.linalg.norm(points, axis=1, keepdims=True)
        along = (offset * ray).sum(axis=1, keepdims=True)
        result[joints] = np.column_stack((np.linalg.norm(offset - along * ray, axis=1), np.abs(along)))
    return result


def end_error(chain: Chain, truth: Truth) -> float:
    """Return the mean distance in mm of the two ends of a chain from the two tips of an open cable.

    Ends and tips are paired in the order with the smaller mean.
    """
    distances = cdist(chain.joints[[0, -1]], truth.axis[[0, -1]])
    return 1e3 * float(min(np.trace(distances), np.trace(distances[::-1]))) / 2


def rms_mm(parts: list[Floats]) -> float:
    """Return the root mean square, in mm, of the distances (m) in all arrays together.

    NaN and infinite values are left out; the result is NaN if no values are left.
    """
    values = np.concatenate([np.zeros(0), *parts])
    values = values[np.isfinite(values)]
    return 1e3 * float(np.sqrt((values**2).mean())) if len(values) else float("nan")

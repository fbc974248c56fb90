"""Measure by how much each joint of a chain misses the true axis, across and along the ray to it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...types import Chain, Floats, Ints
from ..scenes.model import Truth
from .alignment import Stretch, align_chain

WINDOW_SEGMENTS = 2
"""Segments from where a joint lies on a cable within which the nearest point of its axis is looked for."""


def joint_errors(chain: Chain, truths: Sequence[Truth], viewpoint: Floats | None = None) -> Floats:
    """Return the distances of a chain's joints from the true axis, without what lies along the axis.

    Parameters
    ----------
    chain
        the chain of N segments, m, in the frame of the cables.
    truths
        the true cables.
    viewpoint
        (3,) m, position of the sensor; None for the origin.

    Returns
    -------
    (N + 1, 2) m, 0 or more: the parts across and along the ray from the sensor to the joint; NaN for joints on no cable.
    """
    result = np.full((len(chain.joints), 2), np.nan)
    for stretch in align_chain(chain, tuple(truths)).stretches:
        joints = np.arange(stretch.joints.min(), stretch.joints.max() + 1)
        offset = _offsets(chain, joints, stretch, truths[stretch.cable])
        ray = chain.joints[joints] - (0.0 if viewpoint is None else viewpoint)
        ray /= np.linalg.norm(ray, axis=1, keepdims=True)
        along = (offset * ray).sum(axis=1, keepdims=True)
        result[joints] = np.column_stack((np.linalg.norm(offset - along * ray, axis=1), np.abs(along)))
    return result


def _offsets(chain: Chain, joints: Ints, stretch: Stretch, truth: Truth) -> Floats:
    """Return the vectors (K, 3) m from the nearest points of the axis to joints of a stretch, perpendicular to the axis."""
    order = np.argsort(stretch.joints)
    arcs = np.interp(joints, stretch.joints[order], stretch.arcs[order])
    reach = int(WINDOW_SEGMENTS * chain.segment_length / truth.spacing) + 1
    index = np.round(arcs / truth.spacing).astype(int)[:, None] + np.arange(-reach, reach + 1)
    index = index % len(truth.axis) if truth.closed else index.clip(0, len(truth.axis) - 1)
    points = chain.joints[joints]
    nearest = np.linalg.norm(truth.axis[index] - points[:, None], axis=2).argmin(axis=1)
    sample = index[np.arange(len(points)), nearest]
    tangent = np.gradient(truth.axis, axis=0)[sample]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    offset = points - truth.axis[sample]
    return np.asarray(offset - (offset * tangent).sum(axis=1, keepdims=True) * tangent)

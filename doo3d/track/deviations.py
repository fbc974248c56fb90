"""Estimate standard deviations of joints; they are larger where hidden."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..kernels import nearest
from ..types import Bools, Floats, Ints
from .objects import SequenceObject
from .observations import Observation
from .shape import Shape

WEIGHTS = np.array(((1.41, 0.954), (0.277, 0.0609)))
"""Weights, across and along the ray, of the two terms of `deviation_terms`, whose squares are added. Fitted by
docs/fit_deviations.py."""


def with_deviations(
    item: SequenceObject, shapes: Sequence[Shape | None], observations: Sequence[Observation], past_only: bool
) -> list[Shape | None]:
    """Return the shapes of an object with the standard deviations of their joints.

    Parameters
    ----------
    item
        the object.
    shapes
        its shape in each of T successive frames; None where it is missing.
    observations
        the observations of these frames.
    past_only
        whether the positions of hidden joints come from earlier frames only.
    """
    terms = deviation_terms(item, shapes, observations, past_only)
    if not len(terms):
        return list(shapes)
    deviations = np.sqrt(((terms * WEIGHTS) ** 2).sum(axis=2))
    return [shape and replace(shape, deviations=each) for shape, each in zip(shapes, deviations, strict=True)]


def deviation_terms(
    item: SequenceObject, shapes: Sequence[Shape | None], observations: Sequence[Observation], past_only: bool
) -> Floats:
    """Return the two terms of joint deviations in T frames, (T, M + 1, 2, 2) m.

    The first term is the pair of deviations, across and along the ray, that the frame gives to the nearest joint of its own
    chains; for a hidden joint those of the visible joints on both sides are interpolated. The second term is the distance of a
    hidden joint from what is known: half the harmonic mean of the length of object to the nearest visible joint and of the
    distance that the object moves until the joint is visible in another frame, plus one radius. Along the ray, all joints of a
    frame without depth count as hidden.

    Returns
    -------
    The terms of M + 1 joints; (0, 2) if no chain of the frames has deviations.
    """
    seen = np.array([np.zeros(item.segments + 1, dtype=bool) if shape is None else shape.seen for shape in shapes])
    own = [_own(shape, observation) for shape, observation in zip(shapes, observations, strict=True)]
    known = np.concatenate([np.zeros((0, 2)), *own])
    if not len(known):
        return known
    usual = np.median(known, axis=0)
    at = np.arange(item.segments + 1)
    base = np.empty((*seen.shape, 2))
    for k, values in enumerate(own):
        base[k] = np.column_stack([np.interp(at, at[seen[k]], column) for column in values.T]) if len(values) else usual
    radius = item.radius if np.isfinite(item.radius) else item.segment_length
    speed, away = _speed(shapes), np.empty_like(base)
    has_depth = np.array([shape is not None and shape.measured.any() for shape in shapes], dtype=bool)
    for axis, shown in enumerate((seen, seen & has_depth[:, None])):
        steps = np.minimum(_steps(shown.T).T, item.segments) * item.segment_length
        moved = radius + speed * np.minimum(_steps(shown, past_only), len(shown))
        away[..., axis] = np.where(shown, 0.0, steps * moved / (steps + moved))
    return np.stack((base, away), axis=2)


def _own(shape: Shape | None, observation: Observation) -> Floats:
    """Return the deviations (K, 2) m of a frame's own chains at the visible joints.

    Each joint takes those of the nearest joint of the chains; (0, 2) if there are none.
    """
    chains = [chain for chain in observation.detection.chains if chain.deviations is not None]
    if shape is None or not chains or not shape.seen.any():
        return np.zeros((0, 2))
    points = np.concatenate([chain.joints for chain in chains])
    index = nearest(shape.joints[shape.seen], points, math.inf)[1]
    return np.asarray(np.concatenate([chain.deviations for chain in chains])[index])


def _steps(seen: Bools, past_only: bool = False) -> Ints:
    """Return the distance in rows to the nearest True of each column, (R, C).

    seen : (R, C) bool. past_only : whether only earlier rows count. A column without True gives at least R.
    """
    rows = np.arange(len(seen))[:, None]
    never = 2 * len(seen)
    before = rows - np.maximum.accumulate(np.where(seen, rows, -never), axis=0)
    after = np.minimum.accumulate(np.where(seen, rows, 2 * never)[::-1], axis=0)[::-1] - rows
    return np.asarray(before if past_only else np.minimum(before, after))


def _speed(shapes: Sequence[Shape | None]) -> float:
    """Return the 90th percentile of the motion of visible joints per frame, m."""
    moves = [
        np.linalg.norm((after.joints - before.joints)[before.seen & after.seen], axis=1)
        for before, after in pairwise(shapes)
        if before is not None and after is not None
    ]
    moved = np.concatenate([np.zeros(0), *moves])
    return float(np.percentile(moved, 90)) if len(moved) else 0.0

"""What a perfect estimator would reach: one that knows the cable wherever the camera measured it, and no more."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...sequence.registration import exact_lengths, to_lengths
from ...types import Bools, Chain, Detection, Floats, Ints
from ..scenes.model import Truth
from .nodes import true_nodes

ORACLES = {"oracle-past": True, "oracle-both": False}
"""The perfect estimators, and whether they know earlier frames only."""


def oracle_detections(truths: Sequence[Truth], measured: Sequence[Bools], past_only: bool) -> list[Detection]:
    """Return the chain that a perfect estimator gives in every frame of a sequence.

    Parameters
    ----------
    truths
        the true open cable in each of T frames.
    measured
        for each frame the nodes that the sensor measured there, (K,) bool, as `measured_nodes` tells.
    past_only
        whether it knows earlier frames only, or later ones, too.

    Returns
    -------
    For each frame a detection with one chain of K - 1 equal segments, through the nodes of `oracle_nodes`.
    """
    true, seen = np.array([true_nodes(truth) for truth in truths]), np.array(measured)
    chains = []
    for truth, nodes, fixed, exact in zip(truths, oracle_nodes(true, seen, past_only), seen, true, strict=True):
        segment = float(np.linalg.norm(np.diff(exact, axis=0), axis=1).mean())
        joints = exact_lengths(to_lengths(nodes, segment, fixed), segment)
        hidden = ~(fixed[:-1] & fixed[1:])
        chains.append(Chain(joints, segment, truth.radius, occluded=hidden, from_time=hidden, id=0))
    return [Detection((chain,), frame=f"{k:04d}") for k, chain in enumerate(chains)]


def oracle_nodes(true: Floats, measured: Bools, past_only: bool) -> Floats:
    """Return the nodes that a perfect estimator knows.

    A node that is measured in a frame is known there. Another is where it was when it was last measured, and has moved since as
    the nodes have that are measured now, in between linearly, beyond the last one as that. If there are none, it moves on as it
    did between the last two frames, or keeps its place where later frames are known. With later frames, the same is done from
    the next frame in which it is measured, and both are averaged by how near they are in time. The first frame is known wholly,
    and with later frames the last.

    true : (T, K, 3) m, the nodes in T frames. measured : (T, K) bool. Returns (T, K, 3) m.
    """
    known = measured.copy()
    known[0] = True
    known[-1] |= not past_only
    frames, at = np.arange(len(true)), np.arange(true.shape[1])
    result = np.array(true, dtype=float)
    for t, k in np.argwhere(~known):
        last = frames[:t][known[:t, k]][-1]
        if past_only and not known[t].any():
            result[t, k] = result[t - 1, k] + (result[t - 1, k] - result[t - 2, k] if t > 1 else 0.0)
            continue
        result[t, k] = _carried(true, known[t], last, t, k, at)
        if not past_only:
            later = t + 1 + frames[: len(true) - t - 1][known[t + 1 :, k]][0]
            share = (t - last) / (later - last)
            result[t, k] = (1 - share) * result[t, k] + share * _carried(true, known[t], later, t, k, at)
    return result


def _carried(true: Floats, known: Bools, start: int, t: int, k: int, at: Ints) -> Floats:
    """Return the node k (3,) m of frame `start`, moved on to frame t as the nodes that are known there."""
    if not known.any():
        return np.asarray(true[start, k])
    moved = true[t, known] - true[start, known]
    return np.asarray(true[start, k] + [np.interp(k, at[known], column) for column in moved.T])

"""Measure over a sequence whether each node of a chain stays at the same point of the material.

Oracles give the limit that a perfect estimator could reach: one that knows the true cable wherever the camera measured it.
"""

from collections.abc import Sequence

import numpy as np

from ...track.registration import exact_lengths, relax_lengths
from ...track.rings import ring_joints
from ...types import Bools, Chain, Detection, Floats, Ints
from ..metrics.nodes import axis_points
from ..scenes.model import Truth

NODES = 50
"""Number of evenly spaced nodes of a chain that are compared with the material, whatever its number of segments."""

JUMP_RADII = 5.0
"""Distance, in radii, that a node must move against its material point since the frame before to count as a jump."""

ORACLES = {"oracle-past": True, "oracle-both": False}
"""Name of each perfect estimator -> whether it knows earlier frames only."""


def node_offsets(chains: Sequence[Chain | None], truths: Sequence[Truth], keeps_direction: bool) -> Floats:
    """Return the vector from each node's material point to the node, in every frame of a sequence, m.

    Parameters
    ----------
    chains
        the chain of the object in each of T frames; None where there is none. For a ring, only closed chains count.
    truths
        the true cable in each frame; its points start at the same tip, or the same material point of a ring, in all frames.
    keeps_direction
        True chooses the chain's direction, and the first node of a ring, once for all frames, with the least error. False chooses
        them in each frame.

    Returns
    -------
    (T, 50, 3) float64 m, the camera's optical frame; NaN in frames without a chain.
    """
    result = np.full((len(chains), NODES, 3), np.nan)
    placed = {
        frame: _ways(chain, truth.closed) - true_nodes(truth)
        for frame, (chain, truth) in enumerate(zip(chains, truths, strict=True))
        if chain is not None and (chain.closed or not truth.closed)
    }
    if placed:
        offsets = np.array(list(placed.values()))
        means = np.linalg.norm(offsets, axis=3).mean(axis=2)
        best = np.full(len(offsets), means.mean(axis=0).argmin()) if keeps_direction else means.argmin(axis=1)
        result[list(placed)] = offsets[np.arange(len(offsets)), best]
    return result


def _ways(chain: Chain, is_ring: bool) -> Floats:
    """Return the nodes of a chain in W orders, (W, 50, 3) m: both directions, and for a ring each first node."""
    if not is_ring:
        nodes = chain.nodes(NODES)
        return np.array([nodes, nodes[::-1]])
    both = (ring_joints(chain, is_reversed, 0.0, NODES)[:-1] for is_reversed in (False, True))
    return np.array([np.roll(nodes, start, axis=0) for nodes in both for start in range(NODES)])


def true_nodes(truth: Truth) -> Floats:
    """Return the material points where the nodes of a chain should be: (50, 3) m, evenly spaced along the axis."""
    return axis_points(truth, _arcs(truth))


def _arcs(truth: Truth) -> Floats:
    """Return the arc lengths of the nodes of a cable, (50,) m; the first node of a ring is not repeated."""
    return np.linspace(0.0, truth.length, NODES, endpoint=not truth.closed)


def measured_nodes(truth: Truth, depth: Floats) -> Bools:
    """Return which nodes of a cable the sensor measured, (50,) bool: those that the camera sees at a pixel with depth.

    truth : the cable as rendered. depth : (H, W) m, 0 = no reading.
    """
    arcs = _arcs(truth)
    if not (depth > 0).any():
        return np.zeros(NODES, dtype=bool)
    seen = np.ones(len(truth.axis), dtype=bool) if truth.seen is None else truth.seen
    result = seen[np.abs(truth.arcs[None] - arcs[:, None]).argmin(axis=1)]
    for start, end in truth.shiny:
        result &= (arcs < start) | (arcs > end)
    return np.asarray(result)


def find_jumps(offsets: Floats, radius: float) -> tuple[Bools, Bools]:
    """Find the jumps of nodes: moves that differ by more than 5 radii from those of their material points.

    Each frame is compared with the last earlier one with a chain, since a frame without a chain does not excuse a jump.

    Parameters
    ----------
    offsets
        (T, K, 3) m, from `node_offsets`.
    radius
        radius of the cable, m.

    Returns
    -------
    jumps : (T, K) bool.
    counted : (T,) bool, the frames that could be compared.
    """
    known = np.flatnonzero(np.isfinite(offsets[:, 0, 0]))
    jumps, counted = np.zeros(offsets.shape[:2], dtype=bool), np.zeros(len(offsets), dtype=bool)
    jumps[known[1:]] = np.linalg.norm(np.diff(offsets[known], axis=0), axis=2) > JUMP_RADII * radius
    counted[known[1:]] = True
    return jumps, counted


def oracle_detections(truths: Sequence[Truth], measured: Sequence[Bools], past_only: bool) -> list[Detection]:
    """Return the chain that a perfect estimator gives in every frame of a sequence.

    Parameters
    ----------
    truths
        the true open cable in each of T frames.
    measured
        which nodes the sensor measured in each frame, (K,) bool, from `measured_nodes`.
    past_only
        whether the estimator knows earlier frames only; otherwise also later ones.

    Returns
    -------
    For each frame a detection with one chain of K - 1 equal segments, through the nodes of `oracle_nodes`.
    """
    true, seen = np.array([true_nodes(truth) for truth in truths]), np.array(measured)
    chains = []
    for truth, nodes, fixed, exact in zip(truths, oracle_nodes(true, seen, past_only), seen, true, strict=True):
        segment = float(np.linalg.norm(np.diff(exact, axis=0), axis=1).mean())
        joints = exact_lengths(relax_lengths(nodes, segment, fixed), segment)
        hidden = ~(fixed[:-1] & fixed[1:])
        chains.append(Chain(joints, segment, truth.radius, occluded=hidden, from_time=hidden, id=0))
    return [Detection((chain,), frame=f"{k:04d}") for k, chain in enumerate(chains)]


def oracle_nodes(true: Floats, measured: Bools, past_only: bool) -> Floats:
    """Return the node positions of a perfect estimator, (T, K, 3) m.

    A node has its true position in frames that measure it. In other frames, its last measured position is moved as the nodes
    measured now have moved since: their motion is interpolated linearly along the cable, and constant beyond the outermost of
    them. If no node is measured, the node repeats its motion between the last two frames, or keeps its place if later frames are
    known. With later frames, the same is done from the next frame that measures the node, and both positions are averaged,
    weighted by nearness in time. The first frame is known completely; with later frames, so is the last.

    true : (T, K, 3) m, the nodes in T frames. measured : (T, K) bool.
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
    """Return node k of frame `start`, moved to frame t by the motion of the nodes that are known there: (3,) m."""
    if not known.any():
        return np.asarray(true[start, k])
    moved = true[t, known] - true[start, known]
    return np.asarray(true[start, k] + [np.interp(k, at[known], column) for column in moved.T])

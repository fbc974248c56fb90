"""Measure over a whole sequence whether every node of a chain stays the same point of the material."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...types import Bools, Chain, Floats
from ..metrics.nodes import axis_points
from ..scenes.model import Truth

NODES = 50
"""Evenly spaced nodes of a chain that are compared with the material, so that chains of all numbers of segments count alike."""

JUMP_RADII = 5.0
"""Radii; a node that moves farther than this against its point of the material, since the frame before, jumps."""


def node_offsets(chains: Sequence[Chain | None], truths: Sequence[Truth], keeps_direction: bool) -> Floats:
    """Return how far each node of an object is from its point of the material, in every frame of a sequence.

    Parameters
    ----------
    chains
        the chain of the object in each of T frames; None where there is none.
    truths
        the true open cable in each frame, whose points follow each other from the same tip in all of them.
    keeps_direction
        True if the chains have to run the same way in all frames: the better of the two ways counts. False: the better one in
        each frame by itself.

    Returns
    -------
    (T, 50, 3) float64 m, the camera's optical frame; NaN in frames without a chain.
    """
    both = np.full((2, len(chains), NODES, 3), np.nan)
    for frame, (chain, truth) in enumerate(zip(chains, truths, strict=True)):
        if chain is not None:
            found, true = chain.nodes(NODES), true_nodes(truth)
            both[:, frame] = found - true, found[::-1] - true
    known = np.array([chain is not None for chain in chains], dtype=bool)
    result = both[0]
    means = np.linalg.norm(both[:, known], axis=3).mean(axis=2)
    if keeps_direction:
        return np.asarray(both[int(np.argmin(means.mean(axis=1)))] if known.any() else result)
    result[known] = np.where((means[1] < means[0])[:, None, None], both[1, known], both[0, known])
    return np.asarray(result)


def true_nodes(truth: Truth) -> Floats:
    """Return the points of the material that the nodes of a chain should be at: (50, 3) m, evenly spaced along the axis."""
    return axis_points(truth, np.linspace(0.0, truth.length, NODES))


def measured_nodes(truth: Truth, depth: Floats) -> Bools:
    """Tell which nodes of a cable the sensor measured: seen by the camera, where depth is not lost.

    truth : the cable as rendered. depth : (H, W) m, 0 = none. Returns (50,) bool.
    """
    arcs = np.linspace(0.0, truth.length, NODES)
    if not (depth > 0).any():
        return np.zeros(NODES, dtype=bool)
    seen = np.ones(len(truth.axis), dtype=bool) if truth.seen is None else truth.seen
    result = seen[np.abs(truth.arcs[None] - arcs[:, None]).argmin(axis=1)]
    for start, end in truth.shiny:
        result &= (arcs < start) | (arcs > end)
    return np.asarray(result)


def find_jumps(offsets: Floats, radius: float) -> tuple[Bools, Bools]:
    """Tell where nodes jump: where they move by over 5 radii more, or less, than their point of the material.

    Each frame is compared with the last one before it that has a chain, since a frame without one does not excuse a jump.

    Parameters
    ----------
    offsets
        (T, K, 3) m, from `node_offsets`.
    radius
        of the cable, m.

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

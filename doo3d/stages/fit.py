"""Paths to chains of equal segments: the paper's Algorithm 2."""

from __future__ import annotations

import math

import numpy as np

from ..config import FitConfig
from ..geometry import steps
from ..types import Chain, Floats, Path


def fit(paths: list[Path], config: FitConfig) -> list[Chain]:
    """Chains of segments of exactly `segment_length`; a turn of more than `max_turn` degrees ends a chain.

    A closed path that makes one chain is walked back to its first point and gives a closed chain, whose last
    joint is then less than a segment from the first. Steps longer than a segment are divided: the algorithm lays at
    most one segment at each point and would fall behind.
    """
    chains: list[Chain] = []
    for path in paths:
        points = np.concatenate((path.points, path.points[:1])) if path.closed else path.points
        rows = [tuple(row) for row in _divided(points, config.segment_length).tolist()]
        found = traverse_contour(rows, config.segment_length, config.max_turn)
        closed = path.closed and len(found) == 1
        chains += [Chain(np.array(joints), config.segment_length, closed=closed) for joints in found]
    return chains


def _divided(points: Floats, length: float) -> Floats:
    """The polyline (P, D) with points added so that no step is longer than `length`."""
    parts = np.maximum(1, np.ceil(steps(points) / length)).astype(int)
    if (parts == 1).all():
        return points
    at = np.concatenate([*(i + np.arange(count) / count for i, count in enumerate(parts)), [len(parts)]])
    return np.column_stack([np.interp(at, np.arange(len(points)), column) for column in points.T])


def traverse_contour(points: list[tuple[float, ...]], length: float, max_turn: float) -> list[list[tuple[float, ...]]]:
    """Algorithm 2 on ordered points of any dimension: the joints of each chain, in the order they were found.

    The names are the paper's: p_s start of the current segment, p_c point being traversed, p_e its end, p_t the
    tip: the farthest point from p_s so far, from which a new chain starts after a sharp turn.
    """
    collection: list[list[tuple[float, ...]]] = []
    p_s = p_t = points[0]
    chain: list[tuple[float, ...]] = []
    update_tip = True
    least = math.cos(math.radians(max_turn))
    for p_c in points:
        distance = math.dist(p_c, p_s)
        if distance >= length:
            p_e = tuple(s + (c - s) * length / distance for s, c in zip(p_s, p_c, strict=True))
            if not chain or _cosine(chain[-2], chain[-1], p_s, p_e) >= least:
                chain = chain or [p_s]
                chain.append(p_e)
                p_s = p_t = p_e
            else:
                collection.append(chain)
                chain = []
                p_s = p_t
            update_tip = True
        elif distance >= math.dist(p_t, p_s):
            if update_tip:
                p_t = p_c
        else:
            update_tip = False
    return [*collection, chain] if chain else collection


def _cosine(a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...], d: tuple[float, ...]) -> float:
    """Cosine of the angle between a -> b and c -> d."""
    dot = sum((q - p) * (s - r) for p, q, r, s in zip(a, b, c, d, strict=True))
    return dot / (math.dist(a, b) * math.dist(c, d))

"""Cut strands where one frame joined parts that do not go on in each other on the object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.distance import cdist
import os
from ..types import Floats
from .observations import CUT_OFF, LENGTH_ERROR, ObservedStrand

CUT_COST = float(os.environ.get("CUT","50"))
JOIN_COST = float(os.environ.get("JOIN","50"))
MOST = 25.0


def cut_misjoined(strands: Sequence[ObservedStrand], dense: Floats, step: float, length: float, least: float) -> list[ObservedStrand]:
    result = []
    for strand in strands:
        result += _parts(strand, dense, step, length, least)
    return result


def _parts(strand: ObservedStrand, dense: Floats, step: float, length: float, least: float) -> list[ObservedStrand]:
    known = np.ones(len(strand.points), dtype=bool) if strand.sight is None else ~strand.sight.any(axis=1)
    at = np.flatnonzero(known)
    if len(at) < 4:
        return [strand]
    points, arcs = strand.points[at], strand.arcs[at]
    squares = np.minimum(cdist(points, dense, "sqeuclidean") / (LENGTH_ERROR * length) ** 2, MOST)
    count, size = len(at), len(dense)
    along = np.rint(arcs / step).astype(int)
    whole = int(round(strand.length / step))
    forward = np.arange(-whole, size)[None, :] + along[:, None]
    backward = np.arange(0, size + whole)[None, :] - along[:, None]
    index = np.hstack((forward, backward))
    inside = (index >= 0) & (index < size)
    cost = np.where(inside, squares[np.arange(count)[:, None], np.clip(index, 0, size - 1)], MOST)
    joins = np.zeros(count, dtype=bool)
    for j in strand.joins:
        k=int(np.searchsorted(arcs, j)); joins[max(0,k-2):k+3]=True
    total = cost[0].copy()
    came = np.zeros(cost.shape, dtype=np.int64)
    came[0] = np.arange(cost.shape[1])
    for k in range(1, count):
        best = int(np.argmin(total))
        jump = total[best] + (JOIN_COST if joins[k] else CUT_COST)
        jumped = total > jump
        came[k] = np.where(jumped, best, np.arange(cost.shape[1]))
        total = np.where(jumped, jump, total) + cost[k]
    state = int(np.argmin(total))
    states = np.empty(count, dtype=int)
    for k in range(count - 1, -1, -1):
        states[k] = state
        state = int(came[k, state])
    edges = np.flatnonzero(np.diff(states)) + 1
    if not len(edges):
        return [strand]
    firsts = [0, *at[edges].tolist()]
    lasts = [*at[edges - 1].tolist(), len(strand.points) - 1]
    result = []
    for first, last in zip(firsts, lasts):
        low = 0.0 if first == 0 else float(strand.arcs[first])
        high = strand.length if last == len(strand.points) - 1 else float(strand.arcs[last])
        if last == first or high - low < least:
            continue
        tips = (strand.tips[0] if first == 0 else CUT_OFF, strand.tips[1] if last == len(strand.points) - 1 else CUT_OFF)
        part = slice(first, last + 1)
        result.append(replace(strand, points=strand.points[part], arcs=strand.arcs[part] - low, length=high - low, tips=tips,
                              sight=None if strand.sight is None else strand.sight[part]))
    return result

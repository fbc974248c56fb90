"""Gaps closed by tangent arcs and lines (paper, section III-G: connecting two chains)."""

from __future__ import annotations

import numpy as np

from ..config import FillConfig
from ..geometry.arcs import tangent_path
from ..kernels.equal_chords import lay_equal_chords
from ..types import Assembly, Path
from . import FrameContext


def fill(assemblies: list[Assembly], context: FrameContext, config: FillConfig) -> list[Path]:
    """Each assembly as one path; `filled` says which of its steps are new and which bridge at least a segment.

    New segments of `segment_length` follow the arcs, each joint on the curve at that distance from the one before
    (the paper's rule for a constant turn radius); the last one is as long as what remains of the gap. Gaps shorter
    than a segment, of which pruning leaves many, count as seen (paper, section III-H).
    """
    return [_fill_one(assembly, config) for assembly in assemblies]


def _fill_one(assembly: Assembly, config: FillConfig) -> Path:
    length = assembly.segment_length
    points, filled = [assembly.pieces[0]], [np.zeros(len(assembly.pieces[0]) - 1, dtype=bool)]
    middles: list[int] = []
    following = [*assembly.pieces[1:], *([assembly.pieces[0]] if assembly.closed else [])]
    for i, (piece, heading) in enumerate(zip(following, assembly.headings, strict=True)):
        start, end = points[-1][-1], piece[0]
        gap = float(np.linalg.norm(end - start))
        way = tangent_path(start, heading[0], end, heading[1], length / 20, inside=config.side == "inside")
        joints = lay_equal_chords(way, length)[0][1:]
        if len(joints) and np.linalg.norm(joints[-1] - end) < 1e-9 * length:
            joints = joints[:-1]
        last = assembly.closed and i == len(assembly.pieces) - 1
        middles.append(sum(map(len, filled)) + len(joints) // 2)
        points += [joints] if last else [joints, piece]
        filled.append(np.full(len(joints) + 1, gap >= length))
        if not last:
            filled.append(np.zeros(len(piece) - 1, dtype=bool))
    joins = tuple(zip(middles, assembly.confidence, strict=False))
    return Path(np.concatenate([part for part in points if len(part)]), assembly.closed, np.concatenate(filled), joins)

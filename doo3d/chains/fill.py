"""Close gaps by segments along their gap paths (Keipour et al., RA-L 2022, section III-G)."""

from collections.abc import Sequence

import numpy as np

from ..geometry.assembly import Assembly
from ..geometry.gap_path import GapPath
from ..kernels import lay_equal_chords
from ..types import Floats, Path
from ..types.stopwatch import timed

POINTS_PER_SEGMENT = 20
"""Points of a gap path per segment: on an arc of one segment's radius they lie within 0.03 % of it."""

SAME_JOINT = 1e-9
"""Segments within which the last new joint and the end of the gap are one joint."""


@timed("fill")
def fill(assemblies: Sequence[Assembly], length: float) -> list[Path]:
    """Join the pieces of each object to one polyline, with new joints across the gaps.

    The new joints lie on the gap path (arc, line, arc), each at the straight distance `length` from the one
    before; the last step across a gap is shorter. See Keipour et al. (RA-L 2022), section III-G.

    Parameters
    ----------
    assemblies
        the pieces of each object, in order, with the paths across the gaps between them.
    length
        of the segments, m (px in 2-D).

    Returns
    -------
    One polyline per object, in the order given, m (px in 2-D). Its `filled` is True for the steps across gaps of at least a
    segment; the step across a shorter gap counts as seen (section III-H).
    """
    return [_fill_one(assembly, length) for assembly in assemblies]


def _fill_one(assembly: Assembly, length: float) -> Path:
    """Return an assembly as one path."""
    pieces = assembly.pieces
    points, filled = [pieces[0]], [np.zeros(len(pieces[0]) - 1, dtype=bool)]
    middles: list[int] = []
    for i, path in enumerate(assembly.gap_paths):
        piece = pieces[(i + 1) % len(pieces)]
        gap = float(np.linalg.norm(piece[0] - pieces[i][-1]))
        joints = _new_joints(path, piece[0], length)
        middles.append(sum(map(len, filled)) + len(joints) // 2)
        points.append(joints)
        filled.append(np.full(len(joints) + 1, gap >= length))
        if i + 1 < len(pieces):
            points.append(piece)
            filled.append(np.zeros(len(piece) - 1, dtype=bool))
    joins = tuple(zip(middles, assembly.confidence, strict=False))
    return Path(np.concatenate([part for part in points if len(part)]), assembly.closed, np.concatenate(filled), joins)


def _new_joints(path: GapPath, end: Floats, length: float) -> Floats:
    """Return the joints, (N, D) m (px in 2-D), a segment apart along a gap path, between its start and its end (D,)."""
    joints: Floats = lay_equal_chords(path.points(length / POINTS_PER_SEGMENT), length)[0][1:]
    if len(joints) and np.linalg.norm(joints[-1] - end) < SAME_JOINT * length:
        return joints[:-1]
    return joints

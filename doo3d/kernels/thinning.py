"""Topological thinning over occupied voxels only.

A voxel may go when it is simple: its 26 neighbours hold exactly one 26-connected piece of the object, and its
18 neighbours exactly one 6-connected piece of the background that touches one of its faces (Bertrand and
Malandain, Pattern Recognition Letters 15, 1994). Six directions take turns, and every deletion is checked
again at its time (Lee, Kashyap, Chu, CVGIP 56, 1994), so the number of components, of loops and of cavities
stays as it was. The cost grows with the number of voxels, not with the box they lie in.
"""

from __future__ import annotations

import numba
import numpy as np

from ..types import Bools, Ints

OFFSETS = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)])
"""(26, 3) the neighbours in lexicographic order; neighbour 25 - n is opposite to neighbour n."""

_STEP = np.abs(OFFSETS[:, None, :] - OFFSETS[None, :, :])
_IN_18 = np.abs(OFFSETS).sum(axis=1) <= 2
_FACES = np.abs(OFFSETS).sum(axis=1) == 1
_BITS = 1 << np.arange(26, dtype=np.int64)

_NEAR_26 = np.array([_BITS[(row.max(axis=1) == 1)].sum() for row in _STEP])
_NEAR_6_IN_18 = np.array(
    [_BITS[(row.sum(axis=1) == 1) & _IN_18].sum() if inside else 0 for row, inside in zip(_STEP, _IN_18, strict=True)]
)
_MASK_18 = int(_BITS[_IN_18].sum())
_MASK_FACES = int(_BITS[_FACES].sum())
_ODD = (np.abs(OFFSETS) @ np.array([4, 2, 1])).astype(np.int64)
_DIRECTIONS = np.array([int(np.flatnonzero((OFFSETS == face).all(axis=1))[0]) for face in
                        ((0, 0, -1), (0, 0, 1), (0, -1, 0), (0, 1, 0), (-1, 0, 0), (1, 0, 0))])  # fmt: skip


@numba.njit(cache=True)
def link_neighbors(keys, strides):  # type: ignore[no-untyped-def]
    """Neighbour table of sorted voxel keys.

    keys : (M,) int64, ascending. strides : (26,) int64, what each neighbour adds to a key (the box is padded, so
    no neighbour wraps round). Returns (M, 26) int32, the neighbour's index or -1.
    """
    count = keys.size
    table = np.full((count, 26), -1, np.int32)
    for n in range(13, 26):
        j = 0
        for i in range(count):
            wanted = keys[i] + strides[n]
            while j < count and keys[j] < wanted:
                j += 1
            if j < count and keys[j] == wanted:
                table[i, n] = j
                table[j, 25 - n] = i
    return table


@numba.njit(cache=True)
def _pieces(cells, near, seeds):  # type: ignore[no-untyped-def]
    """How many connected pieces of the bit set `cells` hold a bit of `seeds`; stops counting at 2."""
    pieces = 0
    left = cells & seeds
    while left:
        frontier = left & -left
        piece = frontier
        while frontier:
            reach = np.int64(0)
            for n in range(26):
                if (frontier >> n) & 1:
                    reach |= near[n]
            frontier = reach & cells & ~piece
            piece |= frontier
        pieces += 1
        if pieces == 2:
            return pieces
        left &= ~piece
    return pieces


@numba.njit(cache=True)
def _simple(bits):  # type: ignore[no-untyped-def]
    return _pieces(bits, _NEAR_26, bits) == 1 and _pieces(~bits & _MASK_18, _NEAR_6_IN_18, _MASK_FACES) == 1


@numba.njit(cache=True)
def _curve_end(bits):  # type: ignore[no-untyped-def]
    return bits & (bits - 1) == 0


@numba.njit(cache=True)
def _fields(table):  # type: ignore[no-untyped-def]
    """(M,) which of 8 fields each voxel belongs to: whether it lies an odd number of steps in x, y, z from its piece's first."""
    field = np.full(table.shape[0], -1, np.int64)
    stack = np.empty(table.shape[0], np.int64)
    for seed in range(table.shape[0]):
        if field[seed] >= 0:
            continue
        field[seed] = 0
        stack[0] = seed
        size = 1
        while size:
            size -= 1
            i = stack[size]
            for n in range(26):
                j = table[i, n]
                if j >= 0 and field[j] < 0:
                    field[j] = field[i] ^ _ODD[n]
                    stack[size] = j
                    size += 1
    return field


@numba.njit(cache=True)
def thin_voxels(table):  # type: ignore[no-untyped-def]
    """Which voxels are the curve skeleton.

    Of the voxels that a direction uncovers no two neighbours are in the same field, and the fields take turns: one after
    the other in the order of their places, each deletion would uncover the next, and eat a strip from end to end.

    table : (M, 26) int32 as `link` returns it. Returns (M,) bool.
    """
    count = table.shape[0]
    alive = np.ones(count, np.bool_)
    bits = np.zeros(count, np.int64)
    for i in range(count):
        for n in range(26):
            if table[i, n] >= 0:
                bits[i] |= np.int64(1) << n
    stale = np.ones(count, np.bool_)  # its neighbours changed since it was last found not to be deletable
    field = _fields(table)
    chosen = np.empty(count, np.int64)
    changed = True
    while changed:
        changed = False
        for d in range(6):
            face = _DIRECTIONS[d]
            size = 0
            for i in range(count):
                if not stale[i] or (bits[i] >> face) & 1:
                    continue
                if _curve_end(bits[i]) or not _simple(bits[i]):
                    stale[i] = False
                    continue
                chosen[size] = i
                size += 1
            for c in range(8 * size):
                i = chosen[c % size]
                if field[i] != c // size:
                    continue
                if _curve_end(bits[i]) or not _simple(bits[i]):
                    stale[i] = False
                    continue
                alive[i] = False
                stale[i] = False
                changed = True
                for n in range(26):
                    j = table[i, n]
                    if j >= 0:
                        bits[j] &= ~(np.int64(1) << (25 - n))
                        stale[j] = alive[j]
    return alive


def neighbor_table(coords: Ints) -> Ints:
    """The neighbour table of voxels.

    coords : (M, 3) int64 >= 1 in lexicographic order. Returns (M, 26) int32, indices into coords or -1.
    """
    shape = coords.max(axis=0) + 2 if len(coords) else np.ones(3, dtype=np.int64)
    weight = np.array([shape[1] * shape[2], shape[2], 1], dtype=np.int64)
    table: Ints = link_neighbors(coords @ weight, OFFSETS @ weight)
    return table


def skeletonize(coords: Ints) -> Bools:
    """(M, 3) int64 voxels >= 1 in lexicographic order -> (M,) bool, which of them thinning leaves."""
    kept: Bools = thin_voxels(neighbor_table(coords))
    return kept

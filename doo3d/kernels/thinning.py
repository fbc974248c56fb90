"""Topological thinning of voxels to a curve skeleton, over the occupied voxels only (Lee, Kashyap, Chu, CVGIP 56, 1994).

A voxel may be deleted when it is simple: its 26 neighbors hold exactly one 26-connected piece of the object, and its
18 neighbors exactly one 6-connected piece of the background that touches one of its faces (Bertrand and
Malandain, Pattern Recognition Letters 15, 1994). Six directions take turns, and every deletion is checked
again at its time, so the numbers of components, of loops and of cavities stay. The time grows with the number of voxels, not
with the box they lie in.

A neighborhood is a bit set: bit n of an int64 is neighbor n, in the order of OFFSETS.
"""

from __future__ import annotations

import numba
import numpy as np

from ..types import Bools, Ints
from ._jit import helper

OFFSETS = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)])
"""(26, 3) steps to the neighbors in lexicographic order; neighbor 25 - n is opposite to neighbor n."""

_STEP = np.abs(OFFSETS[:, None, :] - OFFSETS[None, :, :])
_IN_18 = np.abs(OFFSETS).sum(axis=1) <= 2
_FACES = np.abs(OFFSETS).sum(axis=1) == 1
_BITS = 1 << np.arange(26, dtype=np.int64)

_ADJACENT_26 = np.array([_BITS[(row.max(axis=1) == 1)].sum() for row in _STEP])
"""(26,) bit sets: the neighbors that are 26-adjacent to each neighbor."""

_ADJACENT_6_IN_18 = np.array(
    [_BITS[(row.sum(axis=1) == 1) & _IN_18].sum() if inside else 0 for row, inside in zip(_STEP, _IN_18, strict=True)]
)
"""(26,) bit sets: the neighbors among the 18 that are 6-adjacent to each neighbor."""

_MASK_18 = int(_BITS[_IN_18].sum())
_MASK_FACES = int(_BITS[_FACES].sum())

_PARITY = (np.abs(OFFSETS) @ np.array([4, 2, 1])).astype(np.int64)
"""(26,) 3-bit numbers: the axes along which the step to each neighbor is odd."""

_DIRECTIONS = np.array([int(np.flatnonzero((OFFSETS == face).all(axis=1))[0]) for face in
                        ((0, 0, -1), (0, 0, 1), (0, -1, 0), (0, 1, 0), (-1, 0, 0), (1, 0, 0))])  # fmt: skip
"""(6,) the neighbors beyond each face, in the order in which the directions take turns."""


@numba.njit(cache=True)
def link_neighbors(keys, strides):  # type: ignore[no-untyped-def]
    """Return the neighbor table of sorted voxel keys.

    A neighbor at a fixed step has its key at a fixed difference, so one pass over the keys with two pointers links all voxels in
    that direction; the opposite direction comes with it.

    keys : (M,) int64, ascending, the index of each voxel in a box padded by one, so that no neighbor wraps round.
    strides : (26,) int64, the difference of the keys to each neighbor. Returns (M, 26) int32, the neighbor's index or -1.
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


@helper
def _count_pieces(cells, adjacent, seeds):  # type: ignore[no-untyped-def]
    """Count the connected pieces of the bit set `cells` that hold a bit of `seeds`; stop at 2."""
    pieces = 0
    rest = cells & seeds
    while rest:
        frontier = rest & -rest
        piece = frontier
        while frontier:
            reach = np.int64(0)
            for n in range(26):
                if (frontier >> n) & 1:
                    reach |= adjacent[n]
            frontier = reach & cells & ~piece
            piece |= frontier
        pieces += 1
        if pieces == 2:
            return pieces
        rest &= ~piece
    return pieces


@numba.njit(cache=True)
def _is_simple(bits):  # type: ignore[no-untyped-def]
    """Return whether a voxel with these neighbors can be deleted without a change of the topology."""
    return _count_pieces(bits, _ADJACENT_26, bits) == 1 and _count_pieces(~bits & _MASK_18, _ADJACENT_6_IN_18, _MASK_FACES) == 1


@helper
def _is_deletable(bits):  # type: ignore[no-untyped-def]
    """Return whether a voxel is simple and no end of a curve, which has one neighbor or none."""
    return bits & (bits - 1) != 0 and _is_simple(bits)


@helper
def _neighbor_bits(table):  # type: ignore[no-untyped-def]
    """Return the neighborhood of each voxel as a bit set, (M,) int64."""
    bits = np.zeros(table.shape[0], np.int64)
    for i in range(table.shape[0]):
        for n in range(26):
            if table[i, n] >= 0:
                bits[i] |= np.int64(1) << n
    return bits


@helper
def _subgrids(table):  # type: ignore[no-untyped-def]
    """Return the sub-grid of each voxel, (M,) int64 0 to 7: the parities of its steps in x, y, z from its component's first."""
    subgrid = np.full(table.shape[0], -1, np.int64)
    stack = np.empty(table.shape[0], np.int64)
    for seed in range(table.shape[0]):
        if subgrid[seed] >= 0:
            continue
        subgrid[seed] = 0
        stack[0] = seed
        size = 1
        while size:
            size -= 1
            i = stack[size]
            for n in range(26):
                j = table[i, n]
                if j >= 0 and subgrid[j] < 0:
                    subgrid[j] = subgrid[i] ^ _PARITY[n]
                    stack[size] = j
                    size += 1
    return subgrid


@helper
def _collect(bits, stale, face, chosen):  # type: ignore[no-untyped-def]
    """Fill `chosen` with the deletable voxels whose neighbor beyond a face is missing; return how many there are."""
    size = 0
    for i in range(bits.size):
        if not stale[i] or (bits[i] >> face) & 1:
            continue
        if _is_deletable(bits[i]):
            chosen[size] = i
            size += 1
        else:
            stale[i] = False
    return size


@helper
def _delete(chosen, size, subgrid, table, bits, stale, alive):  # type: ignore[no-untyped-def]
    """Delete those of the first `size` chosen voxels that still may be, by sub-grids; return whether there was one."""
    changed = False
    for c in range(8 * size):
        i = chosen[c % size]
        if subgrid[i] != c // size:
            continue
        stale[i] = False
        if not _is_deletable(bits[i]):
            continue
        alive[i] = False
        changed = True
        for n in range(26):
            j = table[i, n]
            if j >= 0:
                bits[j] &= ~(np.int64(1) << (25 - n))
                stale[j] = alive[j]
    return changed


@numba.njit(cache=True)
def thin_voxels(table):  # type: ignore[no-untyped-def]
    """Return which voxels are the curve skeleton (Lee-Kashyap-Chu thinning with sub-grids).

    In each of six directions collect the voxels that are exposed in that direction and may be deleted, then delete them in
    8 interleaved sub-grids, so that no two neighbors are tested one right after the other; each is checked again at its time.
    Deleting in index order would erode a strip from one end: each deletion would expose the next voxel. A voxel that was found
    not deletable is not tested again until one of its neighbors is deleted, which saves most of the tests.

    table : (M, 26) int32 as `link_neighbors` returns it. Returns (M,) bool.
    """
    count = table.shape[0]
    alive = np.ones(count, np.bool_)
    stale = np.ones(count, np.bool_)  # a neighbor was deleted since the voxel was last found not deletable
    bits = _neighbor_bits(table)
    subgrid = _subgrids(table)
    chosen = np.empty(count, np.int64)
    changed = True
    while changed:
        changed = False
        for face in _DIRECTIONS:
            size = _collect(bits, stale, face, chosen)
            if size and _delete(chosen, size, subgrid, table, bits, stale, alive):
                changed = True
    return alive


def neighbor_table(coords: Ints) -> Ints:
    """Return the neighbor table of voxels.

    coords : (M, 3) int64 >= 1 in lexicographic order. Returns (M, 26) int32, indices into coords or -1.
    """
    shape = coords.max(axis=0) + 2 if len(coords) else np.ones(3, dtype=np.int64)
    weight = np.array([shape[1] * shape[2], shape[2], 1], dtype=np.int64)
    table: Ints = link_neighbors(coords @ weight, OFFSETS @ weight)
    return table


def skeletonize(coords: Ints) -> Bools:
    """Return which of the voxels (M, 3) int64 >= 1, in lexicographic order, are the curve skeleton: (M,) bool."""
    kept: Bools = thin_voxels(neighbor_table(coords))
    return kept

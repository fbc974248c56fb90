"""Thinning of a mask to lines one pixel wide.

Zhang and Suen's two sub-iterations (CACM 27, 1984), with every deletion checked again at its time: the original deletes in
parallel and can lose small blobs and leave lines two pixels wide; so, connected stays connected.
"""

from __future__ import annotations

import numba
import numpy as np

_ROUND = ((-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1))
"""The neighbours P2 to P9 of the paper: clockwise from above."""


def _tables() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For each of the 256 neighbourhoods: deletable in the first and in the second sub-iteration; simple and no end.

    Simple: exactly one 8-connected piece of the object among the neighbours, and one 4-connected piece of background
    that touches a side (the Yokoi number is 1).
    """
    bits = (np.arange(256)[:, None] >> np.arange(8)) & 1
    following = np.roll(bits, -1, axis=1)
    set_, rises = bits.sum(axis=1), ((bits == 0) & (following == 1)).sum(axis=1)
    base = (set_ >= 2) & (set_ <= 6) & (rises == 1)
    p2, p4, p6, p8 = bits[:, 0], bits[:, 2], bits[:, 4], bits[:, 6]
    first = base & (p2 * p4 * p6 == 0) & (p4 * p6 * p8 == 0)
    second = base & (p2 * p4 * p8 == 0) & (p2 * p6 * p8 == 0)
    clear = 1 - bits
    yokoi = sum(clear[:, k] * (1 - clear[:, (k + 1) % 8] * clear[:, (k + 2) % 8]) for k in (0, 2, 4, 6))
    return first, second, (yokoi == 1) & (set_ > 1)


_FIRST, _SECOND, _FREE = _tables()
_DELETABLE = np.array((_FIRST, _SECOND))


@numba.njit(cache=True)
def _delete(codes, pixels, offsets):  # type: ignore[no-untyped-def]
    """Delete those of the pixels, one after the other, that still may go; whether there was one."""
    changed = False
    for at in pixels:
        if _FREE[codes[at]]:
            codes[at] = 0
            changed = True
            for k in range(8):
                codes[at - offsets[k]] &= ~(1 << k)
    return changed


@numba.njit(cache=True)
def thin_pixels(coords):  # type: ignore[no-untyped-def]
    """Which pixels of a mask are its skeleton, lines one pixel wide.

    Every pixel has a code, which of its neighbours are there, kept up to date with every deletion. What is deleted, or
    alone, has the code 0, and nothing becomes alone: what has one neighbour keeps it.

    coords : (M, 2) int64 >= 1 in lexicographic order. Returns (M,) bool.
    """
    width = coords[:, 1].max() + 2
    offsets = np.empty(8, np.int64)
    for k in range(8):
        offsets[k] = _ROUND[k][0] * width + _ROUND[k][1]
    places = coords[:, 0] * width + coords[:, 1]
    codes = np.zeros((coords[-1, 0] + 2) * width, np.uint8)
    for at in places:
        for k in range(8):
            codes[at - offsets[k]] |= 1 << k
    alone = codes[places] == 0
    active, chosen = places.astype(np.int32), np.empty(places.size, np.int32)
    size = places.size
    changed = True
    while changed:
        changed = False
        for half in range(2):
            table = _DELETABLE[half]
            left, count = 0, 0
            for a in range(size):
                at = active[a]
                code = codes[at]
                active[left] = at
                left += code != 0
                chosen[count] = at
                count += table[code]
            size = left
            changed |= _delete(codes, chosen[:count], offsets)
    _delete(codes, active[:size], offsets)  # corners of staircases
    return alone | (codes[places] != 0)

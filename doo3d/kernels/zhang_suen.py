"""Zhang-Suen thinning of a mask to lines one pixel wide, with every deletion checked again.

The two sub-iterations are those of the paper (Zhang and Suen, CACM 27, 1984). The original deletes in parallel and can lose small
blobs and leave lines two pixels wide; with the check at each deletion connected stays connected, and holes stay holes.

A neighborhood is a bit set: bit k of a uint8 is neighbor k, in the order of _RING. The rules are tables of 256 entries.
"""

from __future__ import annotations

import numba
import numpy as np

from ._jit import helper

_RING = ((-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1))
"""(row, column) steps to the neighbors P2 to P9 of the paper: clockwise from above."""


def _tables() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the rules for the 256 neighborhoods: deletable in the first and in the second sub-iteration; simple and no end.

    Simple: exactly one 8-connected piece of the object among the neighbors, and one 4-connected piece of background
    that touches a side (the Yokoi number is 1).
    """
    bits = (np.arange(256)[:, None] >> np.arange(8)) & 1
    following = np.roll(bits, -1, axis=1)
    count, rises = bits.sum(axis=1), ((bits == 0) & (following == 1)).sum(axis=1)
    base = (count >= 2) & (count <= 6) & (rises == 1)
    p2, p4, p6, p8 = bits[:, 0], bits[:, 2], bits[:, 4], bits[:, 6]
    first = base & (p2 * p4 * p6 == 0) & (p4 * p6 * p8 == 0)
    second = base & (p2 * p4 * p8 == 0) & (p2 * p6 * p8 == 0)
    clear = 1 - bits
    yokoi = sum(clear[:, k] * (1 - clear[:, (k + 1) % 8] * clear[:, (k + 2) % 8]) for k in (0, 2, 4, 6))
    return first, second, (yokoi == 1) & (count > 1)


_FIRST, _SECOND, _SIMPLE = _tables()
_DELETABLE = np.array((_FIRST, _SECOND))


@helper
def _delete(codes, pixels, offsets):  # type: ignore[no-untyped-def]
    """Delete the pixels that still are simple, one after the other; return whether there was one."""
    changed = False
    for pixel in pixels:
        if _SIMPLE[codes[pixel]]:
            codes[pixel] = 0
            changed = True
            for k in range(8):
                codes[pixel - offsets[k]] &= ~(1 << k)
    return changed


@numba.njit(cache=True)
def thin_pixels(coords):  # type: ignore[no-untyped-def]
    """Return which pixels of a mask are its skeleton, lines one pixel wide.

    Every pixel of the box has a code, its neighborhood as a bit set, which every deletion updates. A sub-iteration collects the
    pixels with a deletable code and then deletes them. A deleted pixel has the code 0, and so has one without neighbors, which
    stays; a pixel never loses its last neighbor. The two sub-iterations repeat until none deletes; a last pass takes the corners
    of staircases.

    coords : (N, 2) int64 >= 1 in lexicographic order. Returns (N,) bool.
    """
    width = coords[:, 1].max() + 2
    offsets = np.empty(8, np.int64)
    for k in range(8):
        offsets[k] = _RING[k][0] * width + _RING[k][1]
    pixels = coords[:, 0] * width + coords[:, 1]
    codes = np.zeros((coords[-1, 0] + 2) * width, np.uint8)
    for pixel in pixels:
        for k in range(8):
            codes[pixel - offsets[k]] |= 1 << k
    isolated = codes[pixels] == 0
    active, chosen = pixels.astype(np.int32), np.empty(pixels.size, np.int32)
    size = pixels.size
    changed = True
    while changed:
        changed = False
        for iteration in range(2):
            deletable = _DELETABLE[iteration]
            kept, count = 0, 0
            for a in range(size):
                pixel = active[a]
                code = codes[pixel]
                active[kept] = pixel
                kept += code != 0
                chosen[count] = pixel
                count += deletable[code]
            size = kept
            changed |= _delete(codes, chosen[:count], offsets)
    _delete(codes, active[:size], offsets)
    return isolated | (codes[pixels] != 0)

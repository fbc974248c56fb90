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
    """For each of the 256 neighbourhoods: deletable in the first and in the second sub-iteration, and simple.

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
    return first, second, yokoi == 1


_FIRST, _SECOND, _SIMPLE = _tables()


@numba.njit(cache=True)
def _code(image, row, column):  # type: ignore[no-untyped-def]
    code = 0
    for k in range(8):
        if image[row + _ROUND[k][0], column + _ROUND[k][1]]:
            code |= 1 << k
    return code


@numba.njit(cache=True)
def _ends(code):  # type: ignore[no-untyped-def]
    return code & (code - 1) == 0


@numba.njit(cache=True)
def thin(mask):  # type: ignore[no-untyped-def]
    """The skeleton of a mask: (H, W) uint8 of 0 and 1 whose border is 0 -> the same, lines one pixel wide."""
    image = mask.copy()
    active = np.empty((image.size, 2), np.int32)
    size = 0
    for row in range(1, image.shape[0] - 1):
        for column in range(1, image.shape[1] - 1):
            if image[row, column]:
                active[size, 0] = row
                active[size, 1] = column
                size += 1
    chosen = np.empty(size, np.int32)
    changed = True
    while changed:
        changed = False
        for half in range(2):
            table = _FIRST if half == 0 else _SECOND
            count = 0
            for a in range(size):
                if table[_code(image, active[a, 0], active[a, 1])]:
                    chosen[count] = a
                    count += 1
            for c in range(count):
                row, column = active[chosen[c], 0], active[chosen[c], 1]
                code = _code(image, row, column)
                if _SIMPLE[code] and not _ends(code):
                    image[row, column] = 0
                    changed = True
            left = 0
            for a in range(size):
                if image[active[a, 0], active[a, 1]]:
                    active[left] = active[a]
                    left += 1
            size = left
    for a in range(size):  # corners of staircases
        row, column = active[a, 0], active[a, 1]
        code = _code(image, row, column)
        if _SIMPLE[code] and not _ends(code):
            image[row, column] = 0
    return image

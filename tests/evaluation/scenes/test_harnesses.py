"""The families of branched objects are what they say, and vary."""

from functools import lru_cache

import numpy as np
import pytest
from scipy.spatial import cKDTree

from doo3d.evaluation.metrics.trees import true_crossings
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.registry import TREES, make_scene

SMALL = (320, 180)
SEEDS = range(4)
scene_of = lru_cache(make_scene)


@pytest.mark.parametrize("family", TREES)
def test_strands_begin_and_end_at_the_nodes_of_their_tree(family):
    scene = scene_of(family, 1)
    assert sorted(edge[0] for tree in scene.trees for edge in tree.edges) == list(range(len(scene.cables)))
    for tree in scene.trees:
        assert len(tree.edges) == len(tree.nodes) - 1
        for cable, first, last in tree.edges:
            assert np.allclose(scene.cables[cable].axis[[0, -1]], tree.nodes[[first, last]], atol=1e-9)


@pytest.mark.parametrize("family", ["tree_swap", "tree_two", "tree_under", "tree_crossing"])
def test_strands_that_do_not_meet_never_run_into_each_other(family):
    for seed in SEEDS:
        scene = scene_of(family, seed)
        nodes = [set(np.round(cable.axis[[0, -1]], 6).ravel().tolist()) for cable in scene.cables]
        for a, first in enumerate(scene.cables):
            for b, second in enumerate(scene.cables[:a]):
                if not nodes[a] & nodes[b]:
                    assert cKDTree(first.axis).query(second.axis)[0].min() > 0.96 * (first.radius + second.radius)


def test_strands_swap_sides_by_crossing_once_after_running_side_by_side():
    kinds = set()
    for seed in range(12):
        scene = scene_of("tree_swap", seed)
        kinds.add((len(scene.trees), sum(len(tree.nodes) for tree in scene.trees)))
        assert len(true_crossings(scene)) == 1
        lengths = []
        for a, first in enumerate(scene.cables):
            for second in scene.cables[:a]:
                distance = cKDTree(second.axis).query(first.axis)[0]
                lengths.append((distance < 3.2 * (first.radius + second.radius)).sum() * 0.0005)
        assert max(lengths) > 0.06
    assert kinds == {(1, 4), (1, 6), (2, 8)}


def test_a_wide_box_hides_a_junction_and_the_ends_of_its_strands_and_nothing_else():
    for seed in SEEDS:
        scene = make_scene("tree_hidden_wide", seed, SMALL)
        truths = render(scene, "none").truths
        (tree,) = scene.trees
        hidden = {node for node in np.flatnonzero(tree.degree == 3).tolist() if _hidden_from(truths, tree, node).min() > 0.01}
        assert len(hidden) == 1
        (node,) = hidden
        lengths = _hidden_from(truths, tree, node)
        assert len(lengths) == 3
        assert 0.035 < np.sort(lengths)[-2:].sum() < 0.11
        assert all(truths[cable].seen.any() for cable, *_ in tree.edges)


def test_two_harnesses_cross_each_other_only():
    for seed in SEEDS:
        scene = scene_of("tree_two", seed)
        assert len(scene.trees) == 2
        assert all((tree.degree >= 3).any() for tree in scene.trees)
        crossings = true_crossings(scene)
        assert 1 <= len(crossings) <= 3
        for point in crossings:
            near = [min(cKDTree(scene.cables[cable].axis).query(point)[0] for cable, *_ in tree.edges) for tree in scene.trees]
            assert max(near) < 0.03


def _hidden_from(truths, tree, node):
    """The lengths hidden from a node on, along each strand that meets there, m."""
    lengths = []
    for cable, first, last in tree.edges:
        if node in (first, last):
            seen = truths[cable].seen if node == first else truths[cable].seen[::-1]
            lengths.append(0.0005 * (int(np.argmax(seen)) if seen.any() else len(seen)))
    return np.array(lengths)

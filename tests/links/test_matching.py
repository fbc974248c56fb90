"""Matching: against all others, and against networkx where there are too many to try; and the rings that pairs close."""

from __future__ import annotations

import subprocess
import sys

import networkx as nx
import numpy as np
import pytest

from doo3d.links import matching
from doo3d.links.matching import find_rings, heaviest_matching


def weights(seed, count, share=1.0):
    """Random, of which a share is not 0."""
    random = np.random.default_rng(seed)
    return np.triu(random.uniform(1, 100, (count, count)) * (random.uniform(size=(count, count)) < share), 1)


def near(seed, count):
    """Weights of places in the plane: the nearer, the more; as ends of chains have them."""
    places = np.random.default_rng(seed).uniform(0, 100, (count, 2))
    return np.triu(np.maximum(20 - np.linalg.norm(places[:, None] - places, axis=2), 0), 1) * 1.0


def few(seed):
    """Small whole weights, so that many edges are tight at once and blossoms lie in blossoms."""
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 25))
    return np.triu(random.integers(0, 5, (count, count)), 1) * 1.0


def total(weight, pairs):
    assert len({row for pair in pairs for row in pair}) == 2 * len(pairs)
    assert all(a < b and weight[a, b] > 0 for a, b in pairs)
    return sum(weight[pair] for pair in pairs)


def by_trying(weight, left):
    """The largest total weight of pairs among some."""
    if len(left) < 2:
        return 0.0
    first, rest = left[0], left[1:]
    with_it = (weight[first, b] + by_trying(weight, [e for e in rest if e != b]) for b in rest if weight[first, b] > 0)
    return max(by_trying(weight, rest), *with_it, 0.0)


def by_networkx(weight):
    graph = nx.Graph()
    graph.add_weighted_edges_from((a, b, weight[a, b]) for a, b in np.argwhere(weight > 0).tolist())
    return sum(weight[tuple(sorted(pair))] for pair in nx.max_weight_matching(graph))


@pytest.mark.parametrize("share", [0.2, 0.5, 1.0])
@pytest.mark.parametrize("count", [2, 3, 5, 8])
@pytest.mark.parametrize("seed", range(3))
def test_against_trying_all(seed, count, share):
    weight = weights(seed, count, share)
    assert total(weight, heaviest_matching(weight)) == pytest.approx(by_trying(weight, list(range(count))))


@pytest.mark.parametrize("count", [17, 60])
@pytest.mark.parametrize("seed", range(3))
def test_against_networkx(seed, count):
    for weight in (weights(seed, count), weights(seed, count, 0.1), near(seed, count), few(seed), few(100 + seed)):
        assert total(weight, heaviest_matching(weight)) == pytest.approx(by_networkx(weight))


def test_two_good_pairs_are_worth_more_than_the_best():
    weight = np.zeros((5, 5))
    weight[0, 1] = weight[2, 3] = 8
    weight[1, 2] = 10
    assert heaviest_matching(weight) == [(0, 1), (2, 3)]
    weight[2:, 2:] = -np.inf
    assert heaviest_matching(weight + np.tril(np.ones((5, 5)))) == [(1, 2)]


def test_of_equally_heavy_matchings_always_the_same_is_found():
    """The hash tables of rustworkx are ordered anew in each process."""
    code = "import numpy; from doo3d.links.matching import heaviest_matching; print(heaviest_matching(numpy.ones((30, 30))))"
    found = [subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True).stdout for _ in range(3)]
    assert len(set(found)) == 1


def test_of_many_ends_only_pairs_of_large_weight_are_tried(monkeypatch):
    weight = near(0, 60)
    exact = total(weight, heaviest_matching(weight))
    monkeypatch.setattr(matching, "FEW_ENDS", 20)
    assert total(weight, heaviest_matching(weight)) == pytest.approx(exact, rel=0.01)


def test_nothing_to_pair():
    assert heaviest_matching(np.zeros((0, 0))) == heaviest_matching(np.zeros((3, 3))) == []


def test_rings_that_pairs_close():
    """Chains 0 and 1 in a ring, chain 2 closed in itself, chains 3, 4 and 5 in a row."""
    assert find_rings([(0, 3), (1, 2), (4, 5), (6, 8), (9, 11)]) == [[(0, 3), (1, 2)], [(4, 5)]]
    assert find_rings([(6, 8), (9, 11)]) == find_rings([]) == []

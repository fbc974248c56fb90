"""Matching: against all others, and against networkx where there are too many to try."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest

from doo3d.kernels import match_by_blossoms


def weights(seed, count, share=1.0):
    """Random, of which a share is not 0."""
    random = np.random.default_rng(seed)
    upper = np.triu(random.uniform(1, 100, (count, count)) * (random.uniform(size=(count, count)) < share), 1)
    return upper + upper.T


def near(seed, count):
    """Weights of places in the plane: the nearer, the more; as ends of chains have them."""
    places = np.random.default_rng(seed).uniform(0, 100, (count, 2))
    return np.triu(np.maximum(20 - np.linalg.norm(places[:, None] - places, axis=2), 0), 1) * 1.0


def total(weight, partner):
    pairs = [(a, b) for a, b in enumerate(partner.tolist()) if b >= 0]
    assert all(partner[b] == a and weight[a, b] > 0 for a, b in pairs)
    return sum(weight[pair] for pair in pairs) / 2


def by_trying(weight, left):
    """The largest total weight of pairs among some."""
    if len(left) < 2:
        return 0.0
    first, rest = left[0], left[1:]
    with_it = (weight[first, b] + by_trying(weight, [e for e in rest if e != b]) for b in rest if weight[first, b] > 0)
    return max(by_trying(weight, rest), *with_it, 0.0)


def by_blossoms(weight):
    graph = nx.Graph()
    graph.add_weighted_edges_from((a, b, weight[a, b]) for a, b in np.argwhere(np.triu(weight) > 0).tolist())
    return sum(weight[pair] for pair in nx.max_weight_matching(graph))


@pytest.mark.parametrize("share", [0.2, 0.5, 1.0])
@pytest.mark.parametrize("count", [2, 3, 5, 8])
@pytest.mark.parametrize("seed", range(5))
def test_against_trying_all(seed, count, share):
    weight = weights(seed, count, share)
    expected = by_trying(weight, list(range(count)))
    assert total(weight, match_by_blossoms(weight)) == pytest.approx(expected)


@pytest.mark.parametrize("count", [15, 17, 30, 60])
@pytest.mark.parametrize("seed", range(5))
def test_against_networkx(seed, count):
    for weight in (weights(seed, count), weights(seed, count, 0.1), near(seed, count) + near(seed, count).T):
        expected = pytest.approx(by_blossoms(weight))
        assert total(weight, match_by_blossoms(weight)) == expected


@pytest.mark.parametrize("seed", range(60))
def test_blossoms_of_few_ends(seed):
    """Small whole weights, so that many edges are tight at once and blossoms lie in blossoms."""
    random = np.random.default_rng(seed)
    count = int(random.integers(0, 25))
    weight = np.triu(random.integers(0, 5, (count, count)), 1) * 1.0
    weight += weight.T
    assert total(weight, match_by_blossoms(weight)) == by_blossoms(weight)


class Lowering:
    """Lowers some weights of each matching a number of times, and compares every matching with that of networkx."""

    def __init__(self, weight, seed, rounds):
        self.weight, self.random, self.rounds = weight.copy(), np.random.default_rng(seed), rounds
        self.seen = []

    def __call__(self, partner):
        self.seen.append(partner.copy())
        assert total(self.weight, partner) == pytest.approx(by_blossoms(self.weight))
        pairs = np.array([(a, b) for a, b in enumerate(partner.tolist()) if a < b]).reshape(-1, 2).astype(np.int64)
        pairs = pairs[self.random.uniform(size=len(pairs)) < 0.4]
        if len(self.seen) > self.rounds:
            pairs = pairs[:0]
        lower = self.weight[pairs[:, 0], pairs[:, 1]] * self.random.choice([0.0, 0.3, 0.9], len(pairs))
        self.weight[pairs[:, 0], pairs[:, 1]] = self.weight[pairs[:, 1], pairs[:, 0]] = lower
        return pairs, lower


@pytest.mark.parametrize("seed", range(10))
def test_lowered_weights_are_matched_again(seed):
    for weight in (weights(seed, 20, 0.5), near(seed, 40) + near(seed, 40).T):
        lowering = Lowering(weight, seed, rounds=12)
        partner = match_by_blossoms(weight, lowering)
        assert partner.tolist() == lowering.seen[-1].tolist()
        assert total(lowering.weight, partner) == pytest.approx(by_blossoms(lowering.weight))


def test_raised_weights_are_ignored():
    weight = np.array([[0.0, 2.0], [2.0, 0.0]])
    answers = iter([(np.array([[0, 1]]), np.array([5.0])), (np.zeros((0, 2), dtype=np.int64), np.zeros(0))])
    assert match_by_blossoms(weight, lambda partner: next(answers)).tolist() == [1, 0]


def test_a_lowered_pair_must_be_one_of_the_ends():
    with pytest.raises(ValueError, match="two of the members"):
        match_by_blossoms(np.ones((2, 2)), lambda partner: (np.array([[0, 2]]), np.zeros(1)))


def test_three_of_one_weight_make_one_pair():
    weight = np.full((3, 3), 10.0) - 10 * np.eye(3)
    assert total(weight, match_by_blossoms(weight)) == 10


def test_two_good_pairs_are_worth_more_than_the_best():
    weight = np.zeros((5, 5))
    weight[0, 1] = weight[2, 3] = 8
    weight[1, 2] = 10
    assert match_by_blossoms(weight + weight.T).tolist() == [1, 0, 3, 2, -1]


def test_nothing_to_pair():
    assert match_by_blossoms(np.zeros((0, 0))).tolist() == []
    assert match_by_blossoms(np.zeros((3, 3))).tolist() == [-1, -1, -1]

"""Facts of a cloud against k-d trees, and cells and ranks against NumPy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from doo3d.kernels import CloudFacts, least_near, nearest_points, values_at_ranks

RULES = (8000, 80, 3.0, 0.05, 0.8)


def tubes(count, apart, points, seed=0):
    """Points (N, 3) m of half tubes side by side, with noise, in any order."""
    rng = np.random.default_rng(seed)
    number = rng.integers(0, count, points)
    along, angle = rng.uniform(0, 0.3, points), rng.uniform(0, np.pi, points)
    position = np.column_stack((along, 0.004 * np.cos(angle) + apart * number, 0.5 + 0.004 * np.sin(angle)))
    return position + rng.normal(0, 0.0001, (points, 3)), number


def spacing_by_tree(points):
    sample = points[:: max(1, len(points) // 8000)]
    nearest = min(8, len(sample) - 1)
    distance = cKDTree(sample).query(sample[:: max(1, len(sample) // 80)], k=[nearest + 1])[0][:, 0]
    return max(np.median(distance) * math.sqrt(math.pi / nearest) * math.sqrt(len(sample) / len(points)), 1e-6)


def strands_by_tree(points, spacing):
    sample = points[:: max(1, len(points) // 8000)]
    pairs = cKDTree(sample).query_pairs(3 * spacing * math.sqrt(len(points) / len(sample)), output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(sample), len(sample)))
    label = connected_components(graph, directed=False)[1]
    size = np.bincount(label)
    large = np.flatnonzero(size >= 0.05 * len(sample))
    if len(large) < 2 or size[large].sum() < 0.8 * len(sample):
        return sample, np.zeros(0, dtype=int)
    return sample, np.where(np.isin(label, large), np.searchsorted(large, label), -1)


def neighbors_by_cells(points, size):
    """The neighbors of each point and their mean, by comparing the cells of all with all."""
    cell = np.floor((points - (points.min(axis=0) - size)) / size)
    near = (np.abs(cell[:, None] - cell).max(axis=2) <= 1).astype(float)
    return near.sum(axis=1), near @ points / near.sum(axis=1)[:, None]


@pytest.mark.parametrize(("count", "apart", "points"), [(1, 0.0, 3000), (3, 0.016, 6000), (3, 0.009, 6000), (4, 0.02, 40_000)])
def test_spacing_strands_and_gap_are_those_of_a_tree(count, apart, points):
    points, _ = tubes(count, apart, points)
    points[:40] += (0, 0, 0.3)
    facts = CloudFacts(points, *RULES)
    assert facts.spacing == spacing_by_tree(points)
    sample, strands = strands_by_tree(points, facts.spacing)
    np.testing.assert_array_equal(facts.strands, strands)
    if len(strands):
        large = range(strands.max() + 1)
        gap = min(cKDTree(sample[(strands >= 0) & (strands != k)]).query(sample[strands == k])[0].min() for k in large)
        assert facts.strands_nearer(gap * (1 + 1e-9))
        assert not facts.strands_nearer(gap)
        assert facts.strands_nearer(100.0)
        moved = points + np.random.default_rng(1).normal(0, 0.002, points.shape)
        moved[5:300:7] += np.random.default_rng(2).normal(0, 0.2, (43, 3))
        some = moved[:: max(1, len(points) // 8000)]
        near = cKDTree(some[strands >= 0]).query(moved)[1]
        np.testing.assert_array_equal(facts.strand_of(moved), strands[strands >= 0][near])
    else:
        assert not facts.strands_nearer(100.0)
        assert not facts.strand_of(points).any()


def test_repeated_points_are_of_the_strand_at_their_place():
    """Eight places, 500 points at each: every place is a strand of its own."""
    points = np.tile(np.random.default_rng(0).uniform(size=(8, 3)), (500, 1))
    facts = CloudFacts(points, *RULES)
    np.testing.assert_array_equal(facts.strands, np.tile(np.arange(8), 500))
    np.testing.assert_array_equal(facts.strand_of(points), facts.strands)


def test_strands_side_by_side_are_found():
    points, number = tubes(3, 0.016, 6000)
    strands = CloudFacts(points, *RULES).strands
    assert len({(a, b) for a, b in zip(number.tolist(), strands.tolist(), strict=True)}) == 3
    assert not strands.flags.writeable
    assert len(CloudFacts(tubes(3, 0.009, 6000)[0], *RULES).strands) == 0


def test_outliers_and_means_are_those_of_all_pairs_of_cells():
    points = np.concatenate((tubes(2, 0.02, 1500)[0], np.random.default_rng(3).uniform(-0.3, 0.5, (60, 3))))
    facts = CloudFacts(points, *RULES)
    counts, means = neighbors_by_cells(points, 2 * facts.spacing)
    wanted = counts >= 0.15 * np.median(counts)
    kept, averaged = facts.without_outliers(2.0, 0.15)
    assert 0 < wanted.sum() < len(points)
    np.testing.assert_array_equal(kept, points[wanted])
    np.testing.assert_allclose(averaged, means[wanted], rtol=1e-12)


def test_the_array_itself_is_given_back_without_outliers():
    points = tubes(1, 0.0, 2000)[0]
    assert CloudFacts(points, *RULES).without_outliers(2.0, 0.0)[0] is points


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.ones((1, 3)), np.ones((30, 3)), np.eye(3), np.full((20_000, 3), 7.0)])
def test_few_and_equal_points(points):
    facts = CloudFacts(points, *RULES)
    assert facts.spacing > 0
    assert not len(facts.strands)
    kept, means = facts.without_outliers(2.0, 0.15)
    assert len(kept) == len(means) == len(points)
    assert facts.strand_of(points).tolist() == [0] * len(points)


@pytest.mark.parametrize("extent", [1e-300, 1e-12, 1e9, 1e149])
def test_no_extent_overflows(extent):
    points = tubes(2, 0.02, 2000)[0]
    far = np.array([[extent, -extent, extent], [-extent, extent, 0]])
    for cloud in (np.concatenate((points, far)), points / 0.3 * extent):
        facts = CloudFacts(cloud, *RULES)
        kept, means = facts.without_outliers(2.0, 0.15)
        assert len(kept) == len(means)
        assert facts.strand_of(cloud).shape == (len(cloud),)
        facts.strands_nearer(max(extent, 1.0))


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_points_that_are_not_finite_are_refused(wrong):
    points = tubes(1, 0.0, 100)[0]
    points[50, 1] = wrong
    with pytest.raises(ValueError, match="finite"):
        CloudFacts(points, *RULES)
    with pytest.raises(ValueError, match="finite"):
        values_at_ranks(points, np.array([1]))


def test_coordinates_whose_squares_overflow_are_refused():
    with pytest.raises(ValueError, match="square"):
        CloudFacts(np.full((3, 3), 1e200), *RULES)


@given(st.integers(1, 200), st.integers(0, 9), st.sampled_from([1e-3, 1.0, 1e6]), st.booleans())
def test_nearest_points_are_those_of_a_tree(count, seed, stretch, whole):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3)) * (stretch, 1, 1)
    points = np.floor(points) if whole else points
    positions = np.concatenate((points[:5], rng.normal(size=(5, 3)) * 3 * stretch))
    distance, index = nearest_points(points, positions, count // 2 + 1)
    wanted = cKDTree(points).query(positions, k=np.arange(1, count // 2 + 2))[0]
    np.testing.assert_allclose(distance, wanted, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(points[index] - positions[:, None], axis=2), distance, rtol=1e-12)


@given(st.integers(1, 60), st.integers(0, 9), st.integers(1, 9), st.booleans())
def test_the_least_value_is_that_of_the_nearest_points(count, seed, most, whole):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    points = np.floor(points) if whole else points
    points[::7, 2] = np.nan
    positions = np.concatenate((points[:5, :2], rng.normal(size=(5, 2))))
    wanted = []
    for position in positions:
        distance = np.linalg.norm(points[:, :2] - position, axis=1)
        near = np.argsort(distance, kind="stable")[:most]
        wanted.append(np.fmin.reduce(points[near[distance[near] < 1.5], 2], initial=np.nan))
    np.testing.assert_array_equal(least_near(points, positions, 1.5, most), wanted)


@pytest.mark.parametrize("spread", ["even", "heavy", "equal", "tiny", "vast"])
def test_values_at_ranks_are_sorted_ones(spread):
    rng = np.random.default_rng(0)
    points = {
        "even": rng.uniform(size=(999, 3)),
        "heavy": rng.standard_cauchy((999, 3)) * 1e5,
        "equal": np.full((999, 3), -2.0),
        "tiny": rng.integers(0, 3, (999, 3)) * 5e-324,
        "vast": rng.uniform(-1.0, 1.0, (999, 3)) * 1.7e308,
    }[spread]
    ranks = rng.permutation(999)
    np.testing.assert_array_equal(values_at_ranks(points, ranks), np.sort(points, axis=0)[ranks])
    np.testing.assert_array_equal(values_at_ranks(points, np.array([998, 0])), np.sort(points, axis=0)[[998, 0]])

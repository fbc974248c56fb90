"""The first radius of clouds, the spacing of their points, and strands that do not touch."""

from __future__ import annotations

import numpy as np
import pytest
from builders.drawn_masks import surface, wave
from builders.scenes import cloud_scene
from scipy.spatial import cKDTree

from doo3d.scene.cloud_facts import CloudFacts, sampled, seeds_of, spreads
from doo3d.segment.point_filter import filter_points

RADIUS = 0.005


@pytest.mark.parametrize("viewpoint", [None, np.zeros(3)])
@pytest.mark.parametrize("spacing", [0.0005, 0.001])
def test_radius_and_spacing_of_one_strand(viewpoint, spacing):
    points = surface(wave(), RADIUS, viewpoint, spacing=spacing)
    assert CloudFacts(points).spacing == pytest.approx(spacing, rel=0.25)
    assert cloud_scene(points).radius == pytest.approx(RADIUS, rel=0.25)


def test_strands_side_by_side_are_measured_one_by_one():
    one = surface(wave(), RADIUS, np.zeros(3))
    three = np.concatenate([one + np.array([0, 0, 0.02 * k]) for k in range(3)])
    assert cloud_scene(three).radius == pytest.approx(cloud_scene(one).radius, rel=0.1)


def test_points_in_one_position_have_the_least_spacing():
    assert CloudFacts(np.ones((3, 3))).spacing == 1e-6


@pytest.mark.parametrize(("count", "sample", "seeds"), [(5, 5, 5), (7999, 7999, 81), (15_999, 15_999, 81), (16_000, 8000, 80)])
def test_samples_are_taken_at_a_stride(count, sample, seeds):
    points = np.arange(3.0 * count).reshape(count, 3)
    assert len(sampled(points)) == sample
    assert len(seeds_of(sampled(points))) == seeds


def test_facts_are_of_the_points_that_are_kept():
    points = np.concatenate((surface(wave(), RADIUS), [[30.0, 0, 0]], np.random.default_rng(0).uniform(-0.5, 1.5, (50, 3))))
    facts, kept, means = filter_points(points)
    assert len(points) - 51 <= len(kept) == len(means) < len(points)
    assert facts.spacing == CloudFacts(kept).spacing


def tubes(count, apart, points):
    """Points (N, 3) m of half tubes side by side, with noise, in any order, and the number of each tube."""
    rng = np.random.default_rng(0)
    number = rng.integers(0, count, points)
    along, angle = rng.uniform(0, 0.3, points), rng.uniform(0, np.pi, points)
    position = np.column_stack((along, 0.004 * np.cos(angle) + apart * number, 0.5 + 0.004 * np.sin(angle)))
    return position + rng.normal(0, 0.0001, (points, 3)), number


@pytest.mark.parametrize(("count", "apart", "points"), [(3, 0.016, 6000), (4, 0.02, 40_000)])
def test_strands_side_by_side_are_found_with_the_gap_between_them(count, apart, points):
    points, number = tubes(count, apart, points)
    points[:40] += (0, 0, 0.3)
    facts = CloudFacts(points)
    sample, strands, tube = sampled(points), facts.strands, sampled(number)
    large = strands >= 0
    assert large.mean() > 0.99
    assert len(set(zip(tube[large].tolist(), strands[large].tolist(), strict=True))) == count
    gap = min(cKDTree(sample[large & (strands != k)]).query(sample[strands == k])[0].min() for k in range(count))
    assert facts.strands_nearer(gap * (1 + 1e-9))
    assert not facts.strands_nearer(gap * (1 - 1e-9))
    moved = points + np.random.default_rng(1).normal(0, 0.002, points.shape)
    near = cKDTree(sampled(moved)[large]).query(moved)[1]
    np.testing.assert_array_equal(facts.strand_of(moved), strands[large][near])


@pytest.mark.parametrize(("count", "apart"), [(1, 0.0), (3, 0.009)])
def test_strands_that_touch_are_one(count, apart):
    facts = CloudFacts(tubes(count, apart, 6000)[0])
    assert len(facts.strands) == 0
    assert not facts.strands_nearer(100.0)
    assert not facts.strand_of(tubes(count, apart, 6000)[0]).any()


def test_repeated_points_are_of_the_strand_at_their_place():
    """Eight places, 500 points at each: every place is a strand of its own."""
    facts = CloudFacts(np.tile(np.random.default_rng(0).uniform(0, 0.1, (8, 3)), (500, 1)))
    assert len(set(facts.strands[:8].tolist())) == 8
    np.testing.assert_array_equal(facts.strands, np.tile(facts.strands[:8], 500))


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.ones((1, 3)), np.ones((30, 3)), np.eye(3), np.full((20_000, 3), 7.0)])
def test_few_and_equal_points(points):
    facts, kept, means = filter_points(points)
    assert facts.spacing > 0
    assert not len(facts.strands)
    assert len(kept) == len(means) == len(points)
    assert facts.strand_of(points).tolist() == [0] * len(points)


@pytest.mark.parametrize("extent", [1e-300, 1e-12, 1e9, 1e149])
def test_no_extent_overflows(extent):
    points = tubes(2, 0.02, 2000)[0]
    far = np.array([[extent, -extent, extent], [-extent, extent, 0]])
    for cloud in (np.concatenate((points, far)), points / 0.3 * extent):
        facts, kept, means = filter_points(cloud)
        assert len(kept) == len(means) > 0
        assert facts.strand_of(kept).shape == (len(kept),)
        facts.strands_nearer(max(extent, 1.0))


@pytest.mark.parametrize("reach", [0.2, 0.4, 9.0])
def test_spreads_are_those_of_the_points_near_each_center(reach):
    rng = np.random.default_rng(0)
    points, centers = rng.normal(size=(500, 3)) + 1, rng.normal(size=(20, 3)) + 1
    points = points[np.argsort(points[:, 0])]
    near = [points[np.linalg.norm(points - center, axis=1) <= reach] for center in centers]
    counts, means, covariances = spreads(points, centers, reach)
    assert counts.tolist() == [len(each) for each in near]
    some = counts > 0
    np.testing.assert_allclose((centers + means)[some], [each.mean(axis=0) for each in near if len(each)], atol=1e-12)
    np.testing.assert_allclose(covariances[some], [np.cov(each.T, ddof=0) for each in near if len(each)], atol=1e-12)
    assert not covariances[~some].any()


def test_points_in_another_order_are_refused():
    with pytest.raises(ValueError, match="order"):
        spreads(np.array([(1.0, 0, 0), (0, 0, 0)]), np.zeros((1, 3)), 1.0)

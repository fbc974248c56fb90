"""The first radius and the spacing of clouds, and quantiles of their coordinates."""

from __future__ import annotations

import numpy as np
import pytest
from builders.drawn_masks import surface, wave

from doo3d.facts.cloud_facts import cloud_facts, estimate_radius, point_spacing, sampled, seeds_of
from doo3d.stages.segment.point_filter import filter_points, quantiles
from doo3d.types import Foreground

RADIUS = 0.005


def foreground_of(points) -> Foreground:
    return Foreground(points, cloud_facts=cloud_facts(points))


@pytest.mark.parametrize("viewpoint", [None, np.zeros(3)])
@pytest.mark.parametrize("spacing", [0.0005, 0.001])
def test_radius_and_spacing_of_one_strand(viewpoint, spacing):
    points = surface(wave(), RADIUS, viewpoint, spacing=spacing)
    foreground = foreground_of(points)
    assert point_spacing(foreground) == pytest.approx(spacing, rel=0.25)
    assert estimate_radius(foreground, spacing) == pytest.approx(RADIUS, rel=0.25)


def test_strands_side_by_side_are_measured_one_by_one():
    one = surface(wave(), RADIUS, np.zeros(3))
    three = np.concatenate([one + np.array([0, 0, 0.02 * k]) for k in range(3)])
    measured = estimate_radius(foreground_of(three), 0.001)
    assert measured == pytest.approx(estimate_radius(foreground_of(one), 0.001), rel=0.1)


def test_spacing_without_facts_is_the_same():
    points = surface(wave(), RADIUS)
    assert point_spacing(Foreground(points)) == point_spacing(foreground_of(points))
    assert point_spacing(Foreground(np.ones((3, 2)))) == 1e-6


@pytest.mark.parametrize(("count", "sample", "seeds"), [(5, 5, 5), (7999, 7999, 81), (15_999, 15_999, 81), (16_000, 8000, 80)])
def test_samples_are_taken_at_a_stride(count, sample, seeds):
    points = np.arange(3.0 * count).reshape(count, 3)
    assert len(sampled(points)) == sample
    assert len(seeds_of(sampled(points))) == seeds


def test_facts_are_of_the_points_that_are_kept():
    points = np.concatenate((surface(wave(), RADIUS), [[30.0, 0, 0]], np.random.default_rng(0).uniform(-0.5, 1.5, (50, 3))))
    facts, kept, means = filter_points(points)
    assert len(points) - 51 <= len(kept) == len(means) < len(points)
    assert facts.spacing == cloud_facts(kept).spacing


@pytest.mark.parametrize("count", [1, 2, 3, 50, 1001])
def test_quantiles_are_those_of_numpy(count):
    rng = np.random.default_rng(count)
    for points in (rng.normal(size=(count, 3)), np.full((count, 3), 2.0), rng.integers(0, 3, (count, 3)).astype(float)):
        fractions = (0.0, 0.02, 0.05, 0.5, 0.95, 0.98, 1.0)
        np.testing.assert_array_equal(quantiles(points, fractions), np.quantile(points, fractions, axis=0))

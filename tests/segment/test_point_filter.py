"""Outliers of a cloud removed."""

from __future__ import annotations

import numpy as np
from builders.blue_cable import RADIUS, scene_of
from builders.drawn_masks import surface, wave
from builders.errors import refuses

from doo3d.config import SegmentConfig
from doo3d.scene.cloud import CloudScene
from doo3d.scene.cloud_facts import CELL_SPACINGS, CloudFacts
from doo3d.segment.point_filter import MIN_NEIGHBORS_RATIO, far_outliers, filter_points
from doo3d.types import Cloud


def cloud(points, mask=None, **settings) -> CloudScene:
    return scene_of(Cloud(points), SegmentConfig(**({"method": "everything"} | settings)), mask)


def test_far_outliers_of_a_cloud_are_removed():
    points = surface(wave(), RADIUS)
    far = np.array([[30.0, 0, 0], [0, -25.0, 8], [3.0, 3.0, 3.0], [-9.0, 2.0, 1.0]])
    found = cloud(np.concatenate((points, far)))
    assert np.ptp(found.points, axis=0).max() < 0.4
    assert len(found.points) > 0.9 * len(points)


def test_far_outliers():
    points = surface(wave(), RADIUS)
    far = np.array([[30.0, 0, 0], [0, -25.0, 8], [3.0, 3.0, 3.0]])
    assert far_outliers(np.concatenate((points, far))).tolist() == [False] * len(points) + [True] * 3
    assert far_outliers(np.zeros((0, 3))).shape == (0,)


def test_a_cloud_with_a_mask():
    points = surface(wave(), RADIUS)
    found = cloud(points, points[:, 0] < 0)
    assert found.points[:, 0].max() < 0
    with refuses("mask-shape", "(5,)"):
        cloud(points, np.ones(5, bool))


def test_the_order_of_the_points_of_a_cloud_does_not_matter():
    points = surface(wave(), RADIUS, np.zeros(3))
    order = np.random.default_rng(0).permutation(len(points))
    one, other = cloud(points), cloud(points[order])
    assert {tuple(p) for p in one.points.tolist()} == {tuple(p) for p in other.points.tolist()}


def test_outliers_and_means_are_those_of_all_pairs_of_cells():
    points = np.concatenate((surface(wave(), RADIUS, spacing=0.002), np.random.default_rng(3).uniform(0, 0.3, (60, 3))))
    size = CELL_SPACINGS * CloudFacts(points).spacing
    cell = np.floor((points - (points.min(axis=0) - size)) / size)
    near = (np.abs(cell[:, None] - cell).max(axis=2) <= 1).astype(float)
    wanted = near.sum(axis=1) >= MIN_NEIGHBORS_RATIO * np.median(near.sum(axis=1))
    assert 0 < np.count_nonzero(~wanted) < 100
    facts, kept, means = filter_points(points)
    np.testing.assert_array_equal(kept, points[wanted])
    np.testing.assert_allclose(means, (near @ points / near.sum(axis=1)[:, None])[wanted], rtol=1e-12)
    assert facts.spacing == CloudFacts(kept).spacing

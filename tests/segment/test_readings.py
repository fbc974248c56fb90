"""Readings of a mask: outliers removed, noise averaged away."""

from __future__ import annotations

import numpy as np
import pytest
from builders.blue_cable import DEPTH, RADIUS, SEEN, frame, scene_of
from builders.drawn_masks import CAMERA, wave
from scipy.spatial import cKDTree

from doo3d.config import SegmentConfig
from doo3d.scene.frame_facts import FrameFacts
from doo3d.segment import depth_filter

CONFIG = SegmentConfig()


def test_points_lie_where_they_were_seen():
    found = scene_of(frame(), CONFIG, SEEN)
    np.testing.assert_allclose(found.points[:, 2], DEPTH[found.pixels[:, 1], found.pixels[:, 0]], rtol=1e-6)
    np.testing.assert_allclose(CAMERA.project(found.points), found.pixels, atol=1e-4)
    away = cKDTree(wave()).query(found.points)[0]
    np.testing.assert_allclose(away, RADIUS, atol=0.0005)
    np.testing.assert_array_equal(found.mask, SEEN)
    assert SEEN[found.pixels[:, 1], found.pixels[:, 0]].all()
    assert len(found.points) > 0.9 * SEEN.sum()
    assert found.viewpoint.tolist() == [0, 0, 0]
    assert found.notes == ()


def test_filtered_points_have_less_noise():
    noise = 0.001 * np.random.default_rng(0).normal(size=DEPTH.shape)
    flat = np.where(SEEN, 0.5 + noise, 0)
    found = scene_of(frame(flat), SegmentConfig(outlier_slope=0.01), SEEN)
    assert np.std(found.filtered[:, 2]) < 0.5 * np.std(found.points[:, 2])


@pytest.mark.parametrize("given", [True, False])
def test_flying_points_are_removed(given):
    """Readings between the cable and what is behind it, along its edges."""
    random = np.random.default_rng(0)
    inner = np.zeros_like(SEEN)
    inner[1:-1, 1:-1] = SEEN[1:-1, 1:-1] & SEEN[:-2, 1:-1] & SEEN[2:, 1:-1] & SEEN[1:-1, :-2] & SEEN[1:-1, 2:]
    flying = SEEN & ~inner & (random.random(SEEN.shape) < 0.3)
    depth = np.where(flying, random.uniform(0.55, 0.9, DEPTH.shape), DEPTH)
    found = scene_of(frame(depth), SegmentConfig(method="everything"), SEEN if given else None)
    assert cKDTree(wave()).query(found.points)[0].max() < 2 * RADIUS
    assert len(found.points) > 0.7 * SEEN.sum()


def test_noise_is_no_flying_point(monkeypatch):
    """Far away neighbours differ by more, and of a thin cable there are few: both keep their readings."""
    noisy = np.where(SEEN, DEPTH + 0.006 * np.random.default_rng(0).normal(size=DEPTH.shape), 0)
    assert len(scene_of(frame(noisy), SegmentConfig(), SEEN).points) > 0.95 * SEEN.sum()
    with monkeypatch.context() as without_noise:
        without_noise.setattr(depth_filter, "DEVIATIONS", 0)
        assert len(scene_of(frame(noisy), SegmentConfig(), SEEN).points) < 0.8 * SEEN.sum()
    thin = np.zeros_like(SEEN)
    thin[240:242, 100:500] = True
    flat = np.where(thin & (np.random.default_rng(0).random(SEEN.shape) < 0.7), 0.5, 0)
    assert len(scene_of(frame(flat), SegmentConfig(), thin).points) == (flat > 0).sum()


def test_a_strand_that_runs_far_away_keeps_its_readings():
    """Its depth changes from pixel to pixel by the more, the farther away it is; a third of it is as steep as that."""
    u = np.arange(SEEN.shape[1])
    start, end = np.quantile(np.nonzero(SEEN)[1], (0.6, 1))
    away = np.where(SEEN, 0.5 * np.exp(0.005 * np.clip(u - start, 0, None)), 0)
    assert away[SEEN].max() > 1
    found = scene_of(frame(away), SegmentConfig(), SEEN)
    assert (found.pixels[:, 0] > start + 0.9 * (end - start)).sum() > 0.95 * SEEN[:, int(start + 0.9 * (end - start)) + 1 :].sum()


def test_the_noise_of_depth():
    depth = np.full((40, 60), 0.5, np.float32)
    mask = np.zeros((40, 60), dtype=bool)
    assert FrameFacts(mask, depth).depth_noise == 0
    mask[10:20, 10:50] = True
    depth[:, ::2] += 0.004
    depth[12] = 0
    assert FrameFacts(mask, depth).depth_noise == pytest.approx(0.004, rel=1e-5)
    assert FrameFacts(mask, np.zeros_like(depth)).depth_noise == 0


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, -1.0, 0.0])
def test_depth_values_that_mean_none(bad):
    """Readings that are none leave holes, nothing else, and no warnings."""
    depth = DEPTH.copy()
    holes = np.random.default_rng(0).random(DEPTH.shape) < 0.2
    depth[holes] = bad
    found = scene_of(frame(depth), CONFIG, SEEN)
    assert np.isfinite(found.points).all()
    assert not holes[found.pixels[:, 1], found.pixels[:, 0]].any()
    assert len(found.points) > 0.6 * SEEN.sum()


def test_depth_out_of_range_is_dropped():
    depth = DEPTH.copy()
    depth[:, :200] = np.where(SEEN[:, :200], 30.0, 0)
    missing = DEPTH.copy()
    missing[:, :200] = 0
    found, expected = (scene_of(frame(each), CONFIG, SEEN) for each in (depth, missing))
    np.testing.assert_array_equal(found.points, expected.points)
    assert scene_of(frame(depth), SegmentConfig(max_depth=50), SEEN).points[:, 2].max() > 20

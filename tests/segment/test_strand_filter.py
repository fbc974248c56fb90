"""Torn and wavy depth is smoothed along strands; sound depth stays as it was measured."""

from __future__ import annotations

import numpy as np
import pytest
from builders.blue_cable import DEPTH, RADIUS, SEEN, frame
from builders.drawn_masks import CAMERA, depth_of, line, wave
from scipy.spatial import cKDTree

from doo3d import Frame, load_config
from doo3d.config import SegmentConfig
from doo3d.pipeline import detect
from doo3d.segment import segment
from doo3d.segment.strand_filter import NEARER_SHARE, nearer_values

AXIS = wave()
TABLE = 0.6


def record_of(depth, mask=SEEN):
    return segment(frame(depth), SegmentConfig(), mask)


def error_of(record):
    """Distances of the filtered points from the true surface, m."""
    return np.abs(cKDTree(AXIS).query(record.scene.filtered)[0] - RADIUS)


def torn(stretches=6, length=16, seed=0):
    """The cable in depth, with stretches that show the table behind it."""
    rng = np.random.default_rng(seed)
    depth = np.where(SEEN, DEPTH, TABLE)
    columns = np.flatnonzero(SEEN.any(axis=0))
    for start in rng.choice(columns[20:-40], stretches, replace=False):
        depth[:, start : start + length] = TABLE
    return depth


def noise_in_blocks(seed, deviation, size=12):
    """Depth noise (480, 640) m that is the same in blocks, as that of block matching nearly is."""
    blocks = np.random.default_rng(seed).normal(0, deviation, (480 // size, 640 // size + 1))
    return np.kron(blocks, np.ones((size, size)))[:, :640]


def test_sound_depth_stays():
    noisy = np.where(SEEN, DEPTH + 0.0005 * np.random.default_rng(0).normal(size=DEPTH.shape), TABLE)
    record = record_of(noisy)
    assert record.smoothed == 0
    pixels = record.scene.pixels
    np.testing.assert_allclose(record.scene.points[:, 2], noisy[pixels[:, 1], pixels[:, 0]], rtol=1e-6)


def test_torn_depth_follows_the_strand():
    record = record_of(torn())
    assert record.smoothed > 0.9 * SEEN.sum()
    assert np.percentile(error_of(record), 99) < RADIUS
    chains = detect(frame(torn()), load_config("default"), SEEN).chains
    assert len(chains) == 1
    away = cKDTree(AXIS).query(chains[0].joints)[0]
    assert away.max() < RADIUS


def test_the_whole_strand_has_the_depth_of_the_curve():
    """Also its pixels without a reading, and those whose readings are noise that agrees with nothing around it."""
    rng = np.random.default_rng(3)
    depth = torn()
    flying = SEEN & (rng.random(SEEN.shape) < 0.4)
    depth[flying] = rng.uniform(DEPTH[SEEN].max() + 0.02, TABLE, np.count_nonzero(flying))
    depth[SEEN & (rng.random(SEEN.shape) < 0.2)] = 0
    record = record_of(depth)
    assert record.smoothed > 0
    assert len(record.scene.pixels) == SEEN.sum()
    assert np.percentile(error_of(record), 99) < 2 * RADIUS
    pixels = record.scene.pixels
    assert (np.diff(pixels[:, 1] * SEEN.shape[1] + pixels[:, 0]) > 0).all()


def test_waves_are_smoothed():
    waves = noise_in_blocks(1, 0.006)
    record = record_of(np.where(SEEN, DEPTH + waves, 0.9))
    assert record.smoothed > 0.9 * SEEN.sum()
    assert np.median(error_of(record)) < 0.65 * np.median(np.abs(waves[SEEN]))


def test_a_noisy_strand_on_a_table_is_drawn_to_it():
    """The table beside the strand is known better than the strand: up to the height of its top, 1.6 radii as a camera sees it."""
    flat, _ = depth_of([line([-0.15, 0, TABLE - RADIUS], [0.15, 0, TABLE - RADIUS])], [RADIUS], table=TABLE)
    mask = np.abs(flat - TABLE) > 1e-6
    noisy = np.where(mask, flat + noise_in_blocks(2, 0.012), flat)
    record = record_of(noisy, mask)
    top = TABLE - 1.6 * RADIUS
    before = np.abs(noisy[mask] - top).mean()
    assert np.abs(record.scene.filtered[:, 2] - top).mean() < 0.6 * before


def test_noise_that_grows_with_depth_is_smoothed_up_to_the_far_end():
    """A strand runs away from 0.5 to 1.3 m; stereo noise is even in inverse depth, 14 mm at the far end."""
    axis = line([-0.16, 0.02, 0.5], [0.45, 0.1, 1.3])
    depth, which = depth_of([axis], [0.004], CAMERA)
    mask = which >= 0
    noisy = np.where(mask, 1 / (1 / np.where(mask, depth, 1.0) + noise_in_blocks(3, 0.008, size=8)), 3.0)
    record = segment(Frame(None, noisy.astype(np.float32), CAMERA), SegmentConfig(), mask)
    assert record.smoothed > 0.9 * mask.sum()
    away = cKDTree(axis).query(record.scene.filtered)[0]
    assert np.percentile(away, 90) < 0.008
    chains = detect(Frame(None, noisy.astype(np.float32), CAMERA), load_config("default"), mask).chains
    assert len(chains) == 1
    assert chains[0].length > 0.95 * np.linalg.norm(axis[-1] - axis[0])


def test_a_strand_that_runs_away_is_whole():
    axis = line([-0.08, -0.05, 0.4], [0.16, 0.09, 1.1])
    depth, which = depth_of([axis], [0.004])
    data = Frame(None, np.where(which >= 0, depth, 1.6).astype(np.float32), CAMERA)
    chains = detect(data, load_config("default"), which >= 0).chains
    assert len(chains) == 1
    assert chains[0].length == pytest.approx(np.linalg.norm(axis[-1] - axis[0]), rel=0.08)


@pytest.mark.parametrize("pixels", [1, 5, 40])
def test_few_pixels(pixels):
    mask = np.zeros_like(SEEN)
    mask.ravel()[np.flatnonzero(SEEN)[:pixels]] = True
    assert len(record_of(np.where(SEEN, DEPTH, TABLE), mask).scene.points) <= pixels


@pytest.mark.parametrize("seed", range(3))
def test_values_below_the_uppermost_share_of_each_group(seed):
    rng = np.random.default_rng(seed)
    group, values = rng.integers(0, 40, 200), np.round(rng.normal(size=200), 1)
    found, count = nearer_values(values, group, 45)
    for k in range(45):
        own = np.sort(values[group == k])
        assert count[k] == len(own)
        assert found[k] == (own[len(own) - 1 - int(NEARER_SHARE * (len(own) - 1))] if len(own) else 0.0)

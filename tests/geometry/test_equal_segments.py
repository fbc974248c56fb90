"""Equal segments from end to end, and round a ring."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.geometry.equal_segments import equal_ring, equal_segments
from doo3d.geometry.polyline import steps

LENGTH = 0.01


def loop(noise: float, seed: int):
    t = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    swing = np.column_stack((0.1 * np.cos(t) * (1 + 0.5 * np.cos(2 * t)), 0.06 * np.sin(t), 0.02 * np.sin(3 * t)))
    return swing + noise * np.random.default_rng(seed).normal(size=swing.shape)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("noise", [0.0, 0.0005, 0.003])
def test_a_ring_closes_with_equal_segments(noise, seed):
    """However rough the line is: chords walked round it end beside the first joint, which nothing may hide."""
    joints = equal_ring(loop(noise, seed), LENGTH)
    np.testing.assert_allclose(steps(joints), LENGTH, rtol=1e-9)
    np.testing.assert_array_equal(joints[0], joints[-1])
    true = loop(0.0, 0)
    gap = np.linalg.norm(joints[:, None] - true, axis=-1).min(axis=1)
    assert gap.max() < 0.002 + 6 * noise


def test_a_loop_too_short_for_a_ring():
    assert len(equal_ring(0.02 * loop(0.0, 0), LENGTH)) == 0


def test_a_curve_curled_up_within_a_segment_has_no_joints_in_place_of_a_single_one():
    t = np.linspace(0, 1, 60)
    spiral = np.column_stack((np.cos(9 * t), np.sin(9 * t))) * (0.02 + 0.3 * t)[:, None]
    assert len(equal_segments(spiral, 1.0)) == 0
    walks = np.cumsum(np.random.default_rng(0).normal(size=(200, 30, 2)), axis=1) * np.linspace(0.02, 0.3, 200)[:, None, None]
    counts = [len(equal_segments(walk, 1.0)) for walk in walks]
    assert 0 in counts
    assert 1 not in counts
    assert max(counts) > 2


def test_a_ring_that_is_not_closed_by_equal_segments_has_none(monkeypatch):
    """As around a loop that folds back and forth, for which Newton's method finds no end."""
    monkeypatch.setattr("doo3d.geometry.equal_segments.MAX_ITERATIONS", 0)
    assert len(equal_ring(loop(0.1, 0), LENGTH)) == 0

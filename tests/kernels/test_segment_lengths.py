"""Segments brought to one length, against the same steps in plain Python."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.kernels import equalize_lengths


def by_steps(joints, length, mobility, rounds, tolerance):
    moved = joints.copy()
    for _ in range(rounds):
        worst = 0.0
        for first in (0, 1):
            for k in range(first, len(moved) - 1, 2):
                step = moved[k + 1] - moved[k]
                distance = np.linalg.norm(step)
                worst = max(worst, abs(distance - length))
                move = step * (distance - length) / distance / (mobility[k] + mobility[k + 1])
                moved[k] += mobility[k] * move
                moved[k + 1] -= mobility[k + 1] * move
        if worst < tolerance * length:
            break
    return moved


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(5))
def test_against_plain_steps(seed, dim):
    rng = np.random.default_rng(seed)
    joints = np.cumsum(rng.normal(0, 0.01, (40, dim)), axis=0)
    mobility = rng.uniform(0.02, 1.0, 40)
    expected = by_steps(joints, 0.01, mobility, 30, 1e-3)
    np.testing.assert_allclose(equalize_lengths(joints, 0.01, mobility, 30, 1e-3), expected, atol=1e-12)


def test_lengths_come_out_and_a_joint_without_mobility_stays():
    joints = np.column_stack((np.linspace(0, 0.3, 21), 0.02 * np.sin(np.arange(21)), np.ones(21)))
    mobility = np.ones(21)
    mobility[10] = 0.0
    moved = equalize_lengths(joints, 0.02, mobility, 5000, 1e-4)
    assert np.linalg.norm(np.diff(moved, axis=0), axis=1) == pytest.approx(0.02, rel=2e-4)
    assert moved[10].tolist() == joints[10].tolist()
    assert not np.shares_memory(moved, joints)


def test_joints_on_one_place_and_none():
    assert equalize_lengths(np.zeros((3, 3)), 0.1, np.ones(3), 5, 1e-3).tolist() == np.zeros((3, 3)).tolist()
    assert equalize_lengths(np.zeros((0, 3)), 0.1, np.zeros(0), 5, 1e-3).shape == (0, 3)
    with pytest.raises(ValueError, match="one value per joint"):
        equalize_lengths(np.zeros((3, 3)), 0.1, np.ones(2), 5, 1e-3)

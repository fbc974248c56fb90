"""The terms of the deviations of joints, against a plain computation in NumPy."""

import numpy as np
import pytest

from doo3d.kernels import joint_deviations

SPACING, PITCH, NOISE, MAX_RESIDUAL, MAX_OFFSET = 1e-4, 1e-3, 2e-3, 3.0, 1.0
SETTINGS = {"pitch": SPACING, "pitch_per_m": PITCH, "noise": NOISE, "max_residual": MAX_RESIDUAL}


def slow_terms(joints, radius, radii, occluded, share, residual, offset):
    count = len(joints)
    before, after = np.maximum(np.arange(count) - 1, 0), np.minimum(np.arange(count), count - 2)
    radius = radius if np.isfinite(radius) else 0.0
    bulge = np.nan_to_num(radii - radius)
    steps = np.full(count, count - 1)
    for j in range(count):
        for k, hidden in enumerate(occluded):
            away = min(abs(j - k), abs(j - k - 1))
            if (joints[0] == joints[-1]).all():
                away = min(away, *(abs(j + turn * (count - 1) - k - side) for turn in (-1, 1) for side in (0, 1)))
            steps[j] = steps[j] if hidden else min(steps[j], away)
    terms = np.zeros((count, 8))
    terms[:, 0] = SPACING + PITCH * joints[:, 2]
    terms[:, 1] = NOISE * joints[:, 2] ** 2
    if len(share):
        known = offset[np.isfinite(offset)]
        terms[:, 2] = radius * (1 - (share[before] + share[after]) / 2)
        terms[:, 3] = radius * np.maximum(
            *(np.fmin(np.where(np.isnan(residual), MAX_RESIDUAL, residual), MAX_RESIDUAL)[k] for k in (before, after))
        )
        terms[:, 4] = radius * np.sqrt(np.mean(np.minimum(np.abs(known), MAX_OFFSET) ** 2)) if len(known) else radius * MAX_OFFSET
    terms[:, 5] = bulge
    terms[:, 6] = np.sqrt(np.mean(bulge**2))
    terms[:, 7] = steps * np.linalg.norm(joints[1] - joints[0])
    return terms


@pytest.mark.parametrize("seed", range(8))
def test_against_a_plain_computation(seed):
    rng = np.random.default_rng(seed)
    chains, known = [], []
    for number in range(3):
        turn = np.linspace(0, 2 * np.pi, 21)
        joints = np.column_stack((np.cos(turn), np.sin(turn), np.ones(21))) if number == 1 else rng.normal(size=(12, 3))
        joints[-1] = joints[0] if number == 1 else joints[-1]
        joints[1] = joints[0] + (0.1, 0.0, 0.0)
        chains.append(joints)
        count = len(joints)
        occluded = np.ones(count - 1, bool) if number == 2 and seed % 2 else rng.random(count - 1) < 0.7
        gaps = lambda values: np.where(rng.random(len(values)) < 0.3, np.nan, values)  # noqa: E731
        radii = gaps(rng.random(count))
        of = rng.random(count - 1), gaps(4 * rng.random(count - 1)), gaps(rng.normal(size=count - 1))
        known.append((np.nan if number == 2 and seed > 5 else 0.4, radii, occluded, *(of if seed != 3 else (np.zeros(0),) * 3)))
    radius, *others = zip(*known, strict=True)
    bounds = np.cumsum([0, *map(len, chains)])
    values = [np.concatenate(chains), bounds, np.array(radius), *map(np.concatenate, others)]
    expected = np.concatenate([slow_terms(joints, *of) for joints, of in zip(chains, known, strict=True)])
    np.testing.assert_allclose(joint_deviations(*values, np.eye(8), **SETTINGS), np.abs(expected), atol=1e-12)
    weights = rng.random((8, 2))
    np.testing.assert_allclose(joint_deviations(*values, weights, **SETTINGS), np.sqrt(expected**2 @ weights**2), atol=1e-12)


def test_a_chain_without_a_segment_is_refused():
    with pytest.raises(ValueError, match="no segment"):
        joint_deviations(
            np.zeros((1, 3)),
            np.array([0, 1]),
            np.ones(1),
            np.ones(1),
            np.zeros(0, bool),
            *(np.zeros(0),) * 3,
            np.eye(8),
            **SETTINGS,
        )

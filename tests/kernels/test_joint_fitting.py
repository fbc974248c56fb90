"""Joints fitted to strands: against the normal equations of all terms, written out."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.kernels import fit_joints

TURN, PLACE = 0.02, 1e-4


def by_equations(expected, points, arcs, sights, segment):
    """Fit joints to the samples by a dense least-squares problem."""
    count = len(expected)
    at = np.clip(arcs / segment, 0.0, count - 1 - 1e-9)
    low, number = at.astype(int), np.arange(len(arcs))
    weights = np.zeros((len(arcs), count))
    weights[number, low], weights[number, low + 1] = 1 - at + low, at - low
    residual = points - weights @ expected
    residual -= (residual * sights).sum(axis=1, keepdims=True) * sights
    terms = [weights, np.diff(np.eye(count), 2, axis=0), TURN**0.5 * np.diff(np.eye(count), axis=0), PLACE**0.5 * np.eye(count)]
    right = np.zeros((sum(map(len, terms)), 3))
    right[: len(arcs)] = residual
    return expected + np.linalg.lstsq(np.concatenate(terms), right, rcond=None)[0]


def spaced(joints, arcs, segment):
    """Space the joints evenly along their line where no sample is nearest."""
    near = np.rint(arcs / segment).astype(int)
    shown = np.isin(np.arange(len(joints)), near)
    result, marks = joints.copy(), np.flatnonzero(shown)
    for low, high in zip([0, *marks], [*marks, len(joints) - 1], strict=True):
        part = joints[low : high + 1]
        along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(part, axis=0), axis=1)))
        even = np.linspace(0.0, along[-1], len(part))
        result[low : high + 1] = np.column_stack([np.interp(even, along, column) for column in part.T])
    return result


def scene(seed):
    """Return joints, and samples beside them of which some lie beyond the ends and some are known across their sights only."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 60))
    expected = np.cumsum(rng.normal(0.005, 0.006, (count, 3)), axis=0) + np.array([0.0, 0.0, 0.5])
    arcs = rng.uniform(-0.02, 0.01 * count + 0.01, int(rng.integers(1, 80)))
    low = np.clip((arcs / 0.01).astype(int), 0, count - 1)
    points = expected[low] + rng.normal(0.0, 0.01, (len(arcs), 3))
    sights = points / np.linalg.norm(points, axis=1, keepdims=True)
    return expected, points, arcs, np.where(rng.random((len(arcs), 1)) < rng.choice([0.0, 0.3, 1.0]), sights, 0.0)


@pytest.mark.parametrize("seed", range(30))
def test_against_dense_equations(seed):
    expected, points, arcs, sights = scene(seed)
    known = ~sights.any(axis=1)
    true = by_equations(expected, points[known], arcs[known], sights[known], 0.01)
    if not known.all():
        true = by_equations(true, points, arcs, sights, 0.01)
    fitted = fit_joints(expected, points, arcs, sights, 0.01, TURN, PLACE)
    np.testing.assert_allclose(fitted, spaced(true, arcs, 0.01), rtol=0, atol=1e-9)


def test_without_samples_joints_stay():
    joints = np.cumsum(np.full((6, 3), 0.01), axis=0)
    fitted = fit_joints(joints, np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)), 0.01, TURN, PLACE)
    np.testing.assert_array_equal(fitted, joints)


def test_too_few_weights_are_refused():
    joints = np.cumsum(np.full((6, 3), 0.01), axis=0)
    with pytest.raises(ValueError, match="too few"):
        fit_joints(joints, joints[:1], np.zeros(1), np.zeros((1, 3)), 0.01, 0.0, 0.0)

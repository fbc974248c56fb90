"""Joints fitted to strands: against the normal equations of all terms, written out."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.kernels import fit_joints

TURN, PLACE, SLIDE, LENGTH = 0.02, 1e-4, 0.3, 1e4
WEIGHTS = np.array((TURN, PLACE, SLIDE, LENGTH))


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


def with_lengths(base, points, arcs, sights, strands, slides, segment, rounds):
    """Make the sum of all terms least by dense normal equations, three coordinates a joint; return joints and arcs."""
    joints, arcs, count = base.copy(), arcs.copy(), len(base)
    rigid = [np.diff(np.eye(count), 2, axis=0), TURN**0.5 * np.diff(np.eye(count), axis=0), PLACE**0.5 * np.eye(count)]
    rigid = np.kron(sum(term.T @ term for term in rigid), np.eye(3))
    for _ in range(rounds):
        steps = np.diff(joints, axis=0)
        lengths = np.linalg.norm(steps, axis=1)
        if np.abs(lengths - segment).max() <= 1e-3 * segment:
            break
        normal, right = rigid.copy(), rigid @ (base - joints).ravel()
        for k, (step, length) in enumerate(zip(steps, lengths, strict=True)):
            row = np.zeros((count, 3))
            row[k], row[k + 1] = -step / length, step / length
            normal += LENGTH * np.outer(row, row)
            right += LENGTH * (segment - length) * row.ravel()
        for point, arc, sight, strand in zip(points, arcs, sights, strands, strict=True):
            weights, missing, along = at_sample(joints, point, arc, segment)
            missing = missing - (missing @ sight) * sight
            share = np.eye(3) - (1 - SLIDE) * np.outer(along, along) * slides[strand]
            normal += np.kron(np.outer(weights, weights), share)
            right += np.kron(weights, share @ missing)
        move = np.linalg.solve(normal, right)
        joints += min(1.0, segment / np.abs(move).max()) * move.reshape(-1, 3)
        for strand in np.flatnonzero(slides):
            own = np.flatnonzero(strands == strand)
            off = [np.dot(*at_sample(joints, points[i], arcs[i], segment)[1:]) for i in own]
            arcs[own] += np.clip(np.mean(off), -segment, segment)
    return joints, arcs


def at_sample(joints, point, arc, segment):
    """Return the share (J,) of each joint in the place of a sample, what it misses, and the direction of the object there."""
    at = np.clip(arc / segment, 0.0, len(joints) - 1 - 1e-9)
    low = int(at)
    weights = np.zeros(len(joints))
    weights[low], weights[low + 1] = 1 - at + low, at - low
    step = joints[low + 1] - joints[low]
    return weights, point - weights @ joints, step / np.linalg.norm(step)


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
    true = spaced(true, arcs, 0.01)
    bounds, slides = np.array([0, len(arcs)]), np.zeros(1, dtype=bool)
    joints, places = fit_joints(expected, points, arcs, sights, bounds, slides, 0.01, WEIGHTS, 0, 1e-3)
    np.testing.assert_allclose(joints, true, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(places, arcs)


@pytest.mark.parametrize("seed", range(30))
def test_rounds_with_lengths_against_dense_equations(seed):
    expected, points, arcs, sights = scene(seed)
    order = np.argsort(arcs)
    points, arcs, sights = points[order], arcs[order], sights[order]
    bounds = np.array([0, len(arcs) // 3, len(arcs)])
    slides = np.array([seed % 2 == 0, seed % 3 == 0])
    base, _ = fit_joints(expected, points, arcs, sights, bounds, slides, 0.01, WEIGHTS, 0, 1e-3)
    strands = np.repeat([0, 1], np.diff(bounds))
    true, places = with_lengths(base, points, arcs, sights, strands, slides, 0.01, 3)
    joints, moved = fit_joints(expected, points, arcs, sights, bounds, slides, 0.01, WEIGHTS, 3, 1e-3)
    np.testing.assert_allclose(joints, true, rtol=0, atol=1e-7)
    np.testing.assert_allclose(moved, places, rtol=0, atol=1e-7)


def test_a_strand_that_slides_shares_the_length_hidden_on_both_sides():
    """A strand is laid 4 cm off along a straight object: one gap is too long for its length, the other too short."""
    joints = np.column_stack((np.arange(61) * 0.01, np.zeros((61, 2))))
    part = np.r_[0:10, 25:36, 51:61]
    bounds, arcs = np.array([0, 10, 21, 31]), part * 0.01
    wrong = arcs + np.repeat([0.0, 0.04, 0.0], np.diff(bounds))
    sights = np.zeros((31, 3))
    moved = [
        fit_joints(joints, joints[part], wrong, sights, bounds, np.array([False, slides, False]), 0.01, WEIGHTS, 60, 1e-3)[1]
        for slides in (True, False)
    ]
    assert np.abs(moved[0] - arcs).max() < 0.005
    np.testing.assert_array_equal(moved[1], wrong)


def test_without_samples_joints_stay():
    joints = np.cumsum(np.full((6, 3), 0.01), axis=0)
    fitted = fit_joints(
        joints, np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)), np.array([0]), np.zeros(0, dtype=bool), 0.01, WEIGHTS, 5, 1e-3
    )[0]
    np.testing.assert_array_equal(fitted, joints)


def test_too_few_weights_are_refused():
    joints = np.cumsum(np.full((6, 3), 0.01), axis=0)
    with pytest.raises(ValueError, match="too few"):
        fit_joints(
            joints,
            joints[:1],
            np.zeros(1),
            np.zeros((1, 3)),
            np.array([0, 1]),
            np.ones(1, dtype=bool),
            0.01,
            np.zeros(4),
            5,
            1e-3,
        )

"""Laying strands onto an object whose shape is about known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from doo3d.geometry.polyline import arc_length, resample
from doo3d.track.observations import ObservedStrand
from doo3d.track.registration import PLACE_WEIGHT, TURN_WEIGHT, Placed, exact_lengths, fit_joints, place_strands, relax_lengths
from doo3d.track.strand_ends import CUT_OFF, TIP

SEGMENT = 0.01


def curve(length=0.5, turns=0.7):
    t = np.linspace(0, 1, 2001)
    points = np.column_stack((t, 0.3 * np.sin(2 * np.pi * turns * t), 1 + 0.1 * t**2))
    points *= length / arc_length(points)[-1]
    return resample(points, np.linspace(0, arc_length(points)[-1], round(length / SEGMENT) + 1))


def strand(joints, first, last, tips=(CUT_OFF, CUT_OFF), moved=(0.0, 0.0, 0.0), backwards=False):
    points = joints[first : last + 1] + moved
    points, tips = (points[::-1], tips[::-1]) if backwards else (points, tips)
    arcs = np.arange(len(points)) * SEGMENT
    return ObservedStrand(points, arcs, float(arcs[-1]), tips, 0)


@pytest.mark.parametrize("backwards", [False, True])
def test_a_strand_finds_its_place_and_its_direction(backwards):
    joints = curve()
    (placed,) = place_strands([strand(joints, 12, 30, moved=(0.004, 0.0, 0.003), backwards=backwards)], joints, 0.5, 0.05)
    np.testing.assert_allclose(np.sort(placed.arcs), np.arange(12, 31) * SEGMENT, atol=0.012)
    assert (placed.arcs[0] > placed.arcs[-1]) == backwards


def test_a_tip_in_plain_view_is_the_tip_of_the_object():
    """The object moved on along itself by 3 cm, which its shape alone does not tell."""
    joints = np.column_stack((np.arange(51) * SEGMENT, np.zeros((51, 1)), np.ones((51, 1))))
    seen = strand(joints, 0, 25, tips=(TIP, CUT_OFF), moved=(0.03, 0.0, 0.0))
    (placed,) = place_strands([seen], joints, 0.5, 0.05)
    assert placed.span == pytest.approx((0.0, 0.25), abs=0.004)
    bent, covered, _ = fit_joints(joints, [placed], 0.5)
    assert bent[0] == pytest.approx(joints[0] + (0.03, 0, 0), abs=2e-3)
    assert bent[-1] == pytest.approx(joints[-1] + (0.03, 0, 0), abs=5e-3)
    assert covered.tolist() == [True] * 26 + [False] * 25


def test_a_stretch_without_depth_keeps_its_place_in_the_image():
    """It lies where the camera sees it, and as deep as what is measured beside it says."""
    joints = np.column_stack((np.arange(51) * SEGMENT - 0.25, np.zeros((51, 1)), np.full(51, 1.0)))
    true = joints + np.column_stack((np.zeros(51), 0.01 * np.sin(np.linspace(0, np.pi, 51)), np.full(51, 0.02)))
    shown = true.copy()
    shown[15:35] *= 1.2  # depth lost: the background's in its place
    rays = shown / np.linalg.norm(shown, axis=1, keepdims=True)
    sight = np.where((np.arange(51)[:, None] >= 15) & (np.arange(51)[:, None] < 35), rays, 0.0)
    seen = ObservedStrand(shown, np.arange(51) * SEGMENT, 0.5, (TIP, TIP), 0, sight)
    (placed,) = place_strands([seen], joints, 0.5, 0.05)
    bent, covered, _ = fit_joints(joints, [placed], 0.5)
    assert covered.all()
    pixels = 600 * bent[:, :2] / bent[:, 2:]
    assert np.abs(pixels - 600 * true[:, :2] / true[:, 2:])[:, 1].max() < 0.5
    assert np.abs(bent[:, 2] - true[:, 2]).max() < 0.005


def test_strands_do_not_lie_on_each_other():
    joints = np.column_stack((np.arange(51) * SEGMENT, np.zeros((51, 1)), np.ones((51, 1))))
    first = strand(joints, 0, 20)
    beside, over = (strand(joints, start, start + 19, moved=(0.0, 0.002, 0.0)) for start in (17, 5))
    spans = sorted(item.span for item in place_strands([first, beside], joints, 0.5, 0.5))
    assert len(spans) == 2
    assert spans[1][0] - spans[0][1] > -0.2 * 0.2
    assert len(place_strands([first, over], joints, 0.5, 0.5)) == 1  # it would have to lie 11 cm from where it is seen


def test_a_strand_of_something_else_is_left_out():
    joints = curve()
    assert place_strands([strand(joints, 5, 20, moved=(0.0, 0.0, 0.6))], joints, 0.5, 0.03) == []
    too_long = ObservedStrand(np.zeros((90, 3)), np.arange(90) * SEGMENT, 0.9, (CUT_OFF, CUT_OFF), 0)
    assert place_strands([too_long], joints, 0.5, 1.0) == []


def test_what_lies_between_strands_moves_with_them():
    joints = curve()
    moved = (0.02, 0.01, -0.01)
    ends = [strand(joints, 0, 15, (TIP, CUT_OFF), moved), strand(joints, 36, 50, (CUT_OFF, TIP), moved)]
    placed = place_strands(ends, joints, 0.5, 0.05)
    bent, seen, _ = fit_joints(joints, placed, 0.5)
    np.testing.assert_allclose(bent, joints + moved, atol=2.5e-3)
    assert seen[:16].all()
    assert seen[36:].all()
    assert not seen[18:34].any()


def test_without_strands_the_expected_shape_stays():
    joints = curve()
    bent, seen, _ = fit_joints(joints, [], 0.5)
    np.testing.assert_allclose(bent, joints, atol=1e-4)
    assert not seen.any()


def test_segments_get_one_length():
    rng = np.random.default_rng(0)
    rough = curve() + rng.normal(0, 0.0015, (51, 3))
    fixed = np.zeros(51, dtype=bool)
    even = relax_lengths(rough, SEGMENT, fixed)
    assert np.linalg.norm(np.diff(even, axis=0), axis=1) == pytest.approx(SEGMENT, rel=0.05)
    exact = exact_lengths(even, SEGMENT)
    assert np.linalg.norm(np.diff(exact, axis=0), axis=1) == pytest.approx(SEGMENT, rel=1e-9)
    assert np.abs(exact - even).max() < 2e-3


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_joints_move_hardly_more_than_they_must_to_exact_lengths(seed, dim):
    rng = np.random.default_rng(seed)
    joints = np.cumsum(np.column_stack((np.full((12, 1), 1.0), rng.normal(0, 0.3, (12, dim - 1)))), axis=0)

    def lengths(flat):
        return np.linalg.norm(np.diff(flat.reshape(joints.shape), axis=0), axis=1) - 1.0

    least = minimize(
        lambda flat: ((flat - joints.ravel()) ** 2).sum(),
        joints.ravel(),
        constraints={"type": "eq", "fun": lengths},
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 500},
    )
    moved = exact_lengths(joints, 1.0)
    assert np.linalg.norm(np.diff(moved, axis=0), axis=1) == pytest.approx(1.0, abs=1e-12)
    assert ((moved - joints) ** 2).sum() <= 1.2 * least.fun
    assert moved.mean(axis=0) == pytest.approx(joints.mean(axis=0), abs=1e-9)


def test_exact_lengths_of_lines_that_fold_back_or_lie_on_one_place():
    folded = np.column_stack((np.concatenate((np.arange(6), np.arange(4, -1, -1))) * 0.9, np.zeros((11, 2))))
    for joints in (folded, np.zeros((3, 3))):
        moved = exact_lengths(joints, 1.0)
        assert np.linalg.norm(np.diff(moved, axis=0), axis=1) == pytest.approx(1.0, abs=1e-12)


def by_equations(expected, points, arcs, sights, segment):
    """Fit joints to the samples by a dense least-squares problem."""
    count = len(expected)
    at = np.clip(arcs / segment, 0.0, count - 1 - 1e-9)
    low, number = at.astype(int), np.arange(len(arcs))
    weights = np.zeros((len(arcs), count))
    weights[number, low], weights[number, low + 1] = 1 - at + low, at - low
    residual = points - weights @ expected
    residual -= (residual * sights).sum(axis=1, keepdims=True) * sights
    terms = [
        weights,
        np.diff(np.eye(count), 2, axis=0),
        TURN_WEIGHT**0.5 * np.diff(np.eye(count), axis=0),
        PLACE_WEIGHT**0.5 * np.eye(count),
    ]
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


@pytest.mark.parametrize("seed", range(12))
def test_joints_are_fitted_as_by_dense_equations(seed):
    expected, points, arcs, sights = scene(seed)
    known, length = ~sights.any(axis=1), 0.01 * (len(expected) - 1)
    true = by_equations(expected, points[known], arcs[known], sights[known], 0.01)
    if not known.all():
        true = by_equations(true, points, arcs, sights, 0.01)
    bent, seen, _ = fit_joints(expected, [Placed(arcs, points, (0.0, length), 0.0, sights)], length)
    np.testing.assert_allclose(bent, relax_lengths(spaced(true, arcs, 0.01), 0.01, seen), rtol=0, atol=1e-7)

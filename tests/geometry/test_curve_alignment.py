"""The alignment of a path with curves, against all sequences of candidates."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from doo3d.geometry.curve_alignment import JUMP, Candidates, nearest_samples

MISFIT = 2.0


def candidates(point, curve, arc, distance=None, direction=0, period=np.inf, unit=1.0):
    count = len(point)
    return Candidates(
        point=np.array(point),
        curve=np.array(curve),
        arc=np.array(arc, dtype=float),
        distance=np.zeros(count) if distance is None else np.array(distance, dtype=float),
        tolerance=np.ones(count),
        slack=np.full(count, 0.1),
        direction=np.broadcast_to(direction, count),
        period=np.full(count, period),
        path_position=np.array(point, dtype=float),
        path_unit=unit,
    )


def total_cost(options, chosen):
    steps = options.step_cost(np.array(chosen[:-1]), np.array(chosen[1:]))
    return steps.sum() + MISFIT * ((options.distance / options.tolerance)[list(chosen)] ** 2).sum()


@pytest.mark.parametrize("direction", [0, (1, -1)])
@pytest.mark.parametrize("seed", range(5))
def test_the_chosen_candidates_cost_least_of_all_sequences(seed, direction):
    rng = np.random.default_rng(seed)
    point = np.sort(np.concatenate((np.arange(6), rng.integers(0, 6, 10))))
    directions = rng.choice(direction, len(point)) if direction else 0
    options = candidates(point, rng.integers(0, 2, len(point)), rng.uniform(0, 6, len(point)), rng.random(len(point)), directions)
    chosen = options.choose(MISFIT)
    assert point[chosen].tolist() == list(range(6))
    every = product(*(np.flatnonzero(point == k) for k in range(6)))
    assert total_cost(options, chosen) == pytest.approx(min(total_cost(options, sequence) for sequence in every))


def test_a_path_past_a_crossing_stays_on_its_curve():
    """At the crossing the other curve is nearer."""
    options = candidates([0, 1, 1, 2], [0, 0, 1, 0], [0, 1, 5, 2], [0, 0.5, 0.1, 0])
    assert options.curve[options.choose(MISFIT)].tolist() == [0, 0, 0]


@pytest.mark.parametrize(("a", "b", "jumps"), [(0, 1, False), (1, 0, False), (0, 9.5, False), (9.5, 0, False), (0, 5, True)])
def test_the_shorter_way_round_a_closed_curve_counts(a, b, jumps):
    options = candidates([0, 1], [0, 0], [a, b], period=10.0)
    assert (options.step_cost(0, 1) == JUMP) == jumps


@pytest.mark.parametrize(
    ("direction", "arc", "jumps"), [(1, 1, False), (1, -1, True), (-1, -1, False), (-1, 1, True), (0, -1, False)]
)
def test_a_direction_is_kept(direction, arc, jumps):
    options = candidates([0, 1], [0, 0], [0, arc], direction=direction)
    assert (options.step_cost(0, 1) == JUMP) == jumps


def test_path_positions_are_in_units():
    assert candidates([0, 2], [0, 0], [0, 0.02], unit=0.01).step_cost(0, 1) == 0


def test_no_candidates_and_points_without_any():
    assert len(candidates([], [], []).choose(MISFIT)) == 0
    assert candidates([1, 4], [0, 0], [1, 4]).choose(MISFIT).tolist() == [0, 1]


def test_nearest_samples_are_local_minima_within_the_limits():
    distances = np.array([[3.0, 1.0, 2.0, 2.0, 0.5, 4.0], [0.4, 1.0, 2.0, 3.0, 2.0, 0.5]])
    found = list(zip(*(part.tolist() for part in nearest_samples(distances, np.full(6, 1.0), 1)), strict=True))
    assert found == [(0, 1), (0, 4), (1, 0), (1, 5)]
    found = list(zip(*(part.tolist() for part in nearest_samples(distances, np.full(6, 1.0), 1, "wrap")), strict=True))
    assert found == [(0, 1), (0, 4), (1, 0)]

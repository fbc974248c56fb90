"""Strands placed along an object: against every start tried by itself."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.geometry.polyline import arc_length, resample
from doo3d.kernels import strand_places

STEPS, ERROR, SHIFTS, OVERLAP, MOST_OF_TIP, MOST = 3.0, 0.021, 2.5, 0.2, 25.0, 9.0
SETTINGS = {"steps": STEPS, "length_error": ERROR, "shift_tolerances": SHIFTS, "max_tip_cost": MOST_OF_TIP}


def by_trying(strands, expected, length, tolerance):
    """Place strands (points, arcs, sights, length, tips) as the kernel does: the longest first, at the start of least cost."""
    step = length / (len(expected) - 1) / STEPS
    samples = resample(expected, np.linspace(0.0, arc_length(expected)[-1], round(length / step) + 1))
    places = [(np.nan, np.inf, False)] * len(strands)
    placed = []
    for number in sorted(range(len(strands)), key=lambda k: -strands[k][3]):
        points, arcs, sights, own, tips = strands[number]
        if own > length + 2 * ERROR * length:
            continue
        starts = np.arange(-ERROR * length, max(length - own + ERROR * length, -ERROR * length) + step, step)
        best = (np.inf, np.nan, False)
        for backwards in (False, True):
            at = own - arcs if backwards else arcs
            index = np.arange(len(starts))[:, None] + np.rint((starts[0] + at) / step).astype(int)
            index = np.clip(index, 0, len(samples) - 1)
            off = points - samples[index]
            off -= (off * sights).sum(axis=2, keepdims=True) * sights
            mean = (off**2).sum(axis=2).mean(axis=1)
            shift = (off.mean(axis=1) ** 2).sum(axis=1)
            shape = np.maximum(mean - shift, 0.0)
            first, last = tips[::-1] if backwards else tips
            cost = (shape + shift / SHIFTS**2) / (ERROR * length) ** 2
            cost += first * np.minimum((starts / (ERROR * length / 2)) ** 2, MOST_OF_TIP)
            cost += last * np.minimum(((starts + own - length) / (ERROR * length / 2)) ** 2, MOST_OF_TIP)
            allowed = (shape <= tolerance**2) & (shift <= (SHIFTS * tolerance) ** 2)
            ends = points[[-1, 0]] if backwards else points[[0, -1]]
            for low, high, before, after in placed:
                slack, margin = 3 * step + OVERLAP * own / 4, OVERLAP * own
                behind, ahead = starts - high, low - (starts + own)
                follows = (behind > -margin) & (behind >= np.linalg.norm(ends[0] - after) - slack)
                allowed &= follows | ((ahead > -margin) & (ahead >= np.linalg.norm(ends[1] - before) - slack))
            cost = np.where(allowed, cost, np.inf)
            if cost.min() < best[0]:
                best = cost.min(), starts[cost.argmin()], backwards
        if best[0] < MOST:
            cost, start, backwards = best
            places[number] = start, cost, backwards
            placed.append((start, start + own, *(points[[-1, 0]] if backwards else points[[0, -1]])))
        else:
            places[number] = np.nan, best[0], best[2]
    return places


def scene(seed):
    """Return a curve and noisy strands of it, some of them turned around, moved away or in each other's place."""
    rng = np.random.default_rng(seed)
    segments = int(rng.integers(2, 90))
    turns = np.cumsum(rng.normal(0.0, 0.15, (segments, 3)), axis=0)
    expected = np.cumsum(0.01 * turns / np.linalg.norm(turns, axis=1, keepdims=True), axis=0)
    expected = np.concatenate((np.zeros((1, 3)), expected))
    strands = []
    for _ in range(rng.integers(1, 5)):
        first, last = np.sort(rng.choice(segments + 1, 2, replace=False))
        points = expected[first : last + 1] + rng.normal(0.0, 0.003, (last - first + 1, 3)) + rng.normal(0.0, 0.004, 3)
        points = points[::-1].copy() if rng.random() < 0.5 else points
        arcs = np.arange(len(points)) * 0.01003
        measured = rng.random(len(points)) < rng.choice([0.0, 0.7, 1.0], p=[0.1, 0.5, 0.4])
        sights = np.where(measured[:, None], 0.0, [0.0, 0.6, 0.8])
        strands.append((points, arcs, sights, float(arcs[-1]), tuple(rng.choice([0.0, 0.5, 1.0], 2))))
    return strands, expected, 0.01 * segments, float(rng.choice([0.005, 0.02, 0.1]))


@pytest.mark.parametrize("seed", range(40))
def test_against_every_start_by_itself(seed):
    strands, expected, length, tolerance = scene(seed)
    points, arcs, sights, lengths, tips = zip(*strands, strict=True)
    bounds = np.cumsum([0, *map(len, points)])
    starts, costs, backwards = strand_places(
        np.concatenate(points), np.concatenate(arcs), np.concatenate(sights), bounds, np.array(lengths), np.array(tips),
        expected, length, tolerance, **SETTINGS,
    )  # fmt: skip
    for found, true in zip(zip(starts, costs, backwards, strict=True), by_trying(*scene(seed)), strict=True):
        assert found == pytest.approx(true, rel=1e-9, abs=1e-12, nan_ok=True)


def test_a_strand_longer_than_the_object_has_no_place():
    line = np.column_stack((np.arange(11.0), np.zeros((11, 2))))
    strand = (line, np.arange(11.0), np.zeros((11, 3)), np.array([0, 11]), np.array([10.0]), np.ones((1, 2)))
    starts, costs, _ = strand_places(*strand, line[:9], 8.0, 1.0, **SETTINGS)
    assert np.isnan(starts[0])
    assert costs[0] == np.inf

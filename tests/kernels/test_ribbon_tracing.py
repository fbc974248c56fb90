"""A strand followed along ribbons, against the same with NumPy."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from doo3d.kernels import follow_ribbon

DIRECTIONS, SHAPE = 16, (90, 120)
WIDTHS, TURNS, SHIFTS = np.array((3.0, 6.0)), np.radians((-7.0, -4.5, -2.0, 0.0, 2.0, 4.5, 7.0)), np.array((-1.0, 0.0, 1.0))
SHIFT_COST, TURN_COST, MEMORY, MIN_SCORE, GAP_WIDTHS, GAP, SHARED, MAX_SAMPLES = 0.15, 0.6, 0.93, 0.9, 4.0, 8.0, 8, 2000
STEP, SCALE, MAX_COLOR, COLOR, MAX_SCORE, SAME_TURN = 2.0, 8.0, 6.0, 0.5, 3.0, 0.44
COSTS = {"color_scale": SCALE, "max_color_cost": MAX_COLOR, "color_cost": COLOR}
LIMITS = {"step": STEP, "max_score": MAX_SCORE, "same_turn": SAME_TURN}


def direction(angle):
    return np.rint(angle / np.pi * DIRECTIONS).astype(int) % DIRECTIONS


def color_cost(difference):
    return COLOR * np.minimum((difference**2).sum(axis=-1) / SCALE**2, MAX_COLOR)


def between(first, second):
    return abs((first - second + np.pi / 2) % np.pi - np.pi / 2)


def slow(score, width, color, taken, angles, start):
    turns, shifts = (part.ravel()[:, None] for part in np.meshgrid(TURNS, SHIFTS, indexing="ij"))
    x, y, angle = start
    turn, gap, shared = 0.0, 0.0, 0
    own = color[round(y), round(x)]
    wide = WIDTHS[width[direction(angle), round(y), round(x)]]
    samples = []
    while len(samples) < MAX_SAMPLES:
        heading = angle + turns * np.arange(1, 4)
        u = x + np.cumsum(STEP * np.cos(heading), axis=1) - shifts * np.sin(angle)
        v = y + np.cumsum(STEP * np.sin(heading), axis=1) + shifts * np.cos(angle)
        inside = (np.rint(u) >= 0) & (np.rint(v) >= 0) & (np.rint(u) < SHAPE[1]) & (np.rint(v) < SHAPE[0])
        columns, rows = (np.clip(np.rint(at).astype(int), 0, size - 1) for at, size in ((u, SHAPE[1]), (v, SHAPE[0])))
        value = np.minimum(score[direction(heading), rows, columns], MAX_SCORE) - color_cost(color[rows, columns] - own)
        value = np.where(inside, value, -1.0)
        cost = SHIFT_COST * np.abs(shifts[:, 0]) + TURN_COST * np.abs(turns[:, 0] - turn) / TURNS[-1]
        best = np.argmax(value.mean(axis=1) - cost)
        seen = value[best, 0] > MIN_SCORE and value[best].mean() > MIN_SCORE
        if seen:
            turn, angle, x, y, gap = turns[best, 0], heading[best, 0], u[best, 0], v[best, 0], 0.0
            at = rows[best, 0], columns[best, 0]
            wide = 0.8 * wide + 0.2 * WIDTHS[width[(direction(angle), *at)]]
            own = MEMORY * own + (1 - MEMORY) * color[at]
        else:
            angle, turn, gap = angle + turn / 2, 0.8 * turn, gap + STEP
            x, y = x + STEP * np.cos(angle), y + STEP * np.sin(angle)
        row, column = round(y), round(x)
        if not (0 <= column < SHAPE[1] and 0 <= row < SHAPE[0]):
            break
        shared = shared + 1 if taken[row, column] and between(angle, angles[row, column]) < SAME_TURN else 0
        samples.append((x, y, angle, wide, value[best, 0] if seen else np.nan))
        if shared > SHARED:
            del samples[-SHARED:]
            break
        if gap > GAP_WIDTHS * wide + GAP:
            break
    while samples and np.isnan(samples[-1][4]):
        samples.pop()
    return np.array(samples).reshape(-1, 5)


def ribbons(seed):
    """A bend that answers in its direction, a gap in it, noise, and an earlier strand across and along it."""
    random = np.random.default_rng(seed)
    score = random.normal(0.2, 0.4, (DIRECTIONS, *SHAPE)).astype(np.float32)
    width = random.integers(0, 2, score.shape).astype(np.uint8)
    color = random.normal(0, 2, (*SHAPE, 3)).astype(np.float32)
    x = np.linspace(5, 110, 300)
    y = 45 + 25 * np.sin(x / 25)
    for u, v, along in zip(x, y, np.arctan2(np.cos(x / 25), 1), strict=True):
        if not 60 < u < 66:
            for turn in (-1, 0, 1):
                score[(direction(along) + turn) % DIRECTIONS, round(v) - 1 : round(v) + 2, round(u)] = random.uniform(1.5, 4)
        color[round(v) - 1 : round(v) + 2, round(u)] += 20
    taken, angles = np.zeros(SHAPE, np.uint8), np.zeros(SHAPE, np.float32)
    cv2.line(taken, (40, 0), (40, 89), 1, 3)
    angles[taken > 0] = np.pi / 2
    taken[:, 100:] = 1
    angles[:, 100:] = np.arctan2(np.cos(4.2), 1)
    return score, width, color, taken, angles


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("start", [(25, 66, 0.3), (80, 44, 2.5), (3, 3, -2.0), (60, 62, 0.0), (119, 89, 9.0)])
def test_as_with_numpy(seed, start):
    images = ribbons(seed)
    found = follow_ribbon(*images, np.array(start, float), WIDTHS, **COSTS, **LIMITS)
    np.testing.assert_allclose(found, slow(*images, np.array(start, float)), rtol=0, atol=1e-9)


def test_a_strand_goes_on_beyond_a_gap_and_ends_on_an_earlier_one():
    found = follow_ribbon(*ribbons(0), np.array((25.0, 66.0, 0.2)), WIDTHS, **COSTS, **LIMITS)
    assert np.isnan(found[:, 4]).any()
    assert not np.isnan(found[-1, 4])
    assert 95 < found[-1, 0] < 105
    assert np.linalg.norm(np.diff(found[:, :2], axis=0), axis=1).max() < 3


def test_a_start_beyond_the_image_is_refused():
    with pytest.raises(ValueError, match="start"):
        follow_ribbon(*ribbons(0), np.array((120.0, 0.0, 0.0)), WIDTHS, **COSTS, **LIMITS)

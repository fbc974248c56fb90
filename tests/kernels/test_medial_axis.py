"""Medial axis of a mask, against plain loops."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from doo3d.kernels import medial_axis

STEPS = {1: 1.0, 2: 1.4, 5: 2.1969}  # squared length of a step on the grid -> px
OFFSETS = [(v, u) for v in range(-2, 3) for u in range(-2, 3) if v * v + u * u in STEPS]


def slow_distance(mask):
    """Every pixel by way of every neighbour, until nothing becomes shorter."""
    height, width = mask.shape
    distance = np.where(np.pad(mask, 2), np.inf, 0.0)
    before = None
    while before is None or (before != distance).any():
        before = distance.copy()
        for v, u in OFFSETS:
            way = before[2 + v : 2 + v + height, 2 + u : 2 + u + width] + STEPS[v * v + u * u]
            distance[2:-2, 2:-2] = np.minimum(distance[2:-2, 2:-2], way)
    return distance


@pytest.mark.parametrize("blur", [0.0, 1.0, 2.5, 5.0])
@pytest.mark.parametrize("seed", range(3))
def test_against_plain_loops(seed, blur):
    noise = np.random.default_rng(seed).random((37, 45))
    mask = (cv2.GaussianBlur(noise, (0, 0), blur) if blur else noise) > 0.45
    distance = slow_distance(mask)
    expected = {}
    for v, u in np.argwhere(mask):
        if distance[v + 2, u + 2] >= distance[v + 1 : v + 4, u + 1 : u + 4].max() - 1e-3:
            expected[int(v), int(u)] = distance[v + 2, u + 2]
    rows, columns, inside = medial_axis(mask)
    found = dict(zip(zip(rows.tolist(), columns.tolist(), strict=True), inside.tolist(), strict=True))
    assert len(found) == len(rows)
    assert found == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (2, 2), (9, 9)])
def test_round_the_mask_is_outside(shape):
    """A mask that fills its image, which is how a mask is cut out by its box."""
    rows, columns, inside = medial_axis(np.ones(shape, bool))
    assert inside.max() == (min(shape) + 1) // 2
    assert rows.size
    assert (inside == np.minimum.reduce((rows + 1, columns + 1, shape[0] - rows, shape[1] - columns))).all()


def test_an_empty_mask_has_none():
    assert all(part.size == 0 for part in medial_axis(np.zeros((4, 5), bool)))

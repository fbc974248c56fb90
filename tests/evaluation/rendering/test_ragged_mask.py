"""Ragged masks: wavy, with pieces lost and added, the same for the same seed."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt, label

from doo3d.evaluation.rendering import ragged_mask as module
from doo3d.evaluation.rendering.ragged_mask import ragged_mask


def strip(width=11, shape=(120, 400)):
    mask = np.zeros(shape, dtype=bool)
    mask[60 - width // 2 : 60 + (width + 1) // 2, 20:-20] = True
    return mask


def only_border(monkeypatch):
    monkeypatch.setattr(module, "LOST", (0, 0))
    monkeypatch.setattr(module, "FALSE", (0, 0))


def test_the_same_numbers_give_the_same_mask():
    one, other, third = (ragged_mask(strip(), np.random.default_rng(seed)) for seed in (5, 5, 6))
    assert np.array_equal(one, other)
    assert not np.array_equal(one, third)


def test_the_border_moves_by_up_to_three_pixels_both_ways(monkeypatch):
    only_border(monkeypatch)
    monkeypatch.setattr(module, "CLOSED_GAP_PX", (0.0, 0.0))
    true, amplitudes = strip(21), []
    for seed in range(8):
        found = ragged_mask(true, np.random.default_rng(seed))
        outside, inside = distance_transform_edt(~true)[found].max(), distance_transform_edt(true)[~found].max()
        amplitudes += [outside, inside]
    assert 1 <= min(amplitudes)
    assert 2 <= max(amplitudes) <= 4


def test_a_thin_cable_is_not_torn_by_the_border_alone(monkeypatch):
    only_border(monkeypatch)
    for seed in range(5):
        assert label(ragged_mask(strip(3), np.random.default_rng(seed)))[1] == 1


def test_narrow_gaps_are_closed(monkeypatch):
    only_border(monkeypatch)
    monkeypatch.setattr(module, "CLOSED_GAP_PX", (6.0, 6.0))
    mask = strip(11)
    mask[72:83, 20:-20] = True
    gap = [ragged_mask(mask, np.random.default_rng(seed))[66:72, 30:-30].all(axis=0).mean() for seed in range(4)]
    assert np.mean(gap) > 0.5


def test_pieces_are_lost_and_blobs_added():
    true = strip()
    lost = added = 0
    for seed in range(10):
        found = ragged_mask(true, np.random.default_rng(seed))
        lost += (true & ~found)[:, 30:-30].all(axis=0).any() or (~found[58:63, 30:-30]).all(axis=0).any()
        added += (found & (distance_transform_edt(~true) > 4)).any()
    assert lost >= 8
    assert added >= 8


def test_an_empty_mask_stays_empty():
    assert not ragged_mask(np.zeros((30, 40), dtype=bool), np.random.default_rng(0)).any()


@pytest.mark.parametrize("width", [1, 2, 40])
def test_any_width(width):
    assert ragged_mask(strip(width), np.random.default_rng(0)).any()

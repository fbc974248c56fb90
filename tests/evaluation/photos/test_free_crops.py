"""Parts of photographs that are free of cables."""

import numpy as np
import pytest

from doo3d.evaluation.photos.free_crops import free_rectangle


def test_the_largest_part_beside_a_cable_keeps_its_margin():
    mask = np.zeros((480, 800), dtype=bool)
    mask[:, 400:404] = True
    rows, columns = free_rectangle(mask)
    assert (rows.start, rows.stop) == (0, 480)
    assert (columns.start, columns.stop) == (0, 384) or (columns.start, columns.stop) == (420, 800)
    assert columns.stop - columns.start >= 380


def test_nothing_is_cut_where_no_part_is_large_enough():
    mask = np.zeros((480, 640), dtype=bool)
    mask[240, ::25] = True
    assert free_rectangle(mask, (320, 240)) is None
    assert free_rectangle(mask, (320, 200)) is not None
    assert free_rectangle(np.ones((480, 640), dtype=bool)) is None


@pytest.mark.parametrize("seed", range(3))
def test_it_is_the_largest_of_all_parts(seed):
    rng = np.random.default_rng(seed)
    mask = np.zeros((80, 96), dtype=bool)
    mask[tuple(rng.integers((80, 96), size=(6, 2)).T)] = True
    best = 0
    for top in range(0, 80, 4):
        for bottom in range(top + 16, 81, 4):
            free = ~mask[top:bottom].any(axis=0)
            for left in range(0, 96, 4):
                stop = left
                while stop < 96 and free[stop : stop + 4].all():
                    stop += 4
                best = max(best, (bottom - top) * (stop - left) if stop - left >= 16 else 0)
    rows, columns = free_rectangle(mask, (16, 16), 0)
    assert not mask[rows, columns].any()
    assert (rows.stop - rows.start) * (columns.stop - columns.start) == best

"""The elements that the kernels looked at: counted by each thread, and in proportion to the work."""

from __future__ import annotations

import threading

import numpy as np

from doo3d.kernels import FrameFacts, bounding_box, visits


def counted(kernel, *arguments) -> int:
    visits()
    kernel(*arguments)
    return visits()


def test_visits_start_at_0_after_they_are_read():
    bounding_box(np.ones((20, 20), bool))
    assert visits() > 0
    assert visits() == 0


def test_each_thread_has_visits_of_its_own():
    visits()
    other = []
    thread = threading.Thread(target=lambda: other.append(counted(bounding_box, np.ones((20, 20), bool))))
    thread.start()
    thread.join()
    assert other[0] > 0
    assert visits() == 0


def test_a_larger_frame_around_a_mask_adds_its_scan_only():
    small, large = np.zeros((80, 80), bool), np.zeros((160, 160), bool)
    small[10:30, 10:30] = large[10:30, 10:30] = True
    scans = 1  # into runs
    assert counted(bounding_box, large) - counted(bounding_box, small) == scans * (large.size - small.size) // 8


def test_a_window_counts_its_pixels():
    depth, mask = np.ones((40, 40), np.float32), np.zeros((40, 40), bool)
    mask[18:23, 18:23] = True
    facts = FrameFacts(mask, depth)
    counts = [counted(facts.agreeing_readings, 0.5, 1.5, half_width, 0.1, 1, 1) for half_width in (1, 2)]
    assert counts[1] - counts[0] >= 25 * (25 - 9)

"""Which of the possible shapes of an object counts in each frame."""

from __future__ import annotations

import numpy as np

from doo3d.track.follow import most_likely_path
from doo3d.track.registration import MISSING_COST
from doo3d.track.shape import Shape

TOLERANCE = 0.01


def shape(y, cost):
    """A straight object at a place across, m."""
    seen = np.ones(5, dtype=bool)
    joints = np.column_stack((np.linspace(0, 0.2, 5), np.full(5, y), np.full(5, 0.6)))
    return Shape(joints, seen, np.zeros(5, dtype=int), cost, ~seen, seen)


def path(*frames):
    """The places of the shapes that are chosen of (place, cost) in each frame; None without one."""
    found = most_likely_path([[shape(*each) for each in frame] for frame in frames], TOLERANCE)
    return [None if one is None else one.joints[0, 1] for one in found]


def test_the_sum_of_all_costs_is_least_though_another_shape_of_the_first_frame_costs_less():
    near, far = (0.0, 3.0), (0.1, 1.0)
    assert path([near, far], [near], [near]) == [0.0, 0.0, 0.0]
    assert path([near, far], [near, far], [near, far]) == [0.1, 0.1, 0.1]


def test_a_frame_in_which_the_wrong_shape_fits_better_is_bridged_and_many_are_not():
    right, wrong = [(0.0, 0.0), (0.1, 4.0)], [(0.0, 4.0), (0.1, 0.0)]
    assert path(*[right] * 3, wrong, *[right] * 3) == [0.0] * 7
    many = int(2 * MISSING_COST / 4) + 1  # misfits that cost more than two changes of place
    assert path(*[right] * many, *[wrong] * many, *[right] * many) == [0.0] * many + [0.1] * many + [0.0] * many


def test_frames_without_shapes_end_a_path_and_the_next_one_begins_anywhere():
    first, second = [(0.0, 0.0), (0.1, 4.0)], [(0.0, 4.0), (0.1, 0.0)]
    assert path([], first, first, [], [], second, second, []) == [None, 0.0, 0.0, None, None, 0.1, 0.1, None]
    assert path(first, first, second, second) == [0.0] * 4
    assert path() == []

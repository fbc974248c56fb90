"""Which of the two passes over time counts."""

from __future__ import annotations

import numpy as np

from doo3d.track.follow import _prefer_forward
from doo3d.track.frame_evidence import Evidence
from doo3d.track.registration import Placed
from doo3d.track.shape import Shape

NOTHING = Placed(np.zeros(0), np.zeros((0, 3)), (0.0, 1.0), 0.0)


def test_between_two_anchors_each_pass_counts_until_it_lays_a_strand_wrongly():
    """A pass that got lost fits well afterwards: only the frame in which that happened costs."""

    def shapes(costs):
        nothing = np.zeros(2, dtype=bool)
        return [Shape(np.zeros((2, 3)), nothing, np.zeros(2, dtype=int), cost, nothing, nothing) for cost in costs]

    anchor, free = Evidence((NOTHING,), NOTHING.points, ()), Evidence((), NOTHING.points, ())
    clues = [anchor, *[free] * 6, anchor]
    forward = [0.0, 0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0]  # lost in frame 4
    backward = [0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 0.0]  # lost in frame 3
    assert _prefer_forward(clues, shapes(forward), shapes(backward))[1:7] == [True] * 3 + [False] * 3
    assert _prefer_forward(clues, shapes([0.0] * 8), shapes(backward))[1:4] == [True] * 3
    assert not any(_prefer_forward(clues, shapes(forward), shapes([0.0] * 8))[1:7])
    assert not any(_prefer_forward(clues, [None] * 8, shapes(backward)))

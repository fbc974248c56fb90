"""Objects that are lost and come back."""

from __future__ import annotations

import numpy as np

from doo3d.config import load_config
from doo3d.track.detect_sequence import combine
from doo3d.track.observations import Observation
from doo3d.types import Chain, Detection

SEGMENT = 0.01


def chain(y, count, backwards=False):
    x = SEGMENT * (np.arange(count) - count // 2)
    joints = np.column_stack((x, np.full(count, y), np.full(count, 0.6)))
    return Chain(joints[::-1] if backwards else joints, SEGMENT, 0.004, confidence=1.0)


def test_a_cable_that_is_lost_twice_keeps_its_direction():
    """Where it comes back first, its chains begin at the other end."""
    seen = {**dict.fromkeys(range(30), False), **dict.fromkeys(range(65, 95), True), **dict.fromkeys(range(130, 160), False)}
    chains = [(chain(0.15, 61), *([chain(-0.1, 41, seen[frame])] if frame in seen else [])) for frame in range(160)]
    found = combine(
        [Observation(Detection(each, coordinates="camera", frame="f"), ()) for each in chains], load_config("default")
    )
    starts = {chain.joints[0, 0].round(3) for detection in found for chain in detection.chains if chain.joints[0, 1] < 0}
    assert starts == {-0.2}

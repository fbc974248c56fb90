"""Chains of one id have one direction."""

from dataclasses import replace

import numpy as np
import pytest

from doo3d.config import TrackingConfig
from doo3d.geometry.polyline import arc_length, resample
from doo3d.track.object_length import vote_length
from doo3d.track.observations import Observation
from doo3d.track.registration import exact_lengths
from doo3d.track.tracks import Track, tracks_of
from doo3d.types import Chain, Detection

LEG, BETWEEN = 0.44, 0.04


def chain(line: np.ndarray, confidence: float) -> Chain:
    line = resample(line, np.linspace(0.0, arc_length(line)[-1], 91))
    segment = float(np.linalg.norm(np.diff(line, axis=0), axis=1).mean())
    return Chain(exact_lengths(line, segment), segment, 0.004, confidence=confidence)


def hairpin(aside: float = 0.0) -> np.ndarray:
    """A cable that goes 44 cm along and back 4 cm beside: (K, 3) m."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, 20)
    turn = BETWEEN / 2 * np.column_stack([np.cos(angles), 1 + np.sin(angles)]) + [LEG, 0.0]
    flat = np.vstack([[0.0, 0.0], turn, [0.0, BETWEEN]])
    return np.column_stack([flat[:, 0], flat[:, 1] + aside, np.full(len(flat), 0.8)])


def track_of(*chains: Chain) -> Track:
    observations = [Observation(Detection(chains=(each,), coordinates="camera"), ()) for each in chains]
    tracks = tracks_of(observations, TrackingConfig())
    assert list(tracks) == [0]
    return tracks[0]


def test_chains_have_the_direction_of_those_before_them() -> None:
    lines = [hairpin(0.005 * k)[:: -1 if k in (1, 3) else 1] for k in range(5)]
    track = track_of(*(chain(line, 0.9) for line in lines))
    assert track.backwards == {0: False, 1: True, 2: False, 3: True, 4: False}
    for _, _, each in track.items:
        assert each.joints[0, 1] < each.joints[-1, 1]


def test_a_doubtful_chain_does_not_tell_the_direction_of_the_next() -> None:
    """It lies between the legs, where one goes forward and one back: near the first leg before, near the second one after."""
    leg = np.array([[0.0, 0.019, 0.8], [LEG, 0.019, 0.8]])
    track = track_of(chain(hairpin(), 0.9), chain(leg, 0.1), chain(hairpin(-0.01), 0.9), chain(hairpin(-0.01), 0.9))
    assert not any(track.backwards.values())


@pytest.mark.parametrize(("misses", "torn", "hidden", "expected"), [
    (0.015, 0.0, 0.0, True),
    (0.04, 0.0, 0.0, False),
    (0.04, 0.9, 0.0, True),
    (0.04, 0.9, 0.9, False),
    (0.06, 0.9, 0.0, False),
])  # fmt: skip
def test_a_chain_of_torn_depth_is_whole_though_its_length_differs_more(
    misses: float, torn: float, hidden: float, expected: bool
) -> None:
    """Where a hand hides a part, it may be joined wrongly, and the length tells; where the image shows it, it is not."""
    each = chain(hairpin(), 0.9)
    middle = np.abs(np.linspace(-1.0, 1.0, len(each.occluded)))
    each = replace(each, depth_filled=middle < torn, occluded=middle < hidden)
    track = track_of(each)
    assert track.is_whole(track.items[0], each.length / (1 + misses)) == expected


def test_lengths_of_torn_depth_do_not_outvote_those_that_were_measured() -> None:
    """Waves of torn depth make a chain too long."""
    whole = chain(hairpin(), 0.9)
    torn = replace(whole, segment_length=1.04 * whole.segment_length, joints=1.04 * whole.joints)
    torn = replace(torn, depth_filled=np.arange(len(torn.occluded)) > 20)
    track = track_of(*[whole] * 4, *[torn] * 4)
    assert vote_length(*track.lengths) == pytest.approx(whole.length, rel=0.005)

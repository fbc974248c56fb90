"""Chains of one id have one direction."""

import numpy as np

from doo3d.config import TrackingConfig
from doo3d.sequence.observations import Observation
from doo3d.sequence.topology import OPEN
from doo3d.sequence.tracks import Track, _turn_alike, tracks_of
from doo3d.types import Chain, Detection

SEGMENT = 0.01


def arch(part: slice, confidence: float) -> Chain:
    """A part of an arch of 90 segments, in which a chain laid the other way round is hardly farther off."""
    along = np.linspace(0.0, np.pi, 91)
    radius = SEGMENT / (2 * np.sin(np.pi / 180))
    joints = radius * np.column_stack([np.cos(along), np.sin(along), np.zeros(91)]) + [0.0, 0.0, 0.8]
    joints = joints[part]
    return Chain(joints, SEGMENT, 0.004, confidence=confidence)


def test_a_doubtful_chain_does_not_turn_those_after_it() -> None:
    """A part that ends where the arch is highest fits both halves; here the frame found it the other way round."""
    shown = [arch(slice(None), 0.9), arch(slice(None, 35, -1), 0.1), arch(slice(None), 0.9)]
    observations = [Observation(Detection(chains=(chain,), coordinates="camera"), ()) for chain in shown]
    tracks = tracks_of(observations, TrackingConfig())
    assert len(tracks) == 1
    backwards = [tracks[0].backwards[frame] for frame in range(3)]
    assert backwards == [False, True, False]


def test_sure_chains_keep_the_direction_of_those_before_them() -> None:
    whole = arch(slice(None), 0.9)
    shown = [whole, arch(slice(None, None, -1), 0.9), whole, arch(slice(None, None, -1), 0.9)]
    observations = [Observation(Detection(chains=(chain,), coordinates="camera"), ()) for chain in shown]
    track = tracks_of(observations, TrackingConfig())[0]
    assert [track.backwards[frame] for frame in range(4)] == [False, True, False, True]
    for _, _, chain in track.items:
        assert np.allclose(chain.joints, whole.joints)


def test_a_sure_chain_is_turned_back_where_a_doubtful_one_was_taken_the_wrong_way_round() -> None:
    whole, doubtful = arch(slice(None), 0.9), arch(slice(None, 35, -1), 0.1)
    turned = arch(slice(None, None, -1), 0.9)
    track = Track([(0, 0, whole), (1, 0, doubtful), (2, 0, turned), (3, 0, turned)], dict.fromkeys(range(4), False), {})
    track.patterns = dict.fromkeys(range(4), OPEN)
    _turn_alike(track)
    assert list(track.backwards.values()) == [False, False, True, True]
    assert all(np.allclose(chain.joints, whole.joints) for frame, _, chain in track.items if frame != 1)

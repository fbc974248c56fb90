"""Chains of one track have one direction, and tracks of one object become one."""

from dataclasses import replace

import numpy as np
import pytest

from doo3d.config import TrackingConfig
from doo3d.geometry.polyline import arc_length, resample
from doo3d.track.junction_vote import ChainInFrame
from doo3d.track.observations import Observation
from doo3d.track.registration import exact_lengths
from doo3d.track.tracks import CONTEXT, Track, merge_tracks, tracks_of
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
    (track,) = tracks_of(observations, TrackingConfig())
    return track


def test_chains_have_the_direction_of_those_before_them() -> None:
    lines = [hairpin(0.005 * k)[:: -1 if k in (1, 3) else 1] for k in range(5)]
    track = track_of(*(chain(line, 0.9) for line in lines))
    assert [item.backwards for item in track.items] == [False, True, False, True, False]
    for item in track.items:
        first, *_, last = item.nodes(20)
        assert first[1] < last[1]


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
    assert bool(track.whole(each.length / (1 + misses))) == expected


def test_lengths_of_torn_depth_do_not_outvote_those_that_were_measured() -> None:
    """Waves of torn depth make a chain too long."""
    whole = chain(hairpin(), 0.9)
    torn = replace(whole, segment_length=1.04 * whole.segment_length, joints=1.04 * whole.joints)
    torn = replace(torn, depth_filled=np.arange(len(torn.occluded)) > 20)
    track = track_of(*[whole] * 4, *[torn] * 4)
    assert track.length(None) == pytest.approx(whole.length, rel=0.005)


def bar(y: float, first: float = 0.0, last: float = 0.6) -> Chain:
    """A straight part of a cable of 60 cm, from one place along it to another, m."""
    return chain(np.array([[first, y, 0.8], [last, y, 0.8]]), 0.9)


def merged(*frames: list[Chain], length: float | None = None) -> list[list[int]]:
    """The frames of each object, one of each chain; length : m, if given."""
    observations = [Observation(Detection(chains=tuple(chains), coordinates="camera"), ()) for chains in frames]
    tracks = merge_tracks(tracks_of(observations, TrackingConfig()), length, 3)
    return [[item.frame for item in track.items] for track in tracks]


def test_what_enough_frames_show_beside_each_other_is_two_objects() -> None:
    both, one = [bar(0.0), bar(0.2)], [bar(0.0)]
    assert merged(*[one] * 5, *[both] * 3) == [[0, 1, 2, 3, 4, 5, 6, 7], [5, 6, 7]]
    assert len(merged(*[one] * 5, *[both] * 2)) == 1


@pytest.mark.parametrize("edge", [0.25, 0.4])
def test_pieces_on_both_sides_of_an_occluder_are_one_object(edge: float) -> None:
    pieces = [bar(0.0, 0.0, edge - 0.05), bar(0.0, edge + 0.05, 0.6)]
    assert merged(*[[bar(0.0)]] * 4, *[pieces] * 6, *[[bar(0.0)]] * 4) == [sorted([*range(14), *range(4, 10)])]
    assert len(merged(*[pieces] * 6)) == 2  # no frame shows that they belong together
    assert len(merged(*[pieces] * 6, length=0.6)) == 1


def test_a_cable_that_is_lost_and_found_elsewhere_is_one_object() -> None:
    assert merged(*[[bar(0.0)]] * 4, [], *[[bar(0.5)]] * 4) == [[0, 1, 2, 3, 5, 6, 7, 8]]


@pytest.mark.parametrize(("start", "longer", "count"), [(6, 0.0, 1), (5, 0.0, 2), (6 + CONTEXT, 0.0, 2), (6, 0.1, 2)])
def test_branches_are_one_if_they_follow_each_other_and_are_of_one_length(start: int, longer: float, count: int) -> None:
    first = Track([ChainInFrame(k, 0, bar(0.0), pattern=(True, False)) for k in range(6)], (True, False))
    second = [ChainInFrame(start + k, 0, bar(0.3, 0.0, 0.6 + longer), pattern=(False, True)) for k in range(4)]
    found = merge_tracks([first, Track(second, (False, True))], None, 3)
    assert len(found) == count
    if count == 1:
        assert [item.backwards for item in found[0].items] == [False] * 6 + [True] * 4

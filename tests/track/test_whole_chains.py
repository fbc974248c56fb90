"""Of the chains that show an object whole, those along which it moves least are kept, in one direction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from doo3d.config import TrackingConfig
from doo3d.track.junction_vote import ChainInFrame
from doo3d.track.whole_chains import EARLIER_CHAINS, consistent_chains
from doo3d.types import Chain

COUNT, SEGMENT = 41, 0.01


def item(frame, y=0.0, turned=False, confidence=0.9, track=0, number=0, backwards=False):
    """A straight chain at a place across, m; turned : whether its joints run to the left."""
    x = SEGMENT * np.arange(COUNT + 1)[:: -1 if turned else 1]
    joints = np.column_stack((x, np.full(COUNT + 1, y), np.full(COUNT + 1, 0.8)))
    return ChainInFrame(frame, number, Chain(joints, SEGMENT, 0.004, confidence=confidence), backwards, track=track)


def kept(items, is_reversible=True):
    return consistent_chains(items, TrackingConfig(), is_reversible)


def places(items, is_reversible=True):
    """The frames and numbers of the chains that are kept."""
    return [(each.frame, each.number) for each in kept(items, is_reversible)]


def starts(items, is_reversible=True):
    """Where the object begins in each chain, m."""
    return [each.nodes(2)[0, 0] for each in kept(items, is_reversible)]


def test_nothing_is_kept_of_nothing():
    assert kept([]) == []


@pytest.mark.parametrize("leaping", [{5}, {0}, {11}, {3, 4, 8}])
def test_a_chain_that_leaps_is_left_out(leaping):
    items = [item(k, 0.5 if k in leaping else 0.003 * k) for k in range(12)]
    assert places(items) == [(k, 0) for k in range(12) if k not in leaping]


def test_what_moves_as_far_in_more_time_does_not_leap():
    assert len(kept([item(0), item(1), item(2, 0.08), item(3, 0.08)])) == 2
    assert len(kept([item(0), item(1), item(9, 0.08), item(10, 0.08)])) == 4


def test_a_path_goes_on_beyond_as_many_wrong_chains_as_are_compared():
    for wrong, count in ((EARLIER_CHAINS - 1, 2), (EARLIER_CHAINS, 1)):
        assert len(kept([item(0), *[item(k, 0.5 + 0.3 * k) for k in range(1, wrong + 1)], item(wrong + 1)])) == count


@pytest.mark.parametrize("track", [0, 1])
def test_a_chain_that_runs_the_other_way_is_turned_and_the_next_ones_are_not(track):
    """Whether it is of the same track or was found again."""
    items = [item(k, turned=k in (2, 3, 6), track=track * (k >= 2)) for k in range(8)]
    assert starts(items) in ([0.0] * 8, [COUNT * SEGMENT] * 8)


@pytest.mark.parametrize("track", [0, 1])
def test_where_both_directions_are_near_that_of_the_track_is_kept(track):
    """A cable whose second half lies 1 cm beside the first one, in two frames as if it were turned round."""
    x, y = SEGMENT * np.minimum(np.arange(COUNT + 1), np.arange(COUNT + 1)[::-1]), SEGMENT * (np.arange(COUNT + 1) > COUNT // 2)
    joints = np.column_stack((x, y, np.full(COUNT + 1, 0.8)))
    folded = [item(k, track=track * (k >= 2)) for k in range(4)]
    folded = [each._replace(chain=replace(each.chain, joints=joints[:: -1 if each.frame >= 2 else 1])) for each in folded]
    assert np.diff([each.backwards for each in kept(folded)]).tolist() == [False, track == 1, False]


def test_directions_that_junctions_decide_are_kept():
    turned = [item(k, turned=k == 2, backwards=k == 2) for k in range(5)]
    assert starts(turned, False) == [0.0] * 5
    wrong = [item(k, backwards=k == 2) for k in range(5)]
    assert places(wrong, False) == [(0, 0), (1, 0), (3, 0), (4, 0)]


@pytest.mark.parametrize(("confidence", "number"), [(0.9, 0), (0.5, 1)])
def test_of_two_chains_of_a_frame_that_is_kept_which_moves_less_or_is_more_confident(confidence, number):
    frames = [(item(k, 0.003 * k, confidence=confidence), item(k, 0.02, number=1)) for k in range(1, 6)]
    assert places([item(0), *(each for both in frames for each in both)]) == [(0, 0), *((k, number) for k in range(1, 6))]

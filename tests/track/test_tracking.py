"""Chains keep their ids and directions from frame to frame, and what refers to their segments goes with them."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from builders.errors import refuses

from doo3d.config import TrackingConfig
from doo3d.geometry.equal_segments import equal_ring, equal_segments
from doo3d.geometry.polyline import densify
from doo3d.outputs.detection_json import dumps
from doo3d.track import tracking
from doo3d.track.chain_direction import reversed_chain
from doo3d.track.chain_matching import NO_MATCH, match_chains
from doo3d.track.tracking import Tracker, TrackingState, assign_ids
from doo3d.types import Chain, Connection, Crossing, Detection, SegmentRef
from doo3d.viz import draw
from doo3d.viz.palette import chain_color

LENGTH = {2: 10.0, 3: 0.01}  # px, m
ACROSS = {2: 400.0, 3: 0.4}


def wave(dim: int, at=(0.0, 0.0), turn: float = 0.0, share=(0.0, 1.0)) -> Chain:
    """A wave as wide as ACROSS, `at` from the middle in the same unit of ACROSS, reversed_chain by radians; a share of it."""
    t = np.linspace(*share, 300)
    flat = np.column_stack((t - 0.5, 0.1 * np.sin(2 * np.pi * t) + 0.05 * t))
    cos, sin = np.cos(turn), np.sin(turn)
    flat = flat @ np.array([[cos, sin], [-sin, cos]]) + at
    points = np.column_stack((flat, np.full(len(flat), 1.5)))[:, :dim] * ACROSS[dim]
    return Chain(equal_segments(points, LENGTH[dim]), LENGTH[dim], 0.4 * LENGTH[dim])


def ring(dim: int, first: float, clockwise: bool, count: int = 60) -> Chain:
    t = first + np.linspace(0, 2 * np.pi, 400, endpoint=False) * (-1 if clockwise else 1)
    flat = np.column_stack((0.3 * np.cos(t), 0.2 * np.sin(t), 0 * t + 1.5))[:, :dim] * ACROSS[dim]
    joints = equal_ring(densify(flat, LENGTH[dim] / 8), LENGTH[dim])
    return Chain(joints, LENGTH[dim], 0.4 * LENGTH[dim], closed=True)


def found(*chains: Chain, **more) -> Detection:
    return Detection(tuple(chains), mode="2d" if chains and chains[0].joints.shape[1] == 2 else "3d", **more)


def ids(detection: Detection) -> list[int | None]:
    return [chain.id for chain in detection.chains]


def nearer(chain: Chain, other: Chain) -> bool:
    """The same end is first."""
    ends, others = chain.joints[[0, -1]], other.joints[[0, -1]]
    return np.linalg.norm(ends - others) < np.linalg.norm(ends - others[::-1])


@pytest.mark.parametrize("dim", [2, 3])
def test_a_turning_cable_keeps_its_id_and_its_first_end(dim):
    """As detected it starts at the left, which is the other end after a quarter of a turn."""
    tracker, last, flipped = Tracker(), None, 0
    for step in range(40):
        chain = wave(dim, turn=step * np.pi / 20)
        if chain.joints[0, 0] > chain.joints[-1, 0]:
            chain, flipped = reversed_chain(chain, True)[0], flipped + 1
        detection = tracker.update(found(chain))
        assert ids(detection) == [0]
        assert last is None or nearer(detection.chains[0], last)
        last = detection.chains[0]
    assert 5 < flipped < 35


@pytest.mark.parametrize("dim", [2, 3])
def test_two_that_change_places_in_the_list(dim):
    """The list is by length, and which is longer may change; ids stay with the cables, the order with the lengths."""
    tracker = Tracker()
    assert ids(tracker.update(found(wave(dim, (0, 0.0)), wave(dim, (0, 0.5))))) == [0, 1]
    shorter = wave(dim, (0.01, 0.0), share=(0.05, 1))
    second = tracker.update(found(wave(dim, (0, 0.51)), shorter))
    assert ids(second) == [1, 0]
    assert second.chains[0].length > second.chains[1].length
    assert ids(tracker.update(found(wave(dim, (0, 0.5)), wave(dim, (0, 1.2)), shorter))) == [1, 2, 0]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("share", [(0.0, 0.6), (0.4, 1.0), (0.25, 0.75)])
def test_an_end_that_is_hidden_changes_nothing(dim, backwards, share):
    tracker = Tracker()
    whole = tracker.update(found(wave(dim))).chains[0]
    part = reversed_chain(wave(dim, (0.01, 0.01), share=share), backwards)[0]
    half = tracker.update(found(part))
    assert ids(half) == [0]
    heading = half.chains[0].joints[-1] - half.chains[0].joints[0]
    assert heading @ (whole.joints[-1] - whole.joints[0]) > 0
    again = tracker.update(found(reversed_chain(wave(dim), backwards)[0]))
    assert ids(again) == [0]
    assert nearer(again.chains[0], whole)


@pytest.mark.parametrize("dim", [2, 3])
def test_of_two_pieces_the_longer_keeps_the_id(dim):
    tracker = Tracker()
    tracker.update(found(wave(dim)))
    pieces = tracker.update(found(wave(dim, share=(0.4, 1)), wave(dim, share=(0, 0.35))))
    assert ids(pieces) == [0, 1]
    assert ids(tracker.update(found(wave(dim)))) == [0]


def test_what_was_lost_comes_back_where_it_was_and_only_so_long():
    tracker = Tracker()
    tracker.update(found(wave(3), wave(3, (0, 0.6))))
    for _ in range(tracking.MAX_AGE - 1):
        assert ids(tracker.update(found(wave(3)))) == [0]
    state = tracker.state
    assert ids(tracker.update(found(wave(3), wave(3, (0, 0.62))))) == [0, 1]
    assert ids(assign_ids(state, found(wave(3), wave(3, (0, 1.6))))[0]) == [0, 2], "elsewhere it is another"
    _, later = assign_ids(state, found(wave(3)))
    assert ids(assign_ids(later, found(wave(3), wave(3, (0, 0.6))))[0]) == [0, 1]
    _, latest = assign_ids(later, found(wave(3)))
    assert ids(assign_ids(latest, found(wave(3), wave(3, (0, 0.6))))[0]) == [0, 2], "forgotten, and 1 is not used again"


def test_nothing_found_and_then_again():
    tracker = Tracker()
    assert ids(tracker.update(found())) == []
    assert ids(tracker.update(found(wave(3)))) == [0]
    assert ids(tracker.update(found())) == []
    assert ids(tracker.update(found(wave(3, (0.01, 0))))) == [0]


@pytest.mark.parametrize("dim", [2, 3])
def test_rings_start_where_they_started(dim):
    tracker = Tracker()
    last = tracker.update(found(ring(dim, 0.0, False))).chains[0]
    for start, clockwise in ((0.3, False), (2.0, True), (4.0, False), (6.0, True)):
        chain = tracker.update(found(ring(dim, start, clockwise))).chains[0]
        assert chain.id == 0
        assert np.linalg.norm(chain.joints - last.joints, axis=1).max() < 0.6 * LENGTH[dim], "half a segment and no more"
        np.testing.assert_array_equal(chain.joints[0], chain.joints[-1])
        last = chain


@pytest.mark.parametrize("dim", [2, 3])
def test_a_ring_that_is_open_for_a_frame(dim):
    tracker = Tracker()
    tracker.update(found(ring(dim, 0.0, False)))
    whole = ring(dim, 1.0, True)
    shorter = replace(whole, joints=whole.joints[:-3], radii=(), occluded=(), depth_filled=(), from_time=(), closed=False)
    opened = tracker.update(found(shorter)).chains[0]
    assert opened.id == 0
    np.testing.assert_allclose(opened.joints, whole.joints[:-3][::-1])
    assert tracker.update(found(ring(dim, 0.2, False))).chains[0].id == 0


@pytest.mark.parametrize("closed", [False, True])
def test_what_refers_to_segments_goes_with_them(closed):
    base = ring(3, 0.0, False) if closed else wave(3)
    count = len(base.joints) - 1
    chain = replace(
        base, radii=np.append(np.arange(count), 0 if closed else count),
        occluded=np.arange(count) < 5, depth_filled=np.arange(count) < 9,
        connections=(Connection(2, 0.5), Connection(7, 0.25)),
        deviations=np.outer(np.append(np.arange(count), 0 if closed else count), (1, 2)),
    )  # fmt: skip
    for backwards, start in ((True, 0), (False, 9), (True, 9)) if closed else ((True, 0),):
        new, moved = reversed_chain(chain, backwards, start)
        for old, now in enumerate(moved):
            was, then = chain.joints[old : old + 2], new.joints[now : now + 2]
            np.testing.assert_array_equal(then, was[::-1] if backwards else was)
            assert new.occluded[now] == chain.occluded[old]
            assert new.depth_filled[now] == chain.depth_filled[old]
        np.testing.assert_array_equal(new.deviations, np.outer(new.radii, (1, 2)))
        for joint, radius in zip(new.joints, new.radii, strict=True):
            np.testing.assert_array_equal(joint, chain.joints[int(radius)])
        assert {(item.segment, item.confidence) for item in new.connections} == {(moved[2], 0.5), (moved[7], 0.25)}
        assert list(new.connections) == sorted(new.connections)


def test_crossings_stay_at_their_segments():
    one, two = wave(3), wave(3, (0.05, 0.0), turn=1.2)
    crossings = (
        Crossing(SegmentRef(1, 4), SegmentRef(0, 3), one.joints[3]),
        Crossing(SegmentRef(0, 20), SegmentRef(0, 30), one.joints[20], 0.5),
    )
    tracker = Tracker()
    tracker.update(found(one, two))
    back = tracker.update(found(reversed_chain(one, True)[0], two, crossings=crossings))
    last = len(one.occluded) - 1
    places = [(crossing.upper, crossing.lower, crossing.confidence) for crossing in back.crossings]
    assert places == [(SegmentRef(0, last - 20), SegmentRef(0, last - 30), 0.5), (SegmentRef(1, 4), SegmentRef(0, last - 3), 1.0)]
    np.testing.assert_array_equal(back.crossings[1].point, one.joints[3])
    assert tracker.update(found(one, two, crossings=crossings[:1])).crossings[0].lower == SegmentRef(0, 3)


def test_the_same_from_a_run_that_was_broken_off():
    """At whatever frame, from what the files hold; with one that nothing was found in, and one that failed and has no file."""
    rng = np.random.default_rng(5)
    frames = []
    for step in range(12):
        chains = [wave(3, (0, 0.02 * step)), wave(3, (0.1, 0.7), turn=0.05 * step)]
        chains = [reversed_chain(chain, bool(rng.integers(2)))[0] for chain in chains if rng.random() < 0.7]
        frames.append(found(*chains, frame=f"{step:03d}"))
    assert any(not frame.chains for frame in frames)
    whole = Tracker()
    texts = [dumps(whole.update(frame).to_dict()) for frame in frames]
    for stop in range(len(frames) + 1):
        tracker = Tracker.resumed(json.loads(text) for text in texts[:stop])
        assert [dumps(tracker.update(frame).to_dict()) for frame in frames[stop:]] == texts[stop:]


def test_ids_of_long_ago_are_not_used_again(monkeypatch):
    monkeypatch.setattr(tracking, "MAX_AGE", 1)
    whole = Tracker()
    frames = [found(wave(3, (0, 0.9 * step))) for step in range(4)] + [found()] * 3
    texts = [dumps(whole.update(frame).to_dict()) for frame in frames]
    assert whole.state.tracked == ()
    tracker = Tracker.resumed(map(json.loads, texts))
    assert tracker.state == TrackingState((), 4)
    assert ids(tracker.update(found(wave(3)))) == [4]


def test_results_that_are_broken():
    with refuses("results-damaged", "restart=True"):
        Tracker.resumed([{"chains": [{"id": 0, "joints": []}]}])
    with refuses("results-damaged", "restart=True"):
        Tracker.resumed([{"schema": "doo3d/detection/2"}])


def test_assign_ids_leaves_its_arguments_alone():
    first, state = assign_ids(TrackingState(), found(wave(3)))
    again = [assign_ids(state, found(reversed_chain(wave(3), True)[0]))[0] for _ in range(2)]
    assert dumps(again[0].to_dict()) == dumps(again[1].to_dict())
    assert ids(first) == [0]
    assert state.next_id == 1


def test_the_color_is_that_of_the_id():
    picture = np.zeros((300, 700, 3), np.uint8)
    chain = wave(2, (0.8, 0.3))
    for number in (0, 3):
        drawn = draw(picture, found(replace(chain, id=number)))
        colors = {tuple(color) for color in drawn.reshape(-1, 3).tolist()}
        assert chain_color(number) in colors
        assert chain_color(number + 1) not in colors


@pytest.mark.parametrize("backwards", [False, True])
def test_a_part_of_a_chain_costs_what_is_missing_of_it(backwards):
    """Of 61 points 15 have no counterpart, and count half each; the costs are in the largest distance, 10 radii."""
    line = np.column_stack((np.arange(61.0), np.zeros(61), np.ones(61)))
    old, part = Chain(line, 1.0, radius=1.0), line[:46] + np.array([0.0, 2.0, 0.0])
    match = match_chains(old, Chain(part[::-1] if backwards else part, 1.0, radius=1.0), TrackingConfig(max_motion_lengths=0.1))
    assert match.backwards == backwards
    assert match.cost == pytest.approx((46 * 2 / 10 + 7.5) / 53.5)


@pytest.mark.parametrize(("offset", "matches"), [(9.999, True), (10.001, False)])
def test_chains_whose_boxes_are_further_apart_than_the_limit_do_not_match(offset, matches):
    line = np.column_stack((np.arange(61.0), np.zeros(61), np.ones(61)))
    other = Chain(line + np.array([0.0, offset, 0.0]), 1.0, radius=1.0)
    match = match_chains(Chain(line, 1.0, radius=1.0), other, TrackingConfig(max_motion_lengths=0.1))
    assert (match != NO_MATCH) == matches

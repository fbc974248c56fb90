"""Confidence of connections, against all alternatives tried one by one; and where in the chain connections lie."""

from __future__ import annotations

import json

import numpy as np
import pytest
from builders.drawn_masks import frame_of, line, wave
from builders.scenes import empty_scene, frame_scene

import doo3d
from doo3d.chains.fill import fill
from doo3d.config import MergeConfig
from doo3d.geometry.assembly import Assembly
from doo3d.geometry.curves import Curves
from doo3d.geometry.gap_path import gap_path
from doo3d.geometry.polyline import unit
from doo3d.links import merge
from doo3d.links.confidence import confidences
from doo3d.links.ends import Ends, Link, ends_of
from doo3d.links.terms.gap_path import GapPaths
from doo3d.types import Camera, Chain, Connection, Detection

MOST = 100.0
STEP, RADIUS = 0.01, 0.004


def links_of(*rows):
    """Links of rows (end, end, cost), the ends given by their indices."""
    ends = ends_of(8)
    return [Link(cost, ends[a], ends[b]) for a, b, cost in rows]


def matchings(ends):
    """Yield every set of pairs of the ends, each end used once at most."""
    if len(ends) < 2:
        yield []
        return
    first, rest = ends[0], ends[1:]
    yield from matchings(rest)
    for k, other in enumerate(rest):
        for more in matchings(rest[:k] + rest[k + 1 :]):
            yield [(first, other), *more]


def has_ring(pairs):
    partner = {a: b for a, b in pairs} | {b: a for a, b in pairs}
    for start in partner:
        end = start ^ 1
        while end in partner and partner[end] != start:
            end = partner[end] ^ 1
        if end in partner:
            return True
    return False


def by_trying(cost, rings):
    """Return the best set of connections, each with the rise of the total in the best set without it: ((a, b), rise)."""
    count = len(cost)

    def total(pairs):
        return sum(cost[pair] for pair in pairs) + MOST / 2 * (count - 2 * len(pairs))

    sets = [(total(pairs), pairs) for pairs in matchings(list(range(count))) if rings or not has_ring(pairs)]
    least, best = min(sets)
    return [(pair, min(price for price, pairs in sets if pair not in pairs) - least) for pair in best]


def random_costs(seed, count, low=0.0):
    cost = np.random.default_rng(seed).uniform(low, MOST, (count, count))
    cost[np.tri(count, dtype=bool)] = np.inf
    return cost


@pytest.mark.parametrize("rings", [True, False])
@pytest.mark.parametrize("seed", range(16))
def test_against_all_alternatives(seed, rings):
    """Confidence is never below that of trying all sets, and equal where all six ends are joined and rings are allowed."""
    cost = random_costs(seed, 6 if seed % 2 else 8)
    tried = by_trying(cost, rings)
    found = confidences(links_of(*((*pair, cost[pair]) for pair, _ in tried)), cost, MOST, rings)
    expected = [rise / MOST for _, rise in tried]
    assert (np.array(found) >= np.array(expected) - 1e-9).all()
    if len(tried) == 3 and len(cost) == 6 and rings:
        assert found == pytest.approx(expected)


def test_confidence_is_nearly_always_that_of_trying_all_sets():
    """Three chains, some of whose ends stay free."""
    same = []
    for seed in range(60):
        cost = random_costs(seed, 6, low=0.4 * MOST)
        tried = by_trying(cost, True)
        found = confidences(links_of(*((*pair, cost[pair]) for pair, _ in tried)), cost, MOST, allow_rings=True)
        same += np.isclose(found, [rise / MOST for _, rise in tried]).tolist()
    assert np.mean(same) > 0.95


def test_without_alternatives_the_cost_counts():
    cost = np.full((4, 4), np.inf)
    cost[1, 2] = 30
    assert confidences(links_of((1, 2, 30.0)), cost, MOST) == pytest.approx([0.7])
    assert confidences(links_of((1, 2, 30.0)), cost, np.inf)[0] == pytest.approx(31 / 61)
    assert confidences([], cost, MOST) == []


@pytest.mark.parametrize(("cost_of_the_link", "alternative"), [(30.0, 30.0), (230.0, np.inf)])
def test_equal_alternatives_and_costs_above_the_largest_leave_no_confidence(cost_of_the_link, alternative):
    cost = np.full((6, 6), np.inf)
    cost[1, 2], cost[1, 4] = cost_of_the_link, alternative
    assert confidences(links_of((1, 2, cost_of_the_link)), cost, MOST) == [0]


def test_a_connection_that_closes_a_ring_is_no_alternative():
    """Chains 0-1, 2-3 and 4-5 in a row: the ends of the two gaps exchanged would join 2 to 3."""
    cost = np.full((6, 6), np.inf)
    cost[1, 2] = cost[3, 4] = 20
    cost[1, 4] = cost[2, 3] = 21
    links = links_of((1, 2, 20.0), (3, 4, 20.0))
    assert confidences(links, cost, MOST, allow_rings=True) == pytest.approx([0.02, 0.02])
    assert confidences(links, cost, MOST) == pytest.approx([0.8, 0.8])


def chain(start, direction, count=6):
    start, direction = np.array([*start, 0.5]), unit(np.array([*direction, 0.0]))
    return start + STEP * np.arange(count + 1)[:, None] * direction


def star(angle):
    """Return four chains that end round one point, as where two strands cross at an angle."""
    directions = [np.array([np.cos(turn), np.sin(turn)]) for turn in (0, angle, np.pi, np.pi + angle)]
    return [chain(0.012 * direction, direction) for direction in directions]


def merged(pieces, **changes):
    settings = MergeConfig(**({"chains": 2, "free_space_weight": 0.0, "unknown_weight": 0.0} | changes))
    return merge(Curves.of(pieces), empty_scene(radius=RADIUS), 1.0, settings).assemblies


@pytest.mark.parametrize("strategy", ["greedy", "global"])
def test_confidence_falls_with_the_angle_of_a_crossing(strategy):
    least = {}
    for degrees in (90, 50, 20):
        joined = merged(star(np.radians(degrees)), strategy=strategy)
        assert [len(assembly.pieces) for assembly in joined] == [2, 2]
        assert all(len(assembly.confidence) == 1 for assembly in joined)
        least[degrees] = min(confidence for assembly in joined for confidence in assembly.confidence)
    assert least[90] > 0.7
    assert 0 < least[20] < least[50] < least[90]


def test_a_rival_lowers_the_confidence():
    one, right = chain((-0.08, 0), (1, 0)), chain((0.01, 0), (1, 0))
    rival = chain((0.01, 0.004), (1, 0.1))
    (alone, *_) = merged([one, right], chains=None, min_length=0)
    joined = merged([one, right, rival], chains=None, min_length=0)
    doubtful = next(assembly for assembly in joined if assembly.confidence)
    assert alone.confidence[0] > 0.9
    assert doubtful.confidence[0] < 0.3


def test_gaps_through_free_space_are_no_alternatives():
    camera = Camera(fx=500.0, fy=500.0, cx=160.0, cy=120.0, width=320, height=240)
    points = np.array([[-0.02, 0, 0.5], [0.02, 0, 0.5], [0.02, 0.02, 0.5]])
    cost = np.full((3, 3), np.inf)
    cost[0, 1:] = 40
    depth = np.full((240, 320), 0.3, np.float32)
    depth[122:] = 0.9
    nothing = np.zeros_like(points), np.zeros(3, dtype=bool), RADIUS
    scene = frame_scene(doo3d.Frame(None, depth, camera), np.zeros_like(depth, bool), radius=RADIUS, visibility__margin=0.01)
    seen = GapPaths(Ends(points, *nothing, MergeConfig()), scene).with_straight_gaps(cost)
    assert seen[0, 1] == 40
    assert seen[0, 2] > 200
    assert np.isinf(seen[1]).all()
    blind = GapPaths(Ends(points, *nothing, MergeConfig(tangent_window_radii=1.0)), empty_scene()).with_straight_gaps(cost)
    assert blind[0, 1] == pytest.approx(40 + 2 * 40)
    assert cost[0, 2] == 40


@pytest.mark.parametrize("closed", [False, True])
def test_the_step_in_the_middle_of_each_gap_is_recorded(closed):
    pieces = [np.column_stack((np.arange(5.0) + at, np.zeros(5), np.ones(5))) for at in (0, 8.5, 12.7)]
    x = np.eye(3)[0]
    paths = [gap_path(one[-1], x, other[0], -x) for one, other in zip(pieces, [*pieces[1:], pieces[0]], strict=True)]
    count = 3 if closed else 2
    (path,) = fill([Assembly(tuple(pieces), tuple(paths[:count]), closed, (0.9, 0.4, 0.7)[:count])], 1.0)
    assert [confidence for _, confidence in path.joins] == [0.9, 0.4, 0.7][:count]
    points = np.concatenate((path.points, path.points[:1]))
    for (step, _), (start, end) in zip(path.joins, ((4, 8.5), (12.5, 12.7)), strict=False):
        assert start - 1e-9 <= points[step, 0]
        assert points[step + 1, 0] <= end + 1e-9
    (path,) = fill([Assembly(tuple(pieces), tuple(paths[:2]))], 1.0)
    assert path.joins == ()


@pytest.mark.parametrize("turned", [False, True])
def test_connections_lie_where_the_chain_was_occluded(turned):
    """A cable behind two posts, the second one wider; whatever its direction in the view."""
    axis = wave(length=0.34)
    frame, mask = frame_of(axis[::-1] if turned else axis, radius=0.005, table=0.56)
    u = np.arange(mask.shape[1])
    posts = ((u > 190) & (u < 215)) | ((u > 400) & (u < 450))
    depth = np.where(posts, np.float32(0.4), frame.depth)
    detection = doo3d.detect(
        doo3d.Frame(None, depth, frame.camera), doo3d.load_config("default", {"merge.chains": 1}), mask & ~posts
    )
    (found,) = detection.chains
    assert len(found.connections) == 2
    pixels = frame.camera.project(np.array([found.joints[c.segment : c.segment + 2].mean(axis=0) for c in found.connections]))
    assert 190 < pixels[0, 0] < 215
    assert 400 < pixels[1, 0] < 450
    confidence = [connection.confidence for connection in found.connections]
    assert 1 > confidence[0] > confidence[1] > 0.3
    assert found.confidence == detection.confidence < 1
    plain = detection.to_dict()
    assert json.loads(json.dumps(plain)) == plain
    assert plain["confidence"] == plain["chains"][0]["confidence"] == found.confidence
    assert plain["chains"][0]["connections"] == [{"segment": c.segment, "confidence": c.confidence} for c in found.connections]


def test_confidence_is_high_without_connections():
    frame, mask = frame_of(line([-0.1, 0, 0.5], [0.1, 0.02, 0.5]))
    detection = doo3d.detect(frame, mask=mask)
    assert detection.chains[0].connections == ()
    assert 0.95 < detection.confidence == detection.chains[0].confidence < 1.0
    own = Chain(np.array([[0.0, 0, 1], [STEP, 0, 1]]), STEP)
    assert own.confidence == 1.0
    doubtful = Chain(own.joints, STEP, connections=(Connection(0, 0.8), Connection(0, 0.3)))
    assert Detection((own, doubtful)).confidence == doubtful.confidence == 0.3
    assert Detection((own,), doubtful=(doubtful,)).confidence == Detection((), doubtful=(doubtful,)).confidence == 0.3
    assert Detection(()).confidence is None

"""Merging: which ends are joined, in what order, and when it stops."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from builders.gap_arcs import arcs_of
from builders.scenes import empty_scene, frame_scene

from doo3d.config import MergeConfig, load_config
from doo3d.geometry.curves import Curves
from doo3d.geometry.polyline import unit
from doo3d.links import merge
from doo3d.links.ends import End
from doo3d.types import Camera, Frame

STEP, RADIUS = 0.01, 0.004
PAPER = load_config("paper_3d").merge
dims = pytest.mark.parametrize("dim", [2, 3])


def chain(start, direction, count=6, dim=3):
    """Return segments of 10 mm from a point along a direction, both given in the plane, in m (in 2-D: px, times 1000)."""
    scale = 1.0 if dim == 3 else 1000.0
    start, direction = (
        np.append(np.asarray(v, dtype=float), [0.5] * (dim - 2) if v is start else [0.0] * (dim - 2)) for v in (start, direction)
    )
    return scale * (start + STEP * np.arange(count + 1)[:, None] * unit(direction))


def config(**settings):
    return MergeConfig(**({"chains": 1, "max_cost": np.inf, "max_gap": np.inf, "free_space_weight": 0.0} | settings))


def merged(chains, settings, scene=None, closed=None):
    scale = 1 if chains[0].shape[1] == 3 else 1000
    return merge(Curves.of(chains, closed), scene or empty_scene(radius=scale * RADIUS), scale * STEP, settings)


def run(chains, settings, **options):
    return merged(chains, settings, **options).assemblies


def costs_of(result):
    return [decision.chosen.cost for decision in result.decisions]


def gaps(assembly):
    """Return the ends on either side of each gap: (before, after)."""
    pieces = [*assembly.pieces, *([assembly.pieces[0]] if assembly.closed else [])]
    return [(one[-1], other[0]) for one, other in pairwise(pieces)]


def joined(assemblies, a, b):
    """Return whether two points are ends that were joined."""
    return any(
        (np.allclose(p, a) and np.allclose(q, b)) or (np.allclose(p, b) and np.allclose(q, a))
        for assembly in assemblies
        for p, q in gaps(assembly)
    )


def check_whole(assemblies, chains):
    """Every chain is in one assembly at most, as it was or turned round, and gap paths lead across the gaps."""
    left = [c.tolist() for c in chains]
    for assembly in assemblies:
        for piece in assembly.pieces:
            same = [joints for joints in left if joints in (piece.tolist(), piece[::-1].tolist())]
            assert same
            left.remove(same[0])
        assert len(assembly.confidence) == len(assembly.pieces) - 1 + assembly.closed
        for path, (before, after) in zip(assembly.gap_paths, gaps(assembly), strict=True):
            points = path.points(STEP)
            np.testing.assert_allclose(points[[0, -1]], [before, after], atol=1e-9)


def cost_of(a, a_before, b, b_before, per_unit):
    """Equation 5 of two ends with the paper's weights, their directions from the joints before them."""
    s1, s2 = a - a_before, b - b_before

    def between(v, w):
        return np.arccos(np.clip(v @ w / np.linalg.norm(v) / np.linalg.norm(w), -1, 1))

    turn, bend = between(-s1, s2), max(between(s1, b - a), between(s2, a - b))
    return per_unit * np.linalg.norm(b - a) + 100 * turn + 100 * bend


@dims
@pytest.mark.parametrize("first_turned", [False, True])
@pytest.mark.parametrize("second_turned", [False, True])
def test_all_four_combinations_of_ends(dim, first_turned, second_turned):
    one, other = chain((0, 0), (1, 0), 6, dim), chain((0.1, 0.005), (1, 0.1), 5, dim)
    facing = one[-1], other[0]
    chains = [c[::-1] if turned else c for c, turned in ((one, first_turned), (other, second_turned))]
    (assembly,) = run(chains, config())
    assert joined([assembly], *facing)
    check_whole([assembly], chains)
    turns = arcs_of(assembly.gap_paths[0])
    before, after = turns[0].direction, turns[1].direction
    along = unit(assembly.pieces[0][-1] - assembly.pieces[0][-2]), unit(assembly.pieces[1][0] - assembly.pieces[1][1])
    np.testing.assert_allclose(before, along[0], atol=1e-6)
    np.testing.assert_allclose(after, along[1], atol=1e-6)
    assert not assembly.closed


@dims
def test_the_papers_cost(dim):
    """Equation 5 with the weights and the direction of the paper's preset."""
    one, other = chain((0, 0), (1, 0.2), 4, dim), chain((0.08, 0.05), (1, 1), 5, dim)
    result = merged([one, other], PAPER)
    pieces = result.assemblies[0].pieces
    expected = cost_of(pieces[0][-1], pieces[0][-2], pieces[1][0], pieces[1][1], 1000.0 if dim == 3 else 1.0)
    assert costs_of(result) == pytest.approx([expected])


def random_chains(seed, dim, count=6):
    random = np.random.default_rng(seed)
    return [chain(random.uniform(0, 0.3, 2), random.normal(size=2), int(random.integers(3, 9)), dim) for _ in range(count)]


def slow_greedy(chains, wanted, per_unit):
    """The paper's rule by trying all: the cheapest of all end pairs of different chains, joined, and again."""
    ends = {(c, side): (j[-side], j[-side + 1 - 2 * side]) for c, j in enumerate(chains) for side in (0, 1)}
    group = {c: c for c in range(len(chains))}
    links = []
    while len(set(group.values())) > wanted:
        price, one, other = min(
            (cost_of(*ends[a], *ends[b], per_unit), a, b) for a in ends for b in ends if a < b and group[a[0]] != group[b[0]]
        )
        links.append((ends[one][0], ends[other][0], price))
        del ends[one], ends[other]
        old, new = group[other[0]], group[one[0]]
        group = {c: new if g == old else g for c, g in group.items()}
    return links


@dims
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("wanted", [1, 2, 4])
def test_greedy_is_the_papers(dim, seed, wanted):
    chains = random_chains(seed, dim)
    result = merged(chains, PAPER.model_copy(update={"chains": wanted}))
    assemblies = result.assemblies
    expected = slow_greedy(chains, wanted, 1000.0 if dim == 3 else 1.0)
    assert len(assemblies) == wanted
    assert all(joined(assemblies, a, b) for a, b, _ in expected)
    assert costs_of(result) == pytest.approx(sorted(c for _, _, c in expected))
    check_whole(assemblies, chains)


@pytest.mark.parametrize("strategy", ["greedy", "global"])
@pytest.mark.parametrize("seed", range(8))
def test_every_end_once_and_no_rings(strategy, seed):
    chains = random_chains(seed, 3, 7)
    assemblies = run(chains, config(strategy=strategy, chains=None, min_length=0))
    check_whole(assemblies, chains)
    assert sum(len(assembly.pieces) for assembly in assemblies) == 7
    assert not any(assembly.closed for assembly in assemblies)


def row(count, gap=0.03):
    """Chains one after the other in a line."""
    return [chain((i * (6 * STEP + gap), 0), (1, 0)) for i in range(count)]


@pytest.mark.parametrize("strategy", ["greedy", "global"])
@pytest.mark.parametrize("wanted", [1, 2, 3])
def test_the_wanted_number_is_left(strategy, wanted):
    """Four in a row, the middle gap the widest, a stray one far off: with two wanted the two longest are given."""
    chains = [*row(2), *(c + np.array([0.2, 0, 0]) for c in row(2, 0.02)), chain((0, 3), (0, 1), 2)]
    assemblies = run(chains, config(strategy=strategy, chains=wanted, max_gap=0.5))
    assert len(assemblies) == wanted
    sizes = [sum(len(piece) - 1 for piece in assembly.pieces) for assembly in assemblies]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes == {1: [24], 2: [24, 2], 3: [12, 12, 2]}[wanted]


@pytest.mark.parametrize("strategy", ["greedy", "global"])
def test_null_stops_where_no_pair_is_good_enough(strategy):
    chains = [*row(3), chain((0.05, 0.2), (0.3, 1)), chain((0.5, -0.1), (0, 1), 1)]
    assemblies = run(chains, MergeConfig(chains=None, strategy=strategy, min_length=5))
    assert [len(assembly.pieces) for assembly in assemblies] == [3, 1]


@pytest.mark.parametrize("strategy", ["greedy", "global"])
def test_no_gap_wider_than_allowed(strategy):
    for chains, largest in ((None, 0.05), (1, 0.15)):  # the number of chains forces three times as much
        limits = {"strategy": strategy, "chains": chains, "max_cost": 1e3, "min_length": 0}
        wide = run(row(2, largest - 0.002), config(max_gap=0.05, **limits))
        narrow = run(row(2, largest + 0.002), config(max_gap=0.05, **limits))
        assert len(wide[0].pieces) == 2
        assert len(narrow[0].pieces) == 1


def test_a_global_matching_joins_pairs_that_greedy_choice_misses():
    """Two strands side by side behind a gap: the cheapest pair of all leaves the other two ends too far apart."""
    a, b = chain((-0.06, 0.0), (1, 0)), chain((0.02, -0.01), (1, 0))
    c, d = chain((-0.06, 0.01), (1, 0)), chain((0.02, 0.0), (1, 0))
    weights = {
        "direction_weight": 0.0,
        "distance_weight": 0.1,
        "max_cost": 110.0,
        "max_gap": 0.025,
        "chains": None,
        "min_length": 0,
    }
    greedy, best = (run([a, b, c, d], config(strategy=strategy, **weights)) for strategy in ("greedy", "global"))
    ends = a[-1], b[0], c[-1], d[0]
    assert joined(greedy, ends[0], ends[3])
    assert sum(len(x.confidence) for x in greedy) == 1
    assert joined(best, ends[0], ends[1])
    assert joined(best, ends[2], ends[3])


def bow(gap):
    """A ring with a gap, as an open chain."""
    turn = np.arange(25) * (2 * np.pi - gap) / 24
    radius = STEP / 2 / np.sin((2 * np.pi - gap) / 48)
    return radius * np.column_stack((np.cos(turn), np.sin(turn), 0 * turn))


@pytest.mark.parametrize(("strategy", "chains"), [("greedy", 1), ("greedy", None), ("global", None), ("global", 1)])
def test_rings_only_when_wanted(strategy, chains):
    (open_,) = run([bow(0.5)], config(strategy=strategy, allow_closed_chains=False, chains=chains, min_length=0))
    assert not open_.closed
    (ring,) = run([bow(0.5)], config(strategy=strategy, allow_closed_chains=True, chains=chains, min_length=0, max_cost=1e4))
    assert ring.closed
    assert len(ring.gap_paths) == len(ring.confidence) == 1


@pytest.mark.parametrize("strategy", ["greedy", "global"])
def test_two_halves_of_a_ring(strategy):
    whole = bow(0.3)
    halves = [whole[:11], whole[13:]]
    (open_,) = run(halves, config(strategy=strategy, allow_closed_chains=False))
    assert not open_.closed
    assert len(open_.confidence) == 1
    (ring,) = run(halves, config(strategy=strategy, allow_closed_chains=True, max_cost=1e4))
    assert ring.closed
    assert len(ring.confidence) == 2
    check_whole([ring], halves)


@pytest.mark.parametrize("strategy", ["greedy", "global"])
def test_a_ring_of_links_leaves_the_wanted_number(strategy):
    """Of three thirds of a ring two chains are wanted: of the three links that the matching holds, one is made."""
    thirds = [bow(0.3)[first : first + 7] for first in (0, 9, 18)]
    found = run(thirds, config(strategy=strategy, allow_closed_chains=True, chains=2, max_cost=1e4, max_gap=0.03))
    assert sorted(len(assembly.pieces) for assembly in found) == [1, 2]


def test_a_ring_that_was_found_closed_stays_closed():
    assemblies = run([bow(0.2), chain((0.3, 0), (1, 0), 30)], config(chains=None, min_length=0), closed=[True, False])
    assert sorted((len(a.pieces), a.closed) for a in assemblies) == [(1, False), (1, True)]


CAMERA = Camera(fx=500.0, fy=500.0, cx=160.0, cy=120.0, width=320, height=240)


@pytest.mark.parametrize("strategy", ["greedy", "global"])
@pytest.mark.parametrize("exposed_side", [-1, 1])
def test_free_space_decides_between_equal_pairs(strategy, exposed_side):
    """One chain, and two others alike above and below its end: behind one of the gaps the camera sees the wall."""
    one = chain((-0.08, 0.0), (1, 0))
    others = {side: chain((0.03, side * 0.02), (1, side * 0.3)) for side in (-1, 1)}
    depth = np.full((240, 320), 0.3, np.float32)
    v = np.arange(240)
    depth[(v > 120 if exposed_side == 1 else v < 120)] = 0.9
    scene = frame_scene(Frame(None, depth, CAMERA), np.zeros((240, 320), bool), radius=RADIUS, visibility__margin=0.01)
    chains = [one, others[1], others[-1]]
    settings = MergeConfig(chains=2, strategy=strategy, max_cost=1e4, free_space_weight=20.0)
    assemblies = run(chains, settings, scene=scene)
    assert joined(assemblies, one[-1], others[-exposed_side][0])
    assert not joined(assemblies, one[-1], others[exposed_side][0])


@dims
@pytest.mark.parametrize("strategy", ["greedy", "global"])
def test_one_chain_is_itself(dim, strategy):
    only = chain((0, 0), (1, 0), 9, dim)
    (assembly,) = run([only], config(strategy=strategy))
    assert [piece.tolist() for piece in assembly.pieces] in ([only.tolist()], [only[::-1].tolist()])
    assert assembly.gap_paths == ()


def test_short_chains_are_dropped_when_no_number_is_wanted():
    chains = [chain((0, 0), (1, 0), 9), chain((0, 1), (1, 0), 1)]
    assert len(run(chains, MergeConfig(chains=None, min_length=4))) == 1
    assert len(run(chains, MergeConfig(chains=None, min_length=2))) == 2
    assert len(run(chains, MergeConfig(chains=2, min_length=4))) == 2


def test_empty_in_empty_out():
    assert merge(Curves.of([]), empty_scene(radius=RADIUS), STEP, MergeConfig()).assemblies == []


@pytest.mark.parametrize(("settings", "setting"), [({"chains": 1}, "merge.chains"), ({"chains": None}, "merge.min_length")])
def test_dropped_chains_are_recorded_with_the_setting(settings, setting):
    chains = [*row(2), chain((0, 3), (0, 1), 2)]
    result = merged(chains, config(max_gap=0.5, min_length=6, max_cost=500, **settings))
    assert [(dropped.joints.tolist(), dropped.setting) for dropped in result.dropped] == [(chains[2].tolist(), setting)]
    assert result.dropped[0].length == pytest.approx(2 * STEP)


def test_decisions_are_recorded():
    """Three in a row, the cheapest connection first; the alternative to each connection shares one end with it."""
    chains = [*row(3), chain((0.07, 0.02), (1, 0.4))]
    result = merged(chains, config(max_cost=500, chains=None, min_length=12))
    assert {decision.chosen.ends for decision in result.decisions} == {(End(0, 1), End(1, 0)), (End(1, 1), End(2, 0))}
    assert costs_of(result) == sorted(costs_of(result))
    assert all(decision.kept for decision in result.decisions)
    for decision in result.decisions:
        assert len({*decision.chosen.ends} & {*decision.runner_up.ends}) == 1
        assert set(decision.chosen.terms) == {"distance", "direction", "curvature"}
        np.testing.assert_array_equal(decision.chosen.points[0], chains[decision.chosen.ends[0].chain][-1])


def test_connections_of_dropped_chains_are_not_kept():
    chains = [*row(2), *(c[:4] + np.array([0, 0.5, 0]) for c in row(2, 0.01))]
    result = merged(chains, config(chains=None, min_length=20, max_gap=0.08))
    assert sorted((decision.chosen.ends[0].chain, decision.kept) for decision in result.decisions) == [(0, True), (2, False)]
    assert [dropped.joints.tolist() for dropped in result.dropped] == [chain.tolist() for chain in chains[2:]]


@pytest.mark.parametrize("side", ["outside", "inside"])
def test_gap_paths_are_led_on_the_side_of_the_settings(side):
    """Two ends side by side that turn away from each other."""
    one, other = chain((-0.04, 0.02), (1, 0.6)), chain((-0.04, -0.02), (1, -0.6))
    one, other = (c - c[-1] + at for c, at in ((one, [0, 0.02, 0.5]), (other, [0, -0.02, 0.5])))
    (assembly,) = run([one, other], config(gap_side=side))
    first = arcs_of(assembly.gap_paths[0])[0]
    assert bool(first.angle > np.pi) == (side == "inside")

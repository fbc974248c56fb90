"""Pruning: overlapping cuboids, and which of two segments is removed."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from builders.errors import refuses

import doo3d
from doo3d.chains.prune import cuboids_intersect, near_pairs, prune
from doo3d.config import PruneConfig
from doo3d.errors import ConfigError
from doo3d.geometry.curves import Curves
from doo3d.geometry.limits import MAX_NEAR_PAIRS
from doo3d.geometry.polyline import perpendicular, unit
from doo3d.inputs import open_capture

dims = pytest.mark.parametrize("dim", [2, 3])
WIDTH = 0.3
SAMPLES = Path(__file__).parents[2] / "sample_clouds"


def chain(start, direction, count, dim=3):
    """`count` segments of length 1 from a point of the plane along a direction of it."""
    start, direction = (np.pad(np.asarray(v, dtype=float), (0, dim - 2)) for v in (start, direction))
    return start + np.arange(count + 1)[:, None] * unit(direction)


def run(*chains, closed=None):
    return prune(Curves.of(chains, closed), 1.0, PruneConfig(width=WIDTH)).chains


def joints(chains):
    return [c.tolist() for c in chains]


def box(a, b, width):
    """Axes (3, 3) in rows, half sizes (3,) and middle (3,) of the cuboid of a segment."""
    a, b = (np.pad(v, (0, 3 - len(v))) for v in (a, b))
    x = unit(b - a)
    y = perpendicular(x)
    return np.array([x, y, np.cross(x, y)]), np.array([np.linalg.norm(b - a), width, width]) / 2, (a + b) / 2


def slow_margin(one, other):
    """Largest distance between two cuboids along any of the separating axes; negative = they intersect."""
    (axes1, half1, middle1), (axes2, half2, middle2) = one, other
    candidates = [*axes1, *axes2, *(np.cross(p, q) for p in axes1 for q in axes2)]
    gaps = []
    for axis in candidates:
        if np.linalg.norm(axis) > 1e-9:
            axis = unit(axis)
            gaps.append(abs((middle2 - middle1) @ axis) - half1 @ np.abs(axes1 @ axis) - half2 @ np.abs(axes2 @ axis))
    return max(gaps)


def overlaps(starts, ends, width, owner=None):
    """Pairs of segments whose cuboids intersect, without consecutive ones of a chain."""
    pairs = near_pairs(starts, ends, np.arange(len(starts)) if owner is None else owner, width)
    return list(map(tuple, pairs[cuboids_intersect(starts, ends, pairs, width)].tolist()))


@dims
@pytest.mark.parametrize("width", [0.1, 0.4, 1.5])
def test_near_pairs_are_those_whose_spheres_meet(dim, width):
    random = np.random.default_rng(0)
    starts = random.uniform(0, 4, (40, dim))
    ends, owner = starts + unit(random.normal(size=(40, dim))), np.repeat(np.arange(4), 10)
    distance = np.linalg.norm((starts + ends)[:, None] - (starts + ends), axis=2) / 2
    near = np.triu(distance <= np.sqrt(1 + 2 * width**2), 1) & ~(np.eye(40, k=1, dtype=bool) & (owner[:, None] == owner))
    assert near_pairs(starts, ends, owner, width).tolist() == np.argwhere(near).tolist()


@dims
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("width", [0.1, 0.4, 1.5])
def test_overlaps_against_separating_axes(dim, seed, width):
    random = np.random.default_rng(seed)
    starts = random.uniform(0, 2.5, (25, dim))
    ends = starts + unit(random.normal(size=(25, dim))) * random.uniform(0.3, 1.2, (25, 1))
    boxes = [box(a, b, width) for a, b in zip(starts, ends, strict=True)]
    margins = {(i, j): slow_margin(boxes[i], boxes[j]) for j in range(25) for i in range(j)}
    found = overlaps(starts, ends, width)
    assert found == sorted(found)
    assert {pair for pair, margin in margins.items() if margin < -1e-6} <= set(found)
    assert set(found) <= {pair for pair, margin in margins.items() if margin < 1e-6}
    assert 0 < len(found)


@dims
def test_the_segment_of_the_shorter_chain_is_removed(dim):
    long, short = chain((0, 0), (1, 0), 7, dim), chain((3.5, -1.5), (0, 1), 3, dim)
    for order in ((long, short), (short, long)):
        kept = run(*order)
        assert long.tolist() in joints(kept)
        assert sorted(len(c) - 1 for c in kept) == [1, 1, 7]


@dims
def test_lengths_count_what_chains_lost_before(dim):
    """The second overlaps the first in three segments and is then shorter than the third, which it crosses."""
    first, second = chain((0, 0), (1, 0), 12, dim), chain((9.2, 0.1), (1, 0), 6, dim)
    third = chain((14.5, -1.5), (0, 1), 5, dim)
    kept = run(first, second, third)
    assert first.tolist() in joints(kept)
    assert third.tolist() in joints(kept)
    assert sum(len(c) - 1 for c in kept) == 12 + 5 + 2


@dims
def test_a_chain_that_loses_an_inner_segment_falls_in_two(dim):
    crossed, crossing = chain((0, 0), (1, 0), 5, dim), chain((2.5, -3.5), (0, 1), 7, dim)
    kept = run(crossed, crossing)
    assert len(kept) == 3
    assert crossed[:3].tolist() in joints(kept)
    assert crossed[3:].tolist() in joints(kept)
    assert crossing.tolist() in joints(kept)


@dims
def test_a_chain_without_segments_is_removed(dim):
    """The way back along a branch lies on the way out, as a contour gives them."""
    out, back = chain((0, 0), (1, 0), 6, dim), chain((5.5, 0.1), (-1, 0), 5, dim)
    assert joints(run(out, back)) == joints(run(back, out)) == [out.tolist()]


@dims
def test_neighbors_in_a_chain_are_kept(dim):
    turn = np.radians(np.arange(8) * 55.0)
    points = np.cumsum(np.column_stack((np.cos(turn), np.sin(turn))), axis=0)
    bent = np.pad(points[:5], ((0, 0), (0, dim - 2)))
    assert joints(run(bent)) == [bent.tolist()]


@dims
def test_a_chain_that_crosses_itself_is_cut_once(dim):
    turn = np.radians([0] * 6 + [90] * 6 + [135] + [180] * 3 + [270] * 10)
    points = np.cumsum(np.column_stack((np.cos(turn), np.sin(turn))), axis=0)
    kept = run(np.pad(points, ((0, 0), (0, dim - 2))))
    assert sum(len(c) - 1 for c in kept) == 24
    assert len(kept) == 2


@dims
@pytest.mark.parametrize(("width", "apart", "count"), [(0.3, 0.25, 1), (0.3, 0.35, 2), (0.6, 0.35, 1)])
def test_the_width_decides(dim, width, apart, count):
    parallel = [chain((0, 0), (1, 0), 5, dim), chain((0.2, apart), (1, 0), 4, dim)]
    assert len(prune(Curves.of(parallel), 1.0, PruneConfig(width=width)).chains) == count


@dims
def test_the_width_comes_from_the_voxel(dim):
    parallel = [chain((0, 0), (1, 0), 5, dim), chain((0.2, 0.35), (1, 0), 4, dim)]
    assert len(prune(Curves.of(parallel), 0.2, PruneConfig()).chains) == 2
    assert len(prune(Curves.of(parallel), 0.3, PruneConfig()).chains) == 1


def test_strands_over_each_other_do_not_overlap():
    low, high = chain((0, 0), (1, 0), 5), chain((2.5, -2.5), (0, 1), 5)
    lifted = high + np.array([0, 0, 0.4])
    assert len(run(low, high)) == 3
    assert joints(run(low, lifted)) == joints([low, lifted])


@dims
def test_first_and_last_of_a_ring_are_neighbors(dim):
    turn = np.arange(13) * 2 * np.pi / 12.02
    points = 0.5 / np.sin(np.pi / 12.02) * np.column_stack((np.cos(turn), np.sin(turn)))
    ring = np.pad(points, ((0, 0), (0, dim - 2)))
    assert run(ring, closed=[True]).closed.tolist() == [True]
    cut = run(ring, chain((0, 0), (1, 0.3), 14, dim), closed=[True, False])
    assert not cut.closed.any()
    assert sum(len(c) - 1 for c in cut) == 14 + 12 - 1


def test_nothing_overlaps_afterwards():
    random = np.random.default_rng(1)
    chains = [chain(random.uniform(0, 10, 2), random.normal(size=2), random.integers(1, 9)) for _ in range(12)]
    kept = run(*chains)
    starts = np.concatenate([c[:-1] for c in kept])
    ends = np.concatenate([c[1:] for c in kept])
    owner = np.repeat(np.arange(len(kept)), [len(c) - 1 for c in kept])
    assert overlaps(starts, ends, WIDTH, owner) == []
    assert sum(len(c) - 1 for c in kept) < sum(len(c) - 1 for c in chains)


def test_empty_in_empty_out():
    pruned = prune(Curves.of([]), 1.0, PruneConfig())
    assert len(pruned.chains) == 0
    assert pruned.removed.shape == (0, 2, 2)


@dims
def test_removed_segments_are_recorded(dim):
    crossed, crossing = chain((0, 0), (1, 0), 5, dim), chain((2.5, -3.5), (0, 1), 7, dim)
    pruned = prune(Curves.of([crossing, crossed]), 1.0, PruneConfig(width=WIDTH))
    np.testing.assert_array_equal(pruned.removed, [crossed[2:4]])


@pytest.mark.parametrize(
    ("preset", "capture", "overrides"),
    [
        ("default", "crossing", {"fit.segment_length": 0.03}),
        ("paper_3d", "crossing", {"fit.segment_length": 0.03}),
        ("image", "photos", {}),
        ("paper_2d", "photos", {}),
    ],
)
def test_fcl_decides_every_near_pair_of_the_samples(monkeypatch, preset, capture, overrides):
    """In 2-D and 3-D, by every preset; with segments of 30 mm, those of the 3-D samples come near each other."""
    import fcl

    near, calls = [], []
    module = import_module("doo3d.chains.prune")
    monkeypatch.setattr(module, "near_pairs", lambda *args: near.append(near_pairs(*args)) or near[-1])
    collide = fcl.collide
    monkeypatch.setattr(fcl, "collide", lambda *args: calls.append(args) or collide(*args))
    for frame in open_capture(SAMPLES / capture).frames[:2]:
        loaded = frame.load()
        doo3d.detect(loaded.data, doo3d.load_config(preset, overrides), loaded.mask)
    assert len(calls) == sum(map(len, near)) > 0


def test_without_fcl_the_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "fcl", None)
    with pytest.raises(doo3d.errors.MissingDependency, match="fcl cannot be imported"):
        run(chain((0, 0), (1, 0), 7), chain((3.5, -1.5), (0, 1), 3))


def test_a_segment_is_one_object_and_a_test_does_not_depend_on_the_one_before(monkeypatch):
    import fcl

    made = []
    box = fcl.Box
    monkeypatch.setattr(fcl, "Box", lambda *edges: made.append(edges) or box(*edges))
    starts = np.array([(0.0, 0, 0), (0.5, -0.5, 0), (0.5, -0.5, 0.4), (9.0, 0, 0)])
    ends = starts + np.array([(1.0, 0, 0), (0, 1, 0), (0, 1, 0), (0, 1, 0)])
    pairs = np.array([(0, 1), (0, 2), (1, 2), (0, 1)])
    assert cuboids_intersect(starts, ends, pairs, WIDTH).tolist() == [True, False, False, True]
    assert made == [(1.0, WIDTH, WIDTH)] * 3


def test_the_width_has_an_upper_bound():
    for width in (1e308, 100.1):
        with pytest.raises(doo3d.ConfigError, match=r"prune\.width"):
            doo3d.load_config("default", {"prune.width": width})
    widest = doo3d.load_config("default", {"prune.width": 100}).prune
    pruned = prune(Curves.of([chain((0, 0), (1, 0), 7), chain((3.5, 5), (0, 1), 3)]), 1.0, widest)
    assert len(pruned.removed) == 3  # those of the shorter chain


@dims
def test_segments_of_which_too_many_may_overlap_are_refused(dim):
    """The limit counts the pairs themselves: it is not passed by many segments that lie apart."""
    count = int(np.sqrt(2 * MAX_NEAR_PAIRS)) + 2
    starts = np.arange(count)[:, None] * np.eye(dim)[0] * 3
    ends, owner = starts + np.eye(dim)[1], np.arange(count)
    assert len(near_pairs(starts, ends, owner, WIDTH)) == 0
    with refuses("value-out-of-bounds", "fit.segment_length, prune.width", f"{count * (count - 1) // 2} pairs", kind=ConfigError):
        near_pairs(starts * 1e-6, ends, owner, WIDTH)

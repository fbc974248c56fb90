"""Rings over time: the same joint is the same point of the material, also where the ring is hidden, and where it is seen open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from doo3d import load_config
from doo3d.evaluation.sequences.moving_rings import moving_ring, table
from doo3d.evaluation.sequences.nodes import node_offsets
from doo3d.geometry.equal_segments import close_ring
from doo3d.outputs.run_reader import open_results
from doo3d.outputs.sequence_files import SequenceFile, read_objects, write_objects
from doo3d.track.detect_sequence import combine, detect_sequence
from doo3d.track.objects import find_objects
from doo3d.track.observations import Observation, ObservedStrand
from doo3d.track.rings import fit_ring, place_on_ring
from doo3d.track.strand_ends import CUT_OFF, TIP
from doo3d.types import Chain, Detection

COUNT, SEGMENT, RADIUS = 60, 0.01, 0.003
LENGTH = COUNT * SEGMENT
CONFIG = load_config("default", {"merge.chains": 1})


def ring(time):
    """A ring that is not round, and bends, turns and moves; the same point of the material first at all times: (COUNT, 3) m."""
    angles = np.linspace(0, 2 * np.pi, COUNT, endpoint=False)
    bent = 1 + 0.25 * np.cos(2 * angles) + (0.12 + 0.04 * np.sin(time)) * np.cos(3 * angles + 1)
    flat = 0.09 * bent[:, None] * np.column_stack((np.cos(angles), np.sin(angles), 0.2 * np.cos(2 * angles)))
    turned = Rotation.from_rotvec((0.1 * time, 0, 0.2 * time)).apply(flat)
    return close_ring(turned + np.array([0.05 * time, -0.03 * time, 0.6]), SEGMENT)[:-1]


def closed_in(time, start=0, backwards=False, hidden=()):
    """A frame that shows the ring closed, its chain from another joint on."""
    joints = np.roll(ring(time)[:: -1 if backwards else 1], -start, axis=0)
    rng = np.random.default_rng([int(100 * time), start])
    joints = close_ring(joints + rng.normal(0, 2e-4, joints.shape), SEGMENT)[:-1]
    occluded = np.isin(np.arange(COUNT), hidden)
    chain = Chain(np.concatenate((joints, joints[:1])), SEGMENT, RADIUS, occluded=occluded, closed=True, confidence=1.0)
    return Observation(Detection((chain,), timestamp=time), ())


def open_in(time, parts):
    """A frame that shows parts (first, end) of the ring, as segments of the material."""
    around = np.concatenate([ring(time)] * 3)
    chains, strands = [], []
    for number, (first, end) in enumerate(parts):
        line = around[COUNT + first : COUNT + end + 1]
        chains.append(Chain(line, SEGMENT, RADIUS, confidence=1.0))
        arcs = np.arange(len(line)) * SEGMENT
        strands.append(ObservedStrand(line, arcs, float(arcs[-1]), (TIP, CUT_OFF), number))
    return Observation(Detection(tuple(chains), timestamp=time), tuple(strands))


def times(count=24):
    return np.arange(count) / 15


def errors(detections, count):
    """How far the joints of each frame are from their points of the material, m, at the best beginning of all frames together."""
    best = np.inf
    truth = np.array([ring(time) for time in times(count)])
    joints = np.array([detection.chains[0].joints[:-1] for detection in detections])
    for way in (1, -1):
        for start in range(COUNT):
            off = np.linalg.norm(np.roll(joints[:, ::way], start, axis=1) - truth, axis=2)
            best = off if np.mean(off) < np.mean(best) else best
    return best


def check_rings(detections):
    for detection in detections:
        (chain,) = detection.chains
        assert chain.closed
        assert chain.id == 0
        assert len(chain.joints) == COUNT + 1


def test_a_ring_keeps_its_id_and_its_joints_whatever_joint_each_frame_begins_with():
    rng = np.random.default_rng(4)
    seen = [closed_in(time, int(rng.integers(COUNT)), bool(rng.integers(2))) for time in times()]
    found = list(combine(seen, CONFIG))
    check_rings(found)
    assert errors(found, 24).max() < 0.004
    assert not any(detection.chains[0].occluded.any() for detection in found)


def test_what_is_hidden_comes_from_other_frames():
    seen = [open_in(time, [(5, 42)]) if 8 <= k < 15 else closed_in(time, 11 * k % COUNT) for k, time in enumerate(times())]
    found = list(combine(seen, CONFIG))
    check_rings(found)
    assert errors(found, 24).max() < 0.008
    for k, detection in enumerate(found):
        chain = detection.chains[0]
        hidden = chain.from_time.sum()
        assert 20 <= hidden <= 26 if 8 <= k < 15 else hidden == 0
        assert len(chain.connections) == (8 <= k < 15)


def test_a_ring_that_a_hand_parts_in_two_is_one_object():
    seen = [open_in(time, [(3, 25), (32, 56)]) if 8 <= k < 15 else closed_in(time) for k, time in enumerate(times())]
    items = find_objects(seen, load_config("default"))
    assert [(item.closed, item.segments) for item in items] == [(True, COUNT)]
    found = list(combine(seen, load_config("default")))
    check_rings(found)
    assert errors(found, 24).max() < 0.006


def test_a_cable_whose_ends_touch_for_a_while_is_no_ring():
    apart = [open_in(time, [(0, 60)]) for time in times(20)]
    for k, observation in enumerate(apart):
        chain, strand = observation.detection.chains[0], observation.strands[0]
        line = chain.joints + np.linspace(-1, 1, 61)[:, None] * (0.0, 0.0, 0.06)
        line = line[0] + np.concatenate((np.zeros((1, 3)), np.cumsum(np.diff(line, axis=0), axis=0)))
        steps = np.diff(line, axis=0)
        steps *= SEGMENT / np.linalg.norm(steps, axis=1, keepdims=True)
        line = line[0] + np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
        detection = replace(observation.detection, chains=(replace(chain, joints=line),))
        apart[k] = Observation(detection, (replace(strand, points=line, tips=(TIP, TIP)),))
    touching = [closed_in(time) for time in times(24)[20:]]
    assert not any(item.closed for item in find_objects([*apart, *touching], CONFIG))


def test_two_rings_and_a_limit_to_their_number():
    def both(time):
        first, second = closed_in(time).detection.chains[0], closed_in(time + 1).detection.chains[0]
        second = replace(second, joints=second.joints + np.array([0.4, 0.0, 0.0]))
        return Observation(Detection((first, second), timestamp=time), ())

    seen = [both(time) for time in times(10)]
    assert [len(detection.chains) for detection in combine(seen, load_config("default"))] == [2] * 10
    assert {chain.id for detection in combine(seen, load_config("default")) for chain in detection.chains} == {0, 1}
    assert len(find_objects(seen, CONFIG)) == 1


def test_objects_are_read_back_as_they_were(tmp_path):
    items = find_objects([closed_in(time, 7 * k % COUNT) for k, time in enumerate(times(8))], CONFIG)
    known = SequenceFile(tuple(map(str, range(8))), 15, 0.1, tuple(items))
    write_objects(tmp_path, known)
    assert read_objects(tmp_path) == known
    assert items[0].closed
    assert any(anchor.start for anchor in items[0].anchors)


@pytest.mark.parametrize("part", [(0, 30), (40, 95), (13, 72)])
def test_a_strand_is_placed_on_a_ring_wherever_it_begins(part):
    (strand,) = open_in(0.1, [part]).strands
    expected = np.concatenate((ring(0.0), ring(0.0)[:1]))
    (placed,) = place_on_ring([strand], expected, LENGTH, 0.03)
    true = (np.arange(part[0], part[1] + 1) * SEGMENT) % LENGTH
    off = (placed.arcs - true + LENGTH / 2) % LENGTH - LENGTH / 2
    assert np.abs(off).max() < 0.003
    joints, seen, _ = fit_ring(expected, [replace(placed, arcs=true)], LENGTH)
    np.testing.assert_array_equal(joints[0], joints[-1])
    assert seen.sum() >= part[1] - part[0]
    at = np.flatnonzero(seen[:-1])
    assert np.linalg.norm(joints[at] - ring(0.1)[at], axis=1).max() < 0.002
    np.testing.assert_allclose(np.linalg.norm(np.diff(joints, axis=0), axis=1), SEGMENT, rtol=1e-6)
    assert place_on_ring([], expected, LENGTH, 0.03) == []


def test_lengths_of_a_ring_are_exact():
    rng = np.random.default_rng(0)
    joints = close_ring(ring(0) + rng.normal(0, 1e-3, (COUNT, 3)), SEGMENT)
    np.testing.assert_allclose(np.linalg.norm(np.diff(joints, axis=0), axis=1), SEGMENT, rtol=1e-6)


@pytest.mark.slow
def test_a_rendered_ring_is_whole_in_every_frame(doo3d, tmp_path):
    frames = list(moving_ring(0, 24))
    config = load_config("default", {"merge.chains": 1})
    found = detect_sequence([each.frame for each in frames], config, [each.mask for each in frames])
    assert all(detection.chains[0].closed for detection in found)
    offsets = node_offsets(
        [detection.chains[0] for detection in found], [each.truths[0] for each in frames], keeps_direction=True
    )
    assert np.median(np.linalg.norm(offsets, axis=2)) < 0.005
    camera = frames[0].frame.camera
    np.savez(
        tmp_path / "ring.npz",
        depth=np.stack([each.frame.depth for each in frames]),
        mask=np.stack([each.mask for each in frames]),
        color=np.stack([each.frame.color for each in frames]),
        K=np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]),
    )
    options = ("--set", "merge.chains=1")
    assert doo3d("detect", tmp_path / "ring.npz", "-o", tmp_path / "out", "--sequence", *options)[0] == 0
    for alone, written in zip(found, open_results(tmp_path / "out").detections(), strict=True):
        assert written.chains[0].closed
        np.testing.assert_allclose(written.chains[0].joints, alone.chains[0].joints, atol=1e-9)


@pytest.mark.slow
def test_the_table():
    lines = list(table(seeds=1, frames=5))
    assert [line.split(" | ")[0] for line in lines] == [
        "| rings",
        "|---|---|---|---|---|---|---|",
        "| single",
        "| sequence",
    ]

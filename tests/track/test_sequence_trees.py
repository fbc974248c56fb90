"""Branched objects in all frames of a capture together: a Y that is drawn, moved and half hidden."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import doo3d
from doo3d.config import load_config
from doo3d.geometry.polyline import arc_length, resample
from doo3d.outputs.sequence_files import SequenceFile, read_objects, summary, write_objects
from doo3d.track import detect_sequence as module
from doo3d.track.detect_sequence import combine, detect_sequence
from doo3d.track.junction_vote import OPEN, trees_of, vote_pattern
from doo3d.track.objects import find_objects
from doo3d.track.observations import Observation, ObservedStrand
from doo3d.track.strand_ends import CUT_OFF, TIP
from doo3d.types import Chain, ChainEnd, Detection, Junction, LinearObject

SEGMENT, RADII = 0.01, (0.004, 0.004, 0.003)
COUNTS = (26, 22, 18)  # segments of the arms


def arms(time):
    """The joints of the arms of a Y from its junction on, each bending with time; the first two are the trunk."""
    start = np.array([0.05 * time, 0.03 * np.sin(2 * time), 0.8])
    result = []
    for k, (heading, count) in enumerate(zip((np.pi, 0.15, 1.2), COUNTS, strict=True)):
        along = np.arange(count) * SEGMENT
        turn = heading + 0.1 * np.sin(3 * time + k) + (1.5 + 0.5 * k) * np.sin(2 * time + 2 * k) * along
        steps = np.column_stack((np.cos(turn), np.sin(turn), 0.1 * np.sin(5 * along + time)))
        steps *= SEGMENT / np.linalg.norm(steps, axis=1, keepdims=True)
        result.append(start + np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0))))
    return result


def seen_in(time, parts, flipped=False):
    """An observation of arms, or of some of their joints.

    parts : arm -> (first, last) joint that is seen. An arm that is seen from its first joint on ends at the junction, if all
    three do; "joined" : the first two arms are one chain, and there is no junction.
    """
    joints = arms(time)
    lines = {}
    if "joined" in parts:
        lines[0] = (np.concatenate((joints[0][::-1], joints[1][1:])), RADII[0], (TIP, TIP), None)
    for arm, (first, last) in ((arm, part) for arm, part in parts.items() if arm != "joined"):
        ends = (TIP if first == 0 else CUT_OFF, TIP if last == COUNTS[arm] else CUT_OFF)
        lines[arm] = (joints[arm][first : last + 1], RADII[arm], ends, 0 if first == 0 else None)
    meets = sum(side is not None for *_, side in lines.values()) == 3
    chains, strands, ends = [], [], []
    order = sorted(lines, key=lambda arm: -len(lines[arm][0]) if flipped else arm)
    for number, arm in enumerate(order):
        points, radius, tips, side = lines[arm]
        backwards = flipped and arm == 1
        points, tips = (points[::-1], tips[::-1]) if backwards else (points, tips)
        chains.append(Chain(points, SEGMENT, radius))
        arcs = np.arange(len(points)) * SEGMENT
        strands.append(ObservedStrand(points, arcs, float(arcs[-1]), tips, number))
        if meets and side is not None:
            ends.append(ChainEnd(number, 1 if backwards else 0))
    junctions = (Junction(joints[0][0], tuple(ends), np.array(RADII), 0.9),) if meets else ()
    trunk = tuple(order.index(arm) for arm in (0, 1) if arm in order)
    rest = tuple(number for number in range(len(order)) if number not in trunk)
    objects = (LinearObject((*trunk, *rest), (0,), 2),) if meets else tuple(LinearObject((k,)) for k in range(len(order)))
    name = f"{time:.3f}"
    detection = Detection(tuple(chains), frame=name, timestamp=time, junctions=junctions, objects=objects)
    return Observation(detection, tuple(strands))


WHOLE = {0: (0, 26), 1: (0, 22), 2: (0, 18)}
UNBRANCHED = {"joined": True, 2: (2, 18)}  # the junction is not seen
HALF = {0: (0, 26), 1: (0, 22), 2: (0, 7)}
TRUNK = {"joined": True}
END = {0: (0, 26), 1: (8, 22), 2: (0, 18)}


def times(count):
    return np.arange(count) / 30


def run(plan, settings=None):
    config = load_config("harness", settings)
    observations = [
        seen_in(time, parts, flipped=k % 4 == 1) for k, (time, parts) in enumerate(zip(times(len(plan)), plan, strict=True))
    ]
    return list(combine(observations, config))


def errors(detections):
    """The largest distance of a joint of each arm from its true place, mm: (frames, 3)."""
    result = []
    for time, detection in zip(times(len(detections)), detections, strict=True):
        true = {len(joints): joints for joints in arms(time)}
        row = []
        for count in COUNTS:
            (chain,) = (each for each in detection.chains if len(each.occluded) == count)
            goal = true[count + 1]
            row.append(1e3 * min(np.linalg.norm(line - goal, axis=1).max() for line in (chain.joints, chain.joints[::-1])))
        result.append(row)
    return np.array(result)


def check_tree(detection):
    """One object of three chains with one junction, which are in the same order in every frame."""
    assert [(each.chains, each.junctions, each.trunk) for each in detection.objects] == [((0, 1, 2), (0,), 2)]
    (junction,) = detection.junctions
    assert {end.chain for end in junction.ends} == {0, 1, 2}
    for chain, end in junction.ends:
        assert np.linalg.norm(detection.chains[chain].joints[-end] - junction.position) <= SEGMENT / 2
    assert junction.radii.tolist() == [detection.chains[end.chain].radius for end in junction.ends]


def test_the_tree_is_the_same_in_every_frame():
    plan = [WHOLE] * 8 + [UNBRANCHED] * 4 + [WHOLE] * 3 + [HALF] * 6 + [TRUNK] * 3 + [WHOLE] * 3 + [END] * 4 + [WHOLE] * 5
    detections = run(plan)
    for detection in detections:
        check_tree(detection)
    assert {tuple(chain.id for chain in detection.chains) for detection in detections} == {(0, 1, 2)}
    assert len({detection.junctions[0].ends for detection in detections}) == 1
    found = errors(detections)
    assert found[:, :2].max() < 6
    assert np.median(found) < 1
    assert found[[k for k, parts in enumerate(plan) if parts is not TRUNK]].max() < 20
    hidden = detections[17].chains[2]
    assert hidden.from_time.any()
    assert not detections[17].chains[0].occluded.any()
    assert not any(detection.crossings for detection in detections)


def test_a_junction_of_few_frames_is_none():
    """A strand that touches the trunk in 3 of 20 frames, where it is taken for a branch."""
    apart = {"joined": True, 2: (0, 18)}
    detections = run([apart] * 8 + [WHOLE] * 3 + [apart] * 9)
    assert all(len(detection.chains) == 2 and not detection.junctions for detection in detections)
    assert all([len(each.chains) for each in detection.objects] == [1, 1] for detection in detections)


def test_a_tree_of_which_nothing_is_seen_is_filled_up_to_a_limit():
    plan = [WHOLE] * 10 + [{}] * 6 + [WHOLE] * 10
    for detection in run(plan):
        check_tree(detection)
    gone = run(plan, {"sequence.max_gap": 0.1})
    assert [len(detection.chains) for detection in gone] == [3] * 10 + [0] * 6 + [3] * 10
    assert gone[12].junctions == gone[12].objects == ()


def test_a_branch_is_not_taken_away_while_its_trunk_is_seen():
    detections = run([WHOLE] * 10 + [TRUNK] * 12 + [WHOLE] * 10, {"sequence.max_gap": 0.1})
    for detection in detections:
        check_tree(detection)
    assert detections[15].chains[2].from_time.all()


def test_the_number_of_objects_counts_trees():
    for detection in run([WHOLE] * 6, {"merge.chains": 1}):
        check_tree(detection)


def test_windows_agree_with_the_whole(monkeypatch):
    plan = [WHOLE if k % 20 < 12 else HALF for k in range(60)]
    whole = run(plan)
    monkeypatch.setattr(module, "WINDOW", 20)
    monkeypatch.setattr(module, "CONTEXT", 15)
    for one, other in zip(whole, run(plan), strict=True):
        check_tree(other)
        assert np.linalg.norm(one.junctions[0].position - other.junctions[0].position) < 1e-3


def test_the_objects_are_read_as_they_were_written(tmp_path):
    config = load_config("harness")
    plan = zip(times(8), [WHOLE] * 6 + [HALF] * 2, strict=True)
    objects = find_objects([seen_in(time, parts) for time, parts in plan], config)
    assert [item.is_trunk for item in objects] == [True, True, False]
    assert len(objects[2].parts) == 2
    known = SequenceFile(("a",), 3, 0.05, tuple(objects))
    write_objects(tmp_path, known)
    assert read_objects(tmp_path) == known
    assert [each["junctions"] for each in summary(objects, 8)] == [[0, None]] * 3
    assert json.dumps(summary(objects, 8))


@pytest.mark.parametrize(
    ("patterns", "expected"),
    [([], OPEN), ([OPEN] * 5, OPEN), ([OPEN] * 5 + [(True, False)] * 4, (True, False)), ([OPEN] * 9 + [(True, False)] * 2, OPEN)],
)
def test_the_richest_pattern_that_enough_frames_have(patterns, expected):
    assert vote_pattern(patterns, 3) == expected


def test_trees():
    from doo3d.track.junction_vote import Node

    a, b, c = (Node(number, 1.0) for number in range(3))
    nodes = [(None, a), (None, b), (a, b), (None, None), (a, None), (c, None)]
    assert trees_of(nodes) == [[0, 1, 2, 4], [3], [5]]


def cloud(time, hidden=()):
    """Points on the camera's side of the arms; hidden : (arm, first joint) from which on an arm is not seen."""
    rng = np.random.default_rng(round(1000 * time))
    parts = []
    for arm, (joints, radius) in enumerate(zip(arms(time), RADII, strict=True)):
        end = min((first for number, first in hidden if number == arm), default=COUNTS[arm]) * SEGMENT
        axis = np.repeat(resample(joints, np.linspace(0, min(end, arc_length(joints)[-1]), int(end / 0.0008))), 8, axis=0)
        normals = rng.normal(0, 1, axis.shape)
        normals[:, 2] = -np.abs(normals[:, 2])
        parts.append(axis + radius * normals / np.linalg.norm(normals, axis=1, keepdims=True))
    return doo3d.Cloud(np.concatenate(parts), segmented=True, timestamp=float(time), viewpoint=np.zeros(3))


def test_a_sequence_of_clouds():
    frames = [cloud(time, [(2, 8)] if k in (4, 5) else [(1, 12)] if k == 7 else []) for k, time in enumerate(times(10))]
    detections = detect_sequence(frames, load_config("harness"))
    for detection in detections:
        check_tree(detection)
    assert {tuple(len(chain.joints) for chain in detection.chains) for detection in detections} == {(27, 23, 19)}
    found = errors([replace(detection, frame="") for detection in detections])
    assert found.max() < 12
    assert np.median(found) < 3.5

"""Objects found in all frames of a capture together, from observations of a cable that is drawn, hidden and moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import doo3d
from doo3d.config import Config, load_config
from doo3d.geometry.polyline import arc_length, resample
from doo3d.track.background import BackgroundView
from doo3d.track.detect_sequence import combine, detect_sequence, frame_seconds
from doo3d.track.frame_result import BREAK_NOTE, CONTRADICTED_NOTE
from doo3d.track.object_length import vote_length
from doo3d.track.objects import find_objects
from doo3d.track.observations import Observation, ObservedStrand
from doo3d.track.registration import exact_lengths
from doo3d.track.sequence_notes import sequence_notes
from doo3d.track.strand_ends import CUT_OFF, TIP
from doo3d.track.world_frame import in_world
from doo3d.types import Chain, Detection

SEGMENT, COUNT, RADIUS = 0.01, 60, 0.004


def shape(time):
    """The joints of a cable 0.6 m long that sways and drifts; the same joint is the same point of the cable at all times."""
    t = np.linspace(0, 1, 2001)
    points = np.column_stack((t, 0.25 * np.sin(np.pi * t) * np.cos(3 * time) + 0.1 * t, 0.8 + 0.1 * np.sin(2 * t + time)))
    points *= COUNT * SEGMENT / arc_length(points)[-1]
    points += np.array([0.1 * time, 0.03 * np.sin(2 * time), 0.8])
    return exact_lengths(resample(points, np.linspace(0, arc_length(points)[-1], COUNT + 1)), SEGMENT)


def seen_in(time, parts, reverse=False):
    """An observation in which only parts (first, last) of the joints are seen, the longest as a chain, the others dropped."""
    joints = shape(time)[::-1] if reverse else shape(time)
    strands, chains = [], []
    for first, last in sorted(parts, key=lambda part: part[0] - part[1]):
        points = joints[first : last + 1]
        arcs = np.arange(len(points)) * SEGMENT
        tips = (TIP if first == 0 else CUT_OFF, TIP if last == COUNT else CUT_OFF)
        strands.append(ObservedStrand(points, arcs, float(arcs[-1]), tips, 0 if not chains else -1))
        if not chains:
            chains.append(Chain(points, SEGMENT, RADIUS))
    return Observation(Detection(tuple(chains), coordinates="camera", frame=f"{time:.3f}", timestamp=time), tuple(strands))


def times(count=40):
    return np.arange(count) / 30


def errors(detections):
    """The largest distance of a joint from its true place, for each frame, mm; inf without a chain."""
    result = []
    for time, detection in zip(times(len(detections)), detections, strict=True):
        if len(detection.chains) != 1:
            result.append(np.inf)
            continue
        joints = detection.chains[0].joints
        result.append(1e3 * min(np.linalg.norm(line - shape(time), axis=1).max() for line in (joints, joints[::-1])))
    return np.array(result)


def run(observations, settings=None):
    return list(combine(observations, load_config("default", settings or {})))


def notes_of(observations, settings):
    config = load_config("default", settings)
    return sequence_notes(observations, find_objects(in_world(observations), config), config)


def test_hidden_ends_and_far_parts_come_from_other_frames():
    whole, cut, two = [(0, 60)], [(0, 38)], [(0, 20), (42, 60)]
    plan = [whole] * 10 + [cut] * 8 + [whole] * 4 + [two] * 10 + [whole] * 8
    detections = run([seen_in(time, parts) for time, parts in zip(times(), plan, strict=True)])
    assert np.median(errors(detections)) < 1.0
    assert errors(detections).max() < 25
    chains = [detection.chains[0] for detection in detections]
    assert {len(chain.joints) for chain in chains} == {61}
    assert {chain.id for chain in chains} == {0}
    assert not chains[0].occluded.any()
    assert chains[12].from_time[45:].all()
    assert not chains[12].occluded[:35].any()


def test_every_frame_runs_in_the_same_direction():
    detections = run([seen_in(time, [(0, 60)], reverse=k % 3 == 1) for k, time in enumerate(times())])
    starts = np.array([detection.chains[0].joints[0] for detection in detections])
    assert np.linalg.norm(np.diff(starts, axis=0), axis=1).max() < 0.05


def test_what_is_seen_stays_where_it_was_seen():
    """Also a step in the motion: nothing lags behind."""
    still, moved = seen_in(0.0, [(0, 60)]), seen_in(0.5, [(0, 60)])
    detections = run([still] * 8 + [moved] * 8)
    for detection, observation in zip(detections, [still] * 8 + [moved] * 8, strict=True):
        joints = detection.chains[0].joints
        expected = observation.detection.chains[0].joints
        assert min(np.abs(line - expected).max() for line in (joints, joints[::-1])) < 2e-3


def test_frames_that_show_nothing_are_filled_up_to_a_limit():
    plan = [[(0, 60)]] * 12 + [[]] * 10 + [[(0, 60)]] * 12
    observations = [seen_in(time, parts) for time, parts in zip(times(34), plan, strict=True)]
    filled = run(observations)
    assert all(len(detection.chains) == 1 for detection in filled)
    assert filled[16].chains[0].from_time.all()
    assert errors(filled).max() < 60
    without = run(observations, {"sequence.max_gap": 0.2})
    assert [len(detection.chains) for detection in without] == [1] * 12 + [0] * 10 + [1] * 12
    assert without[16].notes[-1] == BREAK_NOTE.format(id=0)


def test_a_fragment_is_not_an_object():
    def both(time):
        one = seen_in(time, [(0, 35)])
        far = Chain(shape(time)[42:], SEGMENT, RADIUS)
        return replace(one, detection=replace(one.detection, chains=(*one.detection.chains, far)))

    plan = [seen_in(time, [(0, 60)]) if k < 12 or k > 28 else both(time) for k, time in enumerate(times())]
    (item,) = find_objects(plan, Config())
    assert item.length == pytest.approx(0.6, rel=0.01)


@pytest.mark.parametrize(
    ("given", "is_noted"), [(None, False), (0.6, False), (0.609, False), (0.58, True), (0.63, True), (1.0, True)]
)
def test_a_given_length_that_the_frames_do_not_show_is_noted(given, is_noted):
    observations = [seen_in(time, [(0, 60)]) for time in times(8)]
    notes = notes_of(observations, {} if given is None else {"sequence.length": given})
    noted = [note for note in notes if "sequence.length is" in note]
    assert len(noted) == is_noted
    assert is_noted or not notes
    assert not noted or (f"sequence.length is {given:.3f} m" in noted[0] and "show 0.600 m" in noted[0])


@pytest.mark.parametrize("divided", [(12,), (12, 20), (12, 13, 24)])
@pytest.mark.parametrize("parts", [(35, 42), (24, 30), (20, 42)])
def test_a_cable_that_a_hand_divides_now_and_then_is_one_object(divided, parts):
    """Whichever of the two parts tracking takes for the whole cable afterwards."""

    def both(time):
        one = seen_in(time, [(0, parts[0])])
        rest = Chain(shape(time)[parts[1] :], SEGMENT, RADIUS)
        return replace(one, detection=replace(one.detection, chains=(*one.detection.chains, rest)))

    plan = [both(time) if k in divided else seen_in(time, [(0, 60)]) for k, time in enumerate(times())]
    (item,) = find_objects(plan, Config())
    assert [anchor.frame for anchor in item.anchors] == [k for k in range(40) if k not in divided]


def test_two_objects_keep_their_ids():
    def both(time):
        first, second = seen_in(time, [(0, 60)]), seen_in(time + 5, [(0, 60)])
        (other,) = second.detection.chains
        other = replace(other, joints=other.joints + np.array([0.0, 0.5, 0.0]))
        strand = replace(second.strands[0], points=second.strands[0].points + np.array([0.0, 0.5, 0.0]), chain=1)
        chains = (*first.detection.chains, other)
        return Observation(replace(first.detection, chains=chains), (*first.strands, strand))

    detections = run([both(time) for time in times(12)])
    assert all({chain.id for chain in detection.chains} == {0, 1} for detection in detections)
    assert all(len(detection.chains) == 1 for detection in run([both(time) for time in times(12)], {"merge.chains": 1}))


def test_without_a_whole_object_frames_keep_their_chains():
    short = seen_in(0.0, [(0, 20)])
    doubtful = replace(short, detection=replace(short.detection, chains=(replace(short.detection.chains[0], confidence=0.25),)))
    detections = run([doubtful] * 4)
    assert [len(detection.chains[0].joints) for detection in detections] == [21] * 4


def test_frames_keep_improbable_chains_where_the_object_is_given():
    short = seen_in(0.0, [(0, 20)])
    low = replace(short, detection=replace(short.detection, chains=(replace(short.detection.chains[0], confidence=0.1),)))
    shown = [run([replace(low, is_given=given)] * 4)[0] for given in (True, False)]
    assert [(len(each.chains), len(each.doubtful)) for each in shown] == [(1, 0), (0, 1)]


@pytest.mark.parametrize(
    ("lengths", "expected"),
    [([1.0, 1.0, 1.0, 0.7, 0.7, 0.7, 0.7, 0.7], 1.0), ([1.4, 1.0, 1.005, 0.995, 0.4], 1.0), ([0.5], 0.5), ([0.5, 0.9], 0.7)],
)
def test_the_length_is_the_longest_that_enough_frames_agree_on(lengths, expected):
    assert vote_length(np.array(lengths), np.zeros(len(lengths))) == pytest.approx(expected, rel=0.006)


def test_the_length_is_that_of_the_frames_that_show_the_whole_object():
    """Frames that fill a third of a chain are a little too long, and more; frames that join strands wrongly are too short."""
    lengths = np.array([1.0, 1.003, 0.998, 1.002] + [1.03] * 10 + [0.75] * 8)
    filled = np.array([0.0] * 4 + [0.33] * 10 + [0.08] * 8)
    assert vote_length(lengths, filled) == pytest.approx(1.0, abs=0.01)


def test_a_chain_up_to_what_hides_the_rest_tells_no_length():
    """Three frames in 60 show both tips; in the others a hand hides one end, always as much of it."""
    plan = [[(0, 60)] if k % 20 == 4 else [(0, 50)] for k in range(60)]
    (item,) = find_objects([seen_in(time, parts) for time, parts in zip(times(60), plan, strict=True)], Config())
    assert item.segments == 60
    assert [anchor.frame for anchor in item.anchors] == [4, 24, 44]


def test_windows_agree_with_the_whole(monkeypatch):
    from doo3d.track import detect_sequence as module

    plan = [[(0, 60)] if k % 20 < 12 else [(0, 40)] for k in range(80)]
    observations = [seen_in(time, parts) for time, parts in zip(times(80), plan, strict=True)]
    whole = run(observations)
    monkeypatch.setattr(module, "WINDOW", 20)
    monkeypatch.setattr(module, "CONTEXT", 25)
    parts = run(observations)
    assert np.abs(errors(whole) - errors(parts)).max() < 1.0


def test_the_time_between_frames():
    assert frame_seconds([seen_in(time, []) for time in (0.0, 0.1, 0.2)]) == pytest.approx(0.1)
    empty = [replace(seen_in(0.0, []), detection=Detection(chains=()))]
    assert frame_seconds(empty) == pytest.approx(1 / 30)


def test_a_sequence_of_clouds():
    rng = np.random.default_rng(0)

    def cloud(time):
        axis = np.repeat(resample(shape(time), np.linspace(0, 0.6, 1200)), 4, axis=0)
        return doo3d.Cloud(axis + rng.normal(0, 1, axis.shape) * 0.0015, segmented=True)

    detections = detect_sequence([cloud(time) for time in times(4)])
    assert [len(detection.chains) for detection in detections] == [1] * 4
    assert len({len(detection.chains[0].joints) for detection in detections}) == 1


@pytest.mark.parametrize(("is_given", "object_given"), [(True, True), (True, False), (False, False)])
def test_an_object_of_which_no_frame_is_sure_is_one_if_it_is_given_itself(is_given, object_given):
    """Where only the number of objects is given, frames keep their own chains; otherwise none."""
    plan = [[(0, 60)]] * 10 + [[(0, 38)]] * 8 + [[(0, 60)]] * 12
    observations = [seen_in(time, parts) for time, parts in zip(times(30), plan, strict=True)]
    for k, observation in enumerate(observations):
        chains = tuple(replace(chain, confidence=0.05) for chain in observation.detection.chains)
        detection = replace(observation.detection, chains=chains)
        observations[k] = replace(observation, detection=detection, is_given=is_given, object_given=object_given)
    detections = run(observations)
    if object_given:
        assert errors(detections).max() < 25
    else:
        chains = [chain for detection in detections for chain in detection.chains]
        assert [(len(chain.joints), chain.id) for chain in chains] == [(p[1] + 1, None) for (p,) in plan if is_given]


@pytest.mark.parametrize("is_given", [True, False])
@pytest.mark.parametrize(("rest", "length"), [([], None), ([(0, 40)], 0.6)])
def test_one_frame_that_shows_an_object_whole_is_enough_if_the_object_was_given(rest, length, is_given):
    plan = [rest] * 4 + [[(0, 60)]] + [rest] * 4
    observations = [seen_in(time, parts) for time, parts in zip(times(9), plan, strict=True)]
    observations = [replace(each, is_given=is_given, object_given=is_given) for each in observations]
    settings = {"sequence.length": length}
    objects = find_objects(observations, load_config("default", settings))
    assert [[anchor.frame for anchor in item.anchors] for item in objects] == ([[4]] if is_given else [])
    shown = {k for k, detection in enumerate(run(observations, settings)) if [chain.id for chain in detection.chains] == [0]}
    assert shown == (set(range(9)) if is_given else set())


@pytest.mark.parametrize("object_given", [True, False])
@pytest.mark.parametrize("count", [None, 1])
@pytest.mark.parametrize("length", [None, 0.6])
def test_where_there_are_no_objects_a_note_names_what_would_help_and_was_not_given(object_given, count, length):
    observations = [replace(seen_in(time, []), object_given=object_given) for time in times(8)]
    (note,) = notes_of(observations, {"merge.chains": count, "sequence.length": length})
    given = {"segment.ranges": object_given, "merge.chains": count, "sequence.length": length}
    assert {name for name in given if name in note} == {name for name, value in given.items() if not value}
    assert ("it helps to give" in note) == (not all(given.values()))
    assert notes_of([], {}) == ()


FAR, NEAR = 3.0, 0.5
"""Depth of a background behind the object, and of what hides it, m."""


def view_of(depth):
    """A camera's view of nothing but a surface at a depth in m."""
    return BackgroundView(np.full((72, 96), 1 / depth, dtype=np.float16), np.array([40.0, 40.0, 47.5, 35.5]))


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize(
    ("parts", "depth", "is_shown"),
    [([], FAR, False), ([(0, 28)], FAR, False), ([(0, 32)], FAR, True), ([(0, 28)], NEAR, True), ([], NEAR, True)],
)
def test_an_object_is_not_shown_where_the_camera_sees_through_more_than_half_of_it(parts, depth, is_shown, moves):
    """Of what the frame does not show of it; where something hides it, it is."""
    observations = [seen_in(0.0, parts if k == 6 else [(0, 60)]) for k in range(12)]
    if moves:
        seen = [seen_by(each, turned(0.02 * (k - 6), 0.02 * k)) for k, each in enumerate(observations)]
        observations = [replace(each, pose=turned(2.0, 1.0) @ each.pose) for each in seen]
    observations[6] = replace(observations[6], background=view_of(depth))
    detections = run(observations)
    assert [len(detection.chains) for detection in detections] == [1] * 6 + [int(is_shown)] + [1] * 5
    notes = [detection.notes for detection in detections]
    assert notes == [()] * 6 + [() if is_shown else (CONTRADICTED_NOTE.format(id=0),)] + [()] * 5


@pytest.mark.parametrize(("speed", "deviation", "is_less"), [(1.0, 0.001, True), (0.0, 0.001, False), (1.0, None, False)])
def test_a_hidden_part_of_large_deviations_makes_a_chain_less_confident(speed, deviation, is_less):
    """Where the object stands still they are small, and without those of the frames' chains they are unknown."""
    plan = [[(0, 60)]] * 10 + [[(0, 30)]] * 10 + [[(0, 60)]] * 10
    observations = [seen_in(speed * time, parts) for time, parts in zip(times(30), plan, strict=True)]
    for k, observation in enumerate(observations if deviation else ()):
        (chain,) = observation.detection.chains
        chain = replace(chain, deviations=np.full((len(chain.joints), 2), deviation))
        observations[k] = replace(observation, detection=replace(observation.detection, chains=(chain,)))
    chains = [detection.chains[0] for detection in run(observations)]
    seen, hidden = chains[5], chains[15]
    assert not seen.occluded.any()
    assert hidden.occluded[35:].all()
    assert seen.confidence > 0.95
    assert (hidden.confidence < 0.5) == is_less


def seen_by(observation, pose):
    """The same observation by a camera at a pose (4, 4), camera to world."""
    inverse = np.linalg.inv(pose)
    strands = (replace(strand, points=strand.points @ inverse[:3, :3].T + inverse[:3, 3]) for strand in observation.strands)
    detection = replace(observation.detection.transformed(inverse), coordinates="camera", pose=None)
    return Observation(detection, tuple(strands), pose)


def turned(angle, x):
    pose = np.eye(4)
    pose[:3, :3] = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    pose[:3, 3] = x, 0.1 * x, 0.0
    return pose


def test_a_camera_that_moves_with_known_poses_follows_the_object_as_one_that_stands():
    """Half of the cable is hidden while the camera swings round it by 30 degrees in a third of a second."""
    plan = [[(0, 60)]] * 10 + [[(0, 30)]] * 10 + [[(0, 60)]] * 10
    still = [seen_in(time, parts) for time, parts in zip(times(30), plan, strict=True)]
    poses = [turned(0.05 * max(0, min(k - 9, 10)), 0.04 * max(0, min(k - 9, 10))) for k in range(30)]
    seen = [seen_by(observation, pose) for observation, pose in zip(still, poses, strict=True)]
    without = [replace(observation, pose=None) for observation in seen]

    def off(observations):
        """The largest distance of a joint from where a camera that stands finds it, m."""
        joints = np.array([detection.chains[0].joints for detection in run(still)])
        found = run(observations)
        assert {detection.coordinates for detection in found} == {"camera"}
        in_world = [detection.transformed(pose).chains[0].joints for detection, pose in zip(found, poses, strict=True)]
        return np.linalg.norm(np.array(in_world) - joints, axis=2).max()

    assert off(seen) < 0.001
    assert off(without) > 0.05


def test_a_frame_that_failed_needs_no_pose():
    poses = [turned(0.05 * k, 0.04 * k) for k in range(12)]
    seen = [seen_by(seen_in(time, [(0, 60)]), pose) for time, pose in zip(times(12), poses, strict=True)]
    whole = run(seen)
    seen[5] = Observation(Detection(chains=()), ())
    found = run(seen)
    for k in (3, 4, 6, 7):
        np.testing.assert_allclose(found[k].chains[0].joints, whole[k].chains[0].joints, atol=1e-3)
    assert in_world(seen)[6].detection.coordinates == "world"
    seen[6] = replace(seen[6], pose=None)
    assert in_world(seen)[7].detection.coordinates == "camera"

"""The samples: the same bytes every time, small, readable, and what the scenes say."""

import json
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders.errors import refuses
from builders.paths import SAMPLES

import doo3d
from doo3d.evaluation import sample_captures as samples
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.metrics.trees import score_trees
from doo3d.evaluation.sample_scenes import HAND_FRAMES, t_piece_scene
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.evaluation.truth_file import read_truth, write_truth

FOLDER = SAMPLES


def _files(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_same_bytes_every_time(tmp_path, monkeypatch):
    monkeypatch.setattr(samples, "CAPTURES", {"crossing": ("crossing", 3, 1)})
    monkeypatch.setattr(samples, "LAID_OUT", {"hand": lambda: samples.hand_scenes()[10:11]})
    monkeypatch.setattr(samples, "CLOUDS", {"open.ply": samples.CLOUDS["open.ply"], "both.npz": samples.CLOUDS["two_cables.npz"]})
    monkeypatch.setattr(samples, "PHOTOS", {"loop": samples.PHOTOS["loop"]})
    written = samples.write_samples(tmp_path / "one")
    samples.write_samples(tmp_path / "two")
    one = _files(tmp_path / "one")
    assert one == _files(tmp_path / "two")
    assert len(one) == 4 + 4 + 4 + 3 + 2 + 4 + 9
    assert all(path.exists() for path in written)


def test_committed_samples_are_complete_and_small():
    files = _files(FOLDER)
    assert sum(len(data) for data in files.values()) < 15e6
    frame_counts = {name: frames for name, (_, _, frames) in samples.CAPTURES.items()} | {"hand": HAND_FRAMES, "t_piece": 1}
    assert set(samples.LAID_OUT) < set(frame_counts)
    for name, frames in frame_counts.items():
        truth = read_truth(FOLDER / name / "truth.json")
        assert list(truth) == [f"{k:06d}" for k in range(frames)]
        values = json.loads(files[f"{name}/camera_intrinsic.json"])
        for frame in truth:
            depth = cv2.imread(str(FOLDER / name / "depth" / f"{frame}.png"), cv2.IMREAD_UNCHANGED)
            color = cv2.imread(str(FOLDER / name / "color" / f"{frame}.jpg"))
            assert depth.dtype == np.uint16
            assert depth.shape == color.shape[:2] == (values["height"], values["width"])
    for name in samples.CLOUDS:
        assert f"clouds/{name}" in files
        assert list(read_truth((FOLDER / "clouds" / name).with_suffix(".truth.json"))) == [Path(name).stem]


@pytest.mark.parametrize("name", samples.PHOTOS)
def test_committed_photographs_have_their_truth(name):
    """Where a cable is seen its axis runs within the mask, and the mask is as large as the cables."""
    color = cv2.imread(str(FOLDER / "photos" / f"{name}.jpg"))
    mask = cv2.imread(str(FOLDER / "photos" / "mask" / f"{name}.png"), cv2.IMREAD_UNCHANGED)
    assert mask.shape == color.shape[:2] == samples.PHOTO_SIZE[::-1]
    assert set(np.unique(mask)) == {0, 255}
    area = 0.0
    for cable in json.loads((FOLDER / "photos" / "axes.json").read_text())["photos"][name]:
        axis, seen = np.array(cable["axis"]), np.array(cable["seen"], dtype=bool)
        u, v = np.rint(axis).astype(int).T
        assert (mask[v, u] > 0)[seen].mean() > 0.98
        area += 2 * cable["radius"] * np.linalg.norm(np.diff(axis, axis=0), axis=1)[seen[1:]].sum()
    assert 0.9 * area < (mask > 0).sum() < 1.1 * area


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in samples.LAID_OUT]


@pytest.mark.parametrize("name", [*samples.CAPTURES, *SLOW])
def test_committed_truth_is_that_of_the_scenes(name):
    truths = list(read_truth(FOLDER / name / "truth.json").values())
    scenes = samples.LAID_OUT[name]() if name in samples.LAID_OUT else [make_scene(*samples.CAPTURES[name][:2])]
    assert len(scenes) == len(truths) or name in samples.CAPTURES
    for scene, cables in zip(scenes, truths, strict=False):
        for cable, truth in zip(scene.cables, cables, strict=True):
            assert truth.radius == pytest.approx(cable.radius, abs=1e-5)
            assert np.abs(truth.axis[:-1] - cable.axis[::2][: len(truth.axis) - 1]).max() < 0.51e-4
            assert truth.seen.any()


def test_the_hand_hides_part_of_a_cable_that_moves_and_keeps_its_length():
    frames = list(read_truth(FOLDER / "hand" / "truth.json").values())
    assert all(len(cables) == 1 for cables in frames)
    (cables,) = zip(*frames, strict=True)
    hidden = np.array([1 - cable.seen.mean() for cable in cables])
    assert hidden[[0, -1]].max() < 0.02
    assert hidden[6:15].min() > 0.1
    lengths = np.array([cable.length for cable in cables])
    assert np.ptp(lengths) < 0.01 * lengths.mean()
    steps = [np.linalg.norm(b.axis[0] - a.axis[0]) for a, b in pairwise(cables)]
    assert min(steps) > 0.008


def test_the_t_piece_has_one_junction_and_the_other_cable_rests_on_it():
    scene = t_piece_scene()
    hose, cable = scene.trees
    assert sorted(hose.degree) == [1, 1, 1, 3]
    assert sorted(cable.degree) == [1, 1]
    apart = [
        np.linalg.norm(strand.axis[:, None] - scene.cables[3].axis[None], axis=2).min() - strand.radius - scene.cables[3].radius
        for strand in scene.cables[:3]
    ]
    assert 0 < min(apart) < 0.001
    read = read_truth(FOLDER / "t_piece" / "truth.json")["000000"]
    ends = np.array([cable.axis[end] for cable in read[:3] for end in (0, -1)])
    assert (np.linalg.norm(ends - hose.nodes[1], axis=1) < 2e-4).sum() == 3


@pytest.mark.slow
def test_the_cable_under_the_hand_is_right_in_every_frame_of_the_sequence():
    config = doo3d.load_config("default", {"segment.ranges": [{"low": [14, 93, 20], "high": [35, 255, 255]}]})
    frames = [entry.load().data for entry in doo3d.open_capture(FOLDER / "hand").frames]
    truths = read_truth(FOLDER / "hand" / "truth.json").values()
    rows = [score(found.chains, truth) for found, truth in zip(doo3d.detect_sequence(frames, config), truths, strict=True)]
    assert [row.correct for row in rows] == [True] * HAND_FRAMES
    assert sum(row.occlusions_correct for row in rows) == sum(row.occlusions for row in rows) > 60


def test_the_t_piece_is_told_from_the_crossing():
    frame = doo3d.open_capture(FOLDER / "t_piece").frames[0].load().data
    found = score_trees(doo3d.detect(frame, doo3d.load_config("harness")), t_piece_scene())
    assert found.correct
    assert (found.right, found.found, found.crossed) == (2, 1, 1)


def test_depth_along_the_true_axis_is_the_cable():
    """The nearest depth round each seen axis point lies a radius in front of it."""
    truth = read_truth(FOLDER / "straight" / "truth.json")["000000"][0]
    matrix = json.loads((FOLDER / "straight" / "camera_intrinsic.json").read_text())["intrinsic_matrix"]
    depth = cv2.imread(str(FOLDER / "straight" / "depth" / "000000.png"), cv2.IMREAD_UNCHANGED) / 1000
    u = np.round(matrix[0] * truth.axis[:, 0] / truth.axis[:, 2] + matrix[6]).astype(int)
    v = np.round(matrix[4] * truth.axis[:, 1] / truth.axis[:, 2] + matrix[7]).astype(int)
    read = depth[v, u]
    gap = (truth.axis[:, 2] - read)[truth.seen & (read > 0)]
    assert np.median(gap) == pytest.approx(truth.radius, abs=0.0006)


def test_truth_files_are_read_back_and_refused_with_a_reason(tmp_path):
    cable = make_scene("open", 0).cables[0]
    write_truth(tmp_path / "truth.json", {"a": (cable,)})
    back = read_truth(tmp_path / "truth.json")["a"][0]
    assert np.allclose(back.axis[[0, -1]], cable.axis[[0, -1]], atol=1e-4)
    assert back.seen.all()
    (tmp_path / "other.json").write_text('{"schema": "x"}')
    with refuses("schema-unknown", "other.json", "doo3d/truth/1"):
        read_truth(tmp_path / "other.json")
    with refuses("file-missing", "none.json"):
        read_truth(tmp_path / "none.json")


@pytest.mark.parametrize("name", [*samples.PAIRS, *samples.RIGS])
def test_committed_rigs_give_their_cable(name):
    (frame,) = doo3d.open_rig(FOLDER / name, FOLDER / name / "rig.yaml")
    loaded = frame.load()
    (chain,) = doo3d.detect(loaded.data, mask=loaded.mask, pose=loaded.base_pose).chains
    family, seed = (samples.PAIRS | samples.RIGS)[name]
    truths = make_scene(family, seed, samples.PHOTO_SIZE).cables
    assert score([chain], truths).coverage > 0.94

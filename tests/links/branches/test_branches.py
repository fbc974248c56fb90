"""Branches against crossings, touches and near ends: by depth, direction and radius; and the trees they make."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from builders.drawn_masks import line
from builders.scenes import empty_scene

from doo3d import Detection, Tracker, detect, load_config
from doo3d.evaluation.metrics.trees import score_trees
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.geometry.equal_segments import equal_segments
from doo3d.links.branches import find_branches
from doo3d.outputs.run_reader import read_detection
from doo3d.types import Chain, ChainEnd

STEP = 0.01
TRUNK = ([-0.15, 0.0, 0.5], [0.15, 0.0, 0.5])


def chain(start, end, radius=0.005, dim=3):
    return Chain(equal_segments(line(start, end)[:, :dim], STEP), STEP, radius)


def found(*chains, dim=3):
    return find_branches(chains, empty_scene(dim, segment_length=STEP, radius=0.005, merge__branches=True))


@pytest.mark.parametrize("dim", [2, 3])
def test_an_end_short_of_a_strand_branches_off_it(dim):
    result = found(chain(*TRUNK, dim=dim), chain([0.02, 0.012, 0.5], [0.06, 0.12, 0.5], 0.003, dim), dim=dim)
    assert [len(each.ends) for each in result.junctions] == [3]
    assert np.linalg.norm(result.junctions[0].position - [0.016, 0.0, 0.5][:dim]) < 0.004
    assert len(result.objects) == 1
    assert len(result.objects[0].chains) == 3
    assert result.objects[0].trunk == 2
    for end in result.junctions[0].ends:
        joint = result.chains[end.chain].joints[-end.end]
        assert np.linalg.norm(joint - result.junctions[0].position) <= STEP / 2 + 1e-9
    assert sorted(np.round(result.junctions[0].radii, 4)) == [0.003, 0.005, 0.005]


def test_two_layers_cross_and_one_layer_branches():
    upper = chain([0.0, -0.12, 0.492], [0.01, 0.12, 0.492], 0.003)
    through = chain([0.0, -0.12, 0.5], [0.01, 0.12, 0.5], 0.003)
    assert not found(chain(*TRUNK), upper).junctions
    result = found(chain(*TRUNK), through)
    assert [len(each.ends) for each in result.junctions] == [4]
    assert len(result.chains) == 4
    assert result.objects[0].trunk == 2


def test_an_end_that_lies_upon_a_strand_or_far_from_it_is_a_tip():
    above = chain([0.0, 0.004, 0.488], [0.0, 0.12, 0.488], 0.004)
    away = chain([0.0, 0.08, 0.5], [0.0, 0.2, 0.5], 0.004)
    aside = chain([0.0, 0.02, 0.5], [0.12, 0.025, 0.5], 0.004)
    for other in (above, away, aside):
        result = found(chain(*TRUNK), other)
        assert not result.junctions
        assert [each.chains for each in result.objects] == [(0,), (1,)]


def test_objects_stay_trees():
    """Of two ends of one strand at the same trunk only one branches off: the other would close a ring."""
    arch = np.column_stack(
        (0.08 * np.cos(np.linspace(0.15, np.pi - 0.15, 300)), 0.08 * np.sin(np.linspace(0.15, np.pi - 0.15, 300)))
    )
    bow = Chain(equal_segments(np.column_stack((arch, np.full(300, 0.5))), STEP), STEP, 0.003)
    result = found(chain(*TRUNK), bow)
    assert len(result.junctions) == 1
    assert len(result.chains) == 3


def test_single_chains_are_returned_as_they_were():
    alone = chain(*TRUNK)
    result = found(alone)
    assert result.chains == [alone]
    assert [(each.chains, each.trunk) for each in result.objects] == [((0,), 1)]
    assert not find_branches([], empty_scene()).objects


@pytest.mark.parametrize(("family", "seed"), [("tree_crossing", 0), ("tree_opposite", 1), ("tree_hanging", 0)])
def test_rendered_harness(family, seed):
    scene = make_scene(family, seed, (640, 360))
    detection = detect(render(scene).frame, load_config("harness"))
    score = score_trees(detection, scene)
    assert (score.right, score.false, score.taken) == (score.objects, 0, 0)


def test_shell_writes_junctions_only_when_asked(doo3d, tmp_path):
    mask = np.zeros((240, 320), np.uint8)
    cv2.line(mask, (20, 120), (300, 110), 255, 16)
    cv2.line(mask, (150, 120), (190, 30), 255, 7)
    cv2.imwrite(str(tmp_path / "y.png"), np.dstack([mask] * 3))
    (tmp_path / "masks").mkdir()
    cv2.imwrite(str(tmp_path / "masks" / "y.png"), mask)
    common = ["detect", str(tmp_path / "y.png"), "-c", "image", "--mask", str(tmp_path / "masks" / "y.png")]
    assert doo3d(*common, "-o", tmp_path / "off")[0] == 0
    assert not {"junctions", "objects"} & json.loads((tmp_path / "off" / "y.json").read_text()).keys()
    assert doo3d(*common, "--set", "merge.branches=true", "-o", tmp_path / "on")[0] == 0
    detection = read_detection(tmp_path / "on" / "y.json")
    assert len(detection.junctions) == 1
    assert all(isinstance(end, ChainEnd) for end in detection.junctions[0].ends)
    assert np.linalg.norm(detection.junctions[0].position - (151, 115)) < 10
    assert [len(each.chains) for each in detection.objects] == [3]


def test_branches_joined_through_a_trunk_leave_it_one_by_one():
    """A chain that comes in from one side, runs inside the trunk and leaves on the other side is two branches."""
    corners = np.array([[-0.06, 0.1, 0.5], [-0.04, 0.0, 0.5], [0.04, 0.0, 0.5], [0.06, -0.1, 0.5]])
    path = np.concatenate([line(a, b) for a, b in itertools.pairwise(corners)])
    through = Chain(equal_segments(path[np.concatenate(([True], np.diff(path, axis=0).any(axis=1)))], STEP), STEP, 0.003)
    result = found(chain(*TRUNK), through)
    assert [len(each.ends) for each in result.junctions] == [3, 3]
    at = sorted(float(each.position[0]) for each in result.junctions)
    assert np.allclose(at, (-0.04, 0.04), atol=0.008)
    assert [len(each.chains) for each in result.objects] == [5]


def test_the_shell_evaluates_trees(doo3d, tmp_path):
    code, out, _ = doo3d(
        "evaluate", "trees", "--families", "tree", "--seeds", 1, "--size", "640x360", "--json", tmp_path / "trees.json"
    )
    assert code == 0
    assert "1/1" in out
    assert json.loads((tmp_path / "trees.json").read_text())["summary"]["all"]["objects_correct"] == 1
    code, _, err = doo3d("evaluate", "trees", "-c", "default")
    assert code != 0
    assert "merge.branches" in err


def test_junctions_follow_chains_that_tracking_reverses():
    result = found(chain(*TRUNK), chain([0.02, 0.012, 0.5], [0.06, 0.12, 0.5], 0.003))
    first = Detection(tuple(result.chains), junctions=result.junctions, objects=result.objects)
    turned = replace(
        first,
        chains=(*first.chains[:-1], replace(first.chains[-1], joints=first.chains[-1].joints[::-1])),
        junctions=(replace(first.junctions[0], ends=tuple(
            ChainEnd(end.chain, 1 - end.end if end.chain == 2 else end.end) for end in first.junctions[0].ends
        )),),
    )  # fmt: skip
    tracker = Tracker()
    tracker.update(first)
    after = tracker.update(turned)
    assert after.junctions[0].ends == first.junctions[0].ends
    for end in after.junctions[0].ends:
        assert np.linalg.norm(after.chains[end.chain].joints[-end.end] - after.junctions[0].position) <= STEP / 2 + 1e-9


@pytest.mark.parametrize("angle", [0, 30, 75])
@pytest.mark.parametrize("tip", ["round", "into the trunk"])
def test_a_tip_that_touches_is_narrower_there_than_a_branch(tip, angle):
    """A strand 13 px wide that leads up to one of 20 px, in an image turned by `angle` degrees."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    turn = np.array([[c, -s], [s, c]])
    mask = np.zeros((400, 400), np.uint8)
    reach = 0 if tip == "into the trunk" else 16
    points = np.array([[-170.0, 0.0], [170.0, 0.0], [20.0, -reach], [50.0, -150.0]]) @ turn.T + 200
    corners = [tuple(round(16 * value) for value in point) for point in points]
    cv2.line(mask, corners[0], corners[1], 1, 17, shift=4)
    cv2.line(mask, corners[2], corners[3], 1, 11, shift=4)
    image = np.dstack([mask * 255] * 3)
    detection = detect(image, load_config("image", {"merge.branches": True}), mask.astype(bool))
    assert len(detection.junctions) == (1 if tip == "into the trunk" else 0)
    assert len(detection.objects) == (1 if tip == "into the trunk" else 2)

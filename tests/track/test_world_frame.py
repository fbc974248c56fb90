"""Sequences before a camera that moves, rendered with truth: with its poses and without; from Python and from the shell."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import doo3d as package
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.sequences.moving_views import moving_view, table
from doo3d.outputs.run_reader import open_results
from doo3d.track.detect_sequence import detect_sequence

pytestmark = pytest.mark.slow
CONFIG = package.load_config("default", {"merge.chains": 1})
FRAMES = 8


@functools.cache
def rendered(speed=1.0):
    view = moving_view("dragged", 1, FRAMES, "easy", speed)
    return view, [view.frame(k) for k in range(FRAMES)]


@functools.cache
def found(speed=1.0, posed=False):
    view, frames = rendered(speed)
    return detect_sequence([each.frame for each in frames], CONFIG, [each.mask for each in frames], view.poses if posed else None)


def joints(detections):
    return np.array([detection.chains[0].joints for detection in detections])


@pytest.mark.parametrize("posed", [False, True])
def test_the_object_is_right_with_the_poses_and_without(posed):
    detections = found(posed=posed)
    assert all(score(each.chains, frame.truths).correct for each, frame in zip(detections, rendered()[1], strict=True))
    assert {each.coordinates for each in detections} == {"camera"}


def test_a_camera_that_stands_still_changes_nothing():
    np.testing.assert_array_equal(joints(found(0.0)), joints(found(0.0, posed=True)))


@pytest.mark.parametrize("workers", [1, 2])
def test_from_the_shell(doo3d, tmp_path, workers):
    _, frames = rendered()
    camera = frames[0].frame.camera
    np.savez(
        tmp_path / "moving.npz",
        color=np.stack([each.frame.color for each in frames]),
        depth=np.stack([each.frame.depth for each in frames]),
        mask=np.stack([each.mask for each in frames]),
        K=np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]),
    )
    options = ("--set", "merge.chains=1", "--workers", str(workers))
    code, _, _ = doo3d("detect", tmp_path / "moving.npz", "-o", tmp_path / "out", "--sequence", *options)
    assert code == 0
    assert np.abs(joints(list(open_results(tmp_path / "out").detections())) - joints(found())).max() < 1e-9


def test_the_table():
    lines = list(table(seeds=1, frames=6))
    assert lines[0].startswith("| camera | frames | correct |")
    assert [line.split(" | ")[0] for line in lines[2:]] == ["| each frame alone", "| poses given", "| no poses"]
    assert [line.split(" | ")[1] for line in lines[2:]] == ["12"] * 3

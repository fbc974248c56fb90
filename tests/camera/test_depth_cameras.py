"""Captures of several depth cameras: the views of each time are put together, so that one camera sees past what hides another."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from builders.errors import refuses
from builders.pairs import write_image

import doo3d
from doo3d.evaluation.benchmark.fused_views import circle_views, with_block
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.sample_captures import DEPTH_SCALE, write_intrinsics
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.outputs.run_reader import open_results
from doo3d.types.pose import as_pose

NAMES = ("front", "back")


@pytest.fixture(scope="module")
def scene():
    return with_block(make_scene("open", 1, (320, 240)))


@pytest.fixture(scope="module")
def views(scene):
    return circle_views(scene, len(NAMES), 25.0)


def written(folder: Path, views, frames: int = 1, hidden: str = "") -> Path:
    """Write the captures and the rig file; of the camera `hidden` the object is hidden."""
    cameras = []
    for name, view in zip(NAMES, views, strict=True):
        frame, mask = view.rendered.frame, view.rendered.mask & (name != hidden)
        for k in range(frames):
            write_image(folder / name / "color" / f"{k:06d}.png", np.asarray(frame.color))
            write_image(folder / name / "mask" / f"{k:06d}.png", mask)
            (folder / name / "depth").mkdir(parents=True, exist_ok=True)
            depth = np.round(frame.depth * DEPTH_SCALE).astype(np.uint16)
            assert cv2.imwrite(str(folder / name / "depth" / f"{k:06d}.png"), depth)
        write_intrinsics(folder / name / "camera_intrinsic.json", frame.camera)
        cameras.append({"name": name, "capture": name, "pose": view.pose.tolist()})
    path = folder / "rig.yaml"
    path.write_text(yaml.safe_dump({"cameras": cameras}))
    return path


def test_cameras_without_a_pose_or_a_capture_are_refused(tmp_path, views):
    path = written(tmp_path, views)
    for key in ("pose", "capture"):
        values = yaml.safe_load(path.read_text())
        del values["cameras"][1][key]
        (tmp_path / "broken.yaml").write_text(yaml.safe_dump(values))
        with refuses("rig-invalid", "broken.yaml", "back", key):
            doo3d.open_rig(tmp_path, tmp_path / "broken.yaml")


def test_captures_of_different_lengths_without_common_names_are_refused(tmp_path, views):
    path = written(tmp_path, views, frames=2)
    for part in ("color", "depth", "mask"):
        (tmp_path / "back" / part / "000001.png").unlink()
        (tmp_path / "back" / part / "000000.png").rename(tmp_path / "back" / part / "000009.png")
    with refuses("frame-count", "front has 2, back has 1"):
        doo3d.open_rig(tmp_path, path)


def test_captures_whose_names_agree_for_some_frames_only_are_refused(tmp_path, views):
    path = written(tmp_path, views, frames=2)
    for part in ("color", "depth", "mask"):
        (tmp_path / "back" / part / "000000.png").rename(tmp_path / "back" / part / "000009.png")
    with refuses("frame-count", "1 names of frames in common", "belong together"):
        doo3d.open_rig(tmp_path, path)


def test_captures_of_other_names_are_paired_by_order_with_a_note(tmp_path, views):
    path = written(tmp_path, views)
    for part in ("color", "depth", "mask"):
        (tmp_path / "back" / part / "000000.png").rename(tmp_path / "back" / part / "000009.png")
    assert "front and back have no times" in " ".join(doo3d.open_rig(tmp_path, path).notes)


def test_a_pose_that_is_no_rigid_motion_is_refused_with_the_name_of_its_camera(tmp_path, views):
    path = written(tmp_path, views)
    rig = yaml.safe_load(path.read_text())
    for wrong in (float("nan"), 3.0):
        rig["cameras"][1]["pose"] = [0, 0, 0, 0, 0, 0, wrong]
        path.write_text(yaml.safe_dump(rig))
        with refuses("pose-invalid", path.name, "the camera back"):
            doo3d.open_rig(tmp_path, path)


def test_a_capture_without_depth_is_refused(tmp_path, views):
    path = written(tmp_path, views)
    for file in (tmp_path / "back" / "depth").iterdir():
        file.unlink()
    (tmp_path / "back" / "depth").rmdir()
    (tmp_path / "back" / "camera_intrinsic.json").unlink()
    with refuses("rig-invalid", "back", "no depth"):
        doo3d.open_rig(tmp_path, path)


def test_frames_too_far_apart_in_time_are_refused(tmp_path, views):
    path = written(tmp_path, views)
    for k, name in enumerate(NAMES):
        folder = tmp_path / name
        (folder / "depth.txt").write_text(f"{k}.0 depth/000000.png\n")
        (folder / "rgb.txt").write_text(f"{k}.0 color/000000.png\n")
    with refuses("times-apart", "front and back", "tolerance"):
        doo3d.open_rig(tmp_path, path)


def test_the_chain_is_found_from_all_views_in_the_coordinates_of_the_rig(tmp_path, views, scene):
    capture = doo3d.open_rig(tmp_path, written(tmp_path, views))
    (frame,) = capture
    loaded = frame.load()
    detection = doo3d.detect(loaded.data, mask=loaded.mask, pose=loaded.base_pose)
    assert detection.coordinates == "world"
    assert score(detection.chains, scene.cables).correct


@pytest.mark.parametrize("hidden", NAMES)
def test_a_camera_from_which_the_object_is_hidden_does_no_harm(tmp_path, views, scene, hidden):
    (frame,) = doo3d.open_rig(tmp_path, written(tmp_path, views, hidden=hidden))
    loaded = frame.load()
    detection = doo3d.detect(loaded.data, mask=loaded.mask, pose=loaded.base_pose)
    shown = views[1 - NAMES.index(hidden)].rendered
    alone = doo3d.detect(shown.frame, mask=shown.mask)
    assert len(detection.chains) == len(alone.chains)
    assert detection.chains[0].length == pytest.approx(alone.chains[0].length, rel=0.1)


def test_detect_runs_on_a_rig_and_refuses_to_fuse_it_again(doo3d, tmp_path, views):
    path = written(tmp_path / "rig", views, frames=2)
    code, out, errors = doo3d("detect", tmp_path / "rig", "--cameras", path, "-o", tmp_path / "out")
    assert code == 0, errors
    assert "2 frames, 2 chains" in out
    code, _, errors = doo3d("detect", tmp_path / "rig", "--cameras", path, "-o", tmp_path / "out", "--fuse-views")
    assert code == 2
    assert "options-conflict" in errors


@pytest.mark.parametrize("base", [(), ("--pose", "0.1,0.2,0.3,0,0,0.6,0.8")])
def test_frames_of_a_rig_are_a_sequence(doo3d, tmp_path, views, scene, base):
    """The middle frames are seen by one camera, the others by both; all chains are in the frame of the rig, or of the robot."""
    path = written(tmp_path / "rig", views, frames=7)
    for k in (2, 3, 4):
        write_image(tmp_path / "rig" / "front" / "mask" / f"{k:06d}.png", np.zeros((240, 320), dtype=bool))
    given = ("detect", tmp_path / "rig", "--cameras", path, "-o", tmp_path / "out", "--sequence", *base)
    code, _, errors = doo3d(*given)
    assert code == 0, errors
    detections = list(open_results(tmp_path / "out").detections())
    chains = [detection.chains[0] for detection in detections]
    assert {chain.id for chain in chains} == {0}
    assert len({len(chain.joints) for chain in chains}) == 1
    joints = np.array([chain.joints for chain in chains])
    assert np.linalg.norm(joints - joints[0], axis=2).max() < 0.01
    to_rig = np.linalg.inv(as_pose([0.1, 0.2, 0.3, 0, 0, 0.6, 0.8])) if base else np.eye(4)
    for detection in detections:
        assert score(detection.transformed(to_rig).chains, scene.cables).correct

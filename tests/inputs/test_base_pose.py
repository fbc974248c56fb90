"""Results in a robot's base frame: the camera's pose by option, by a file beside the images, or by the tf of a bag."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from builders.bags import SECOND, BagScript
from builders.captures import HEIGHT, MATRIX, WIDTH, rope
from builders.errors import code_in, refuses
from scipy.spatial.transform import Rotation

import doo3d as library
from doo3d.inputs import ReadOptions, open_capture
from doo3d.inputs.support.pose_file import read_pose
from doo3d.outputs.run_reader import open_results, read_detection

POSE = np.array([[1.0, 0, 0, 0.4], [0, -1, 0, 0], [0, 0, -1, 0.56], [0, 0, 0, 1]])  # looking down on a table at z = 0
TEXT = "0.4,0,0.56,1,0,0,0"
NEAR_M = 0.003


def moved(points: np.ndarray, pose: np.ndarray = POSE) -> np.ndarray:
    return points @ pose[:3, :3].T + pose[:3, 3]


def joints(out: Path | str) -> list[np.ndarray]:
    return [chain.joints for item in open_results(out).detections() for chain in item.chains]


# --- broken and unusual poses first ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pose", "part"),
    [
        ("nowhere.yaml", "nowhere.yaml"),
        ("1,2,3", "3 numbers"),
        ("0,0,0,0,0,0,2", "length 2"),
        ("tf:base_link", "no bag"),
        ("capture", "no camera pose"),
    ],
)
def test_a_pose_that_cannot_be_used_is_one_sentence(doo3d, capture, tmp_path, pose, part):
    status, _, err = doo3d("detect", capture(), "-o", "out", "--pose", pose)
    assert status == 2
    assert code_in(err) in ("pose-invalid", "file-missing", "pose-missing")
    assert part in err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("pose.yaml", "pose: {position: [0, 0, 1]}"),
        ("pose.yaml", "pose: [1, 2, [3"),
        ("pose.yaml", "a: &a [*a]"),
        ("pose.json", "[" * 5000),
        ("pose.json", '{"fx": 1}'),
        ("pose.json", '{"position": {"x": 0, "y": 0}, "orientation": [0, 0, 0, 1]}'),
        ("pose.yaml", ""),
    ],
)
def test_a_broken_file_beside_the_images_is_named(doo3d, capture, name, text):
    folder = capture()
    (folder / name).write_text(text)
    status, _, err = doo3d("detect", folder, "-o", "out")
    assert (status, code_in(err)) == (2, "pose-invalid")
    assert name in err


def test_a_pose_moves_no_pixels(doo3d, capture):
    status, _, err = doo3d("detect", capture(), "-o", "out", "--pose", TEXT, "-c", "image")
    assert (status, code_in(err)) == (2, "options-conflict")
    with refuses("results-2d"):
        library.detect(np.zeros((60, 60, 3), np.uint8), library.load_config("image"), np.eye(60, dtype=bool), pose=POSE)


def test_one_pose_does_not_fuse_views(doo3d, capture):
    status, _, err = doo3d("detect", capture(), "-o", "out", "--pose", TEXT, "--fuse-views")
    assert (status, code_in(err)) == (2, "options-conflict")


# --- forms of one pose ----------------------------------------------------------------------------------------------------

QUATERNION = Rotation.from_matrix(POSE[:3, :3]).as_quat().tolist()
FORMS = {
    "a.yaml": {"pose": POSE.tolist()},
    "b.json": POSE.tolist(),
    "c.yaml": [0.4, 0, 0.56, *QUATERNION],
    "ros.yaml": {"pose": {"position": dict(zip("xyz", POSE[:3, 3].tolist(), strict=True)), "orientation": QUATERNION}},
    "easy_handeye.yaml": {
        "parameters": {"eye_on_hand": False},
        "transformation": dict(zip(("x", "y", "z", "qx", "qy", "qz", "qw"), [0.4, 0, 0.56, *QUATERNION], strict=True)),
    },
    "tf.yaml": {
        "transforms": [
            {
                "header": {"frame_id": "base_link"},
                "child_frame_id": "camera_optical",
                "transform": {
                    "translation": dict(zip("xyz", POSE[:3, 3].tolist(), strict=True)),
                    "rotation": dict(zip("xyzw", QUATERNION, strict=True)),
                },
            }
        ]
    },
    "opencv.json": {"R": POSE[:3, :3].tolist(), "t": [[0.4], [0], [0.56]]},
}


@pytest.mark.parametrize("name", FORMS)
def test_forms_of_one_pose(tmp_path, name):
    (tmp_path / name).write_text(json.dumps(FORMS[name]))  # JSON is YAML
    np.testing.assert_allclose(read_pose(tmp_path / name), POSE, atol=1e-12)


# --- results --------------------------------------------------------------------------------------------------------------


def test_results_report_and_exports_are_in_the_base_frame(doo3d, capture, tmp_path):
    folder = capture(frames=2, mask=True)
    assert doo3d("detect", folder, "-o", "camera")[0] == 0
    assert doo3d("detect", folder, "-o", "base", "--pose", TEXT)[0] == 0
    for own, base in zip(joints("camera"), joints("base"), strict=True):
        np.testing.assert_allclose(base, moved(own), atol=1e-12)
    own, base = (read_detection(tmp_path / out / "000000.json") for out in ("camera", "base"))
    assert (base.coordinates, own.pose) == ("world", None)
    np.testing.assert_allclose(base.pose, POSE, atol=1e-12)
    np.testing.assert_allclose(own.plane.normal, (0, 0, -1), atol=0.01)
    assert own.plane.height == pytest.approx(-0.56, abs=NEAR_M)
    np.testing.assert_allclose(base.plane.normal, (0, 0, 1), atol=0.01)
    assert base.plane.height == pytest.approx(0, abs=NEAR_M)
    np.testing.assert_allclose(base.in_camera().chains[0].joints, own.chains[0].joints, atol=1e-12)
    assert (tmp_path / "camera" / "000000.jpg").read_bytes() == (tmp_path / "base" / "000000.jpg").read_bytes()
    manifest = json.loads((tmp_path / "base" / "manifest.json").read_text())
    assert manifest["input"]["pose"] == POSE.tolist()
    assert doo3d("export", "base", "--to", "npz")[0] == 0
    np.testing.assert_allclose(np.load("base.npz")["joints"], np.concatenate(joints("base")))
    assert doo3d("export", "base", "--to", "npz", "--pose", TEXT, "-o", "again.npz")[0] == 0
    np.testing.assert_allclose(np.load("again.npz")["joints"], np.load("base.npz")["joints"], atol=1e-12)
    assert doo3d("report", "base")[0] == 0


def test_a_file_beside_the_images_is_a_pose(doo3d, capture, tmp_path):
    folder = capture()
    assert doo3d("detect", folder, "-o", "camera")[0] == 0
    (folder / "pose.yaml").write_text(json.dumps(FORMS["ros.yaml"]))
    assert doo3d("detect", folder, "-o", "base")[0] == 0
    np.testing.assert_allclose(joints("base")[0], moved(joints("camera")[0]), atol=1e-12)
    (folder / "pose.yaml").write_text("[0, 0, 0, 0, 0, 0, 1]")
    assert doo3d("detect", folder, "-o", "base")[0] == 2  # the pose is part of the input
    assert doo3d("detect", folder, "-o", "image", "-c", "image")[0] == 0


def test_the_poses_of_the_capture(doo3d, tmp_path):
    picture, depth, _ = rope()
    np.savez(tmp_path / "a.npz", depth=depth, color=picture, K=np.reshape(MATRIX, (3, 3)).T, pose=POSE)
    assert doo3d("detect", "a.npz", "-o", "camera")[0] == 0
    assert doo3d("detect", "a.npz", "-o", "base", "--pose", "capture")[0] == 0
    np.testing.assert_allclose(joints("base")[0], moved(joints("camera")[0]), atol=1e-12)


def bag(path: Path) -> Path:
    made = BagScript("mcap")
    numbers = (MATRIX[0], MATRIX[4], MATRIX[6], MATRIX[7])
    made.info("/camera/depth/camera_info", (WIDTH, HEIGHT), numbers, frame="camera_optical")
    made.image("/camera/depth/image_raw", SECOND, rope()[1], "16UC1", frame="camera_optical")
    made.tf("base_link", "camera_link", (0.4, 0, 0.56), static=True)
    made.tf("camera_link", "camera_optical", (0, 0, 0), (1, 0, 0, 0), static=True)
    return made.write(path)


def test_the_tf_of_a_bag_by_the_name_of_a_frame(doo3d, tmp_path):
    pytest.importorskip("rosbags")
    path = bag(tmp_path / "bag")
    assert doo3d("detect", path, "-o", "camera")[0] == 0
    assert doo3d("detect", path, "-o", "base", "--pose", "tf:base_link")[0] == 0
    np.testing.assert_allclose(joints("base")[0], moved(joints("camera")[0]), atol=1e-9)
    status, _, err = doo3d("detect", path, "-o", "other", "--pose", "tf:base")
    assert (status, code_in(err)) == (2, "pose-missing")
    assert "base_link, camera_link, camera_optical" in err


def test_python_takes_the_pose_and_draws(capture):
    frame = open_capture(capture()).frames[0].load().data
    own, base = library.detect(frame), library.detect(frame, pose=POSE)
    np.testing.assert_allclose(base.chains[0].joints, moved(own.chains[0].joints), atol=1e-12)
    given = ReadOptions(pose=POSE)
    assert given.model_dump(mode="json")["pose"] == POSE.tolist()
    with refuses("pose-invalid"):
        library.detect(frame, pose=np.eye(3))


# --- the supporting plane -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["plane", "mask", "hsv"])
def test_the_plane_whatever_the_method(capture, method):
    loaded = open_capture(capture(mask=True)).frames[0].load()
    ranges = [{"low": [0, 100, 100], "high": [10, 255, 255]}]
    config = library.load_config("default", {"segment.method": method, "segment.ranges": ranges if method == "hsv" else []})
    plane = library.detect(loaded.data, config, loaded.mask if method == "mask" else None).plane
    np.testing.assert_allclose(plane.normal, (0, 0, -1), atol=0.01)
    assert plane.height == pytest.approx(-0.56, abs=NEAR_M)


def test_no_plane_where_everything_is_the_object_or_nothing_is_around_it(capture):
    loaded = open_capture(capture(mask=True)).frames[0].load()
    alone = library.Frame(None, np.where(loaded.mask, loaded.data.depth, 0).astype(np.float32), loaded.data.camera)
    assert library.detect(alone).plane is None
    assert library.detect(alone, mask=loaded.mask).plane is None
    rng = np.random.default_rng(0)
    clutter = np.where(loaded.mask, loaded.data.depth, rng.uniform(0.5, 0.9, loaded.mask.shape)).astype(np.float32)
    assert library.detect(library.Frame(None, clutter, loaded.data.camera), mask=loaded.mask).plane is None

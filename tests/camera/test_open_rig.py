"""Captures of rigs: the images of a stereo pair and the captures of several depth cameras, opened, refused and run."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from builders.errors import refuses
from builders.pairs import BASELINE, CAMERA, drawn_pair, wave, write_image

import doo3d
from doo3d.inputs import ReadOptions

PINHOLE = [CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy]
LEFT = {"name": "left", "images": "left", "intrinsics": PINHOLE, "pose": [0, 0, 0, 0, 0, 0, 1]}
RIGHT = {"name": "right", "images": "right", "intrinsics": PINHOLE, "pose": [BASELINE, 0, 0, 0, 0, 0, 1]}
HALVES = [{**each, "images": None, "side_by_side": each["name"]} for each in (LEFT, RIGHT)]


def rig_file(folder: Path, **values: object) -> Path:
    path = folder / "rig.yaml"
    path.write_text(yaml.safe_dump({"cameras": [LEFT, RIGHT]} | values))
    return path


@pytest.fixture(scope="module")
def images():
    return drawn_pair([wave(rise=0.05)])


@pytest.fixture
def folders(tmp_path, images):
    """Two frames in left/ and right/, with masks in mask/left and mask/right of the left camera's names."""
    for name in ("000000", "000001"):
        for side in ("left", "right"):
            write_image(tmp_path / "pairs" / side / f"{name}.png", getattr(images, side))
            write_image(tmp_path / "masks" / side / f"{name}.png", getattr(images, f"{side}_mask"))
    return tmp_path / "pairs"


@pytest.fixture
def halves(tmp_path, images):
    """One frame with both images side by side, and masks of either beside it."""
    folder = tmp_path / "pairs"
    write_image(folder / "img_07.png", np.hstack([images.left, images.right]))
    for side in ("left", "right"):
        write_image(folder / f"img_07_{side}_mask_0.png", getattr(images, f"{side}_mask"))
    return folder


@pytest.mark.parametrize(
    ("values", "code", "part"),
    [
        ({"cameras": [LEFT]}, "rig-invalid", "1 camera,"),
        ({"cameras": [LEFT, LEFT]}, "rig-invalid", "same name"),
        ({"cameras": [LEFT, {key: RIGHT[key] for key in ("name", "images", "pose")}]}, "rig-invalid", "intrinsics"),
        ({"cameras": [LEFT, {key: RIGHT[key] for key in ("name", "images", "intrinsics")}]}, "rig-invalid", "pose"),
        ({"cameras": [LEFT, RIGHT | {"lens": 1}]}, "key-unknown", "cameras.1.lens"),
        ({"cameras": [LEFT, RIGHT | {"intrinsics": [600, 600]}]}, "value-invalid", "cameras.1.intrinsics"),
        ({"cameras": [LEFT, RIGHT | {"intrinsics": [float("nan"), 600, 240, 160]}]}, "value-invalid", "cameras.1.intrinsics.0"),
        ({"cameras": [LEFT, RIGHT | {"pose": [1, 2, 3]}]}, "pose-invalid", "the camera right"),
        ({"cameras": [LEFT, RIGHT | {"pose": LEFT["pose"]}]}, "baseline-invalid", "0 mm"),
        ({"cameras": [LEFT, RIGHT | {"size": [640, 480]}]}, "intrinsics-size", "480x320"),
        ({"cameras": [LEFT, RIGHT], "unit": "inch"}, "value-invalid", "unit"),
        ({"cameras": [LEFT, {"name": "right", "capture": "right"}]}, "rig-invalid", "capture"),
        ({"calibration": "gone.yml"}, "file-missing", "gone.yml"),
    ],
)
def test_a_broken_rig_file_is_refused_with_its_name(folders, tmp_path, values, code, part):
    path = rig_file(tmp_path, **values)
    with refuses(code, part):
        doo3d.open_rig(folders, path)


def test_files_that_do_not_exist_are_named(folders, tmp_path):
    with refuses("file-missing", "none.yaml"):
        doo3d.open_rig(folders, tmp_path / "none.yaml")
    with refuses("file-missing", "nowhere"):
        doo3d.open_rig(tmp_path / "nowhere", rig_file(tmp_path))


def test_cameras_with_different_numbers_of_images_are_refused(folders, tmp_path):
    (folders / "right" / "000001.png").unlink()
    with refuses("frame-count", "2 images", "right 1", "000001"):
        doo3d.open_rig(folders, rig_file(tmp_path))


def test_images_whose_names_have_nothing_in_common_are_paired_by_order_or_refused(folders, tmp_path):
    for name, other in (("000000", "a"), ("000001", "b")):
        (folders / "right" / f"{name}.png").rename(folders / "right" / f"{other}.png")
    assert len(doo3d.open_rig(folders, rig_file(tmp_path))) == 2
    (folders / "right" / "b.png").unlink()
    with refuses("frame-count", "names"):
        doo3d.open_rig(folders, rig_file(tmp_path))


def test_options_without_a_meaning_for_a_pair_are_refused(folders, tmp_path):
    with refuses("option-unused", "depth_scale"):
        doo3d.open_rig(folders, rig_file(tmp_path, cameras=[LEFT, RIGHT]), options=ReadOptions(depth_scale=1000))


def test_a_recording_in_place_of_images_is_refused(tmp_path):
    (tmp_path / "capture.svo").write_bytes(b"SVO")
    with refuses("format-unknown", "capture.svo", "export the images"):
        doo3d.open_rig(tmp_path / "capture.svo", rig_file(tmp_path, cameras=[LEFT, RIGHT]))


def test_a_config_for_images_is_refused(folders, tmp_path):
    with refuses("config-mode", "-c default"):
        doo3d.open_rig(folders, rig_file(tmp_path), "image")


def test_masks_that_belong_to_no_frame_are_refused(folders, tmp_path):
    (tmp_path / "empty").mkdir()
    with refuses("mask-missing", "empty"):
        doo3d.open_rig(folders, rig_file(tmp_path), masks=tmp_path / "empty")


def test_the_pair_is_read_from_two_folders_with_masks_in_two_others(folders, tmp_path):
    capture = doo3d.open_rig(folders, rig_file(tmp_path), masks=tmp_path / "masks")
    assert [frame.name for frame in capture] == ["000000", "000001"]
    assert any("100 mm" in note for note in capture.notes)
    assert any("2 of the camera left, 2 of the camera right" in note for note in capture.notes)
    loaded = capture[0].load()
    (chain,) = doo3d.detect(loaded.data, mask=loaded.mask).chains
    assert chain.length == pytest.approx(np.linalg.norm(np.diff(wave(rise=0.05), axis=0), axis=1).sum(), rel=0.05)


def test_the_pair_is_read_side_by_side_with_its_masks_beside_it(halves, tmp_path, images):
    for path in (halves, halves / "img_07.png"):
        capture = doo3d.open_rig(path, rig_file(tmp_path, cameras=HALVES))
        (frame,) = capture
        assert frame.name == "img_07"
        assert any("1 of the camera left, 1 of the camera right" in note for note in capture.notes)
        assert frame.load().mask.sum() == pytest.approx(images.left_mask.sum(), rel=0.05)


def test_an_image_that_is_not_two_side_by_side_fails_alone(halves, tmp_path, images):
    write_image(halves / "img_08.png", np.hstack([images.left, images.right[:, 1:]]))
    capture = doo3d.open_rig(halves, rig_file(tmp_path, cameras=HALVES))
    assert capture["img_07"].load().mask.any()
    with refuses("image-shape", "img_08", "side by side"):
        capture["img_08"].load()


def test_the_pose_of_the_left_camera_moves_results_to_the_rig(folders, tmp_path):
    turned = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]  # half a turn about x, 1 m above
    other = [BASELINE, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    path = rig_file(tmp_path, cameras=[LEFT | {"pose": turned}, RIGHT | {"pose": other}])
    loaded = doo3d.open_rig(folders, path, masks=tmp_path / "masks")[0].load()
    detection = doo3d.detect(loaded.data, mask=loaded.mask, pose=loaded.base_pose)
    assert detection.chains[0].joints[:, 2].mean() == pytest.approx(1 - 0.675, abs=0.01)


def test_a_plain_capture_is_not_read_with_the_cameras_of_a_rig(folders, tmp_path):
    options = ReadOptions(cameras=rig_file(tmp_path))
    with refuses("option-unused", "--cameras"):
        doo3d.open_capture(folders / "left", options=options)


def test_detect_writes_results_of_a_pair_and_says_how_far_the_cameras_are_apart(doo3d, folders, tmp_path):
    path = rig_file(tmp_path)
    code, out, errors = doo3d("detect", folders, "--cameras", path, "--mask", tmp_path / "masks", "-o", tmp_path / "out")
    assert code == 0, errors
    assert "2 frames, 2 chains" in out
    assert "100 mm apart" in errors
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["input"]["reading"]["cameras"] == str(path)
    assert (tmp_path / "out" / "000000.jpg").is_file()
    code, out, _ = doo3d("explain", folders, "--cameras", path, "--mask", tmp_path / "masks", "--frame", "1")
    assert code == 0
    assert out.startswith("frame 000001")


def test_frames_of_a_pair_are_a_sequence(doo3d, folders, tmp_path):
    given = ("detect", folders, "--cameras", rig_file(tmp_path), "--mask", tmp_path / "masks", "-o", tmp_path / "out")
    code, out, errors = doo3d(*given, "--sequence")
    assert code == 0, errors
    assert "2 frames, 2 chains" in out
    assert "second pass of 2 frames" in errors

"""Single depth images with their camera in a YAML file or in the options."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import yaml
from builders.errors import refused, refuses
from builders.sample_scene import POSE, assert_detected, check, put, scene, units

from doo3d.inputs import ReadOptions, open_capture

SAID = ReadOptions(camera=scene().pinhole, depth_scale=4000)


@pytest.fixture
def make(tmp_path):
    """Return a function that writes `cable.png`, `photo.png` and `cable.yaml` with changes, and returns the depth image."""

    def write(name="cable", **changes):
        values = {"camera": list(map(float, scene().pinhole)), "depth_scale": 4000, "color": "photo.png"} | changes
        put(tmp_path / "photo.png", scene().color)
        (tmp_path / f"{name}.yaml").write_text(yaml.safe_dump({k: v for k, v in values.items() if v is not None}))
        return put(tmp_path / f"{name}.png", units(4000))

    return write


def test_a_depth_image_and_its_yaml(make):
    for path in (make(), make().with_suffix(".yaml")):
        opened = open_capture(path)
        assert opened.format == "pairs"
        (frame_ref,) = pickle.loads(pickle.dumps(opened.frames))
        assert frame_ref.name == "cable"
        check(frame_ref.load(), 1 / 4000)
    assert_detected(frame_ref.load())


def test_folder_of_depth_images(make, tmp_path):
    for name in ("2", "10"):
        make(name, timestamp=float(name))
    put(tmp_path / "masks" / "m.png", scene().mask)
    make("11", mask="masks/m.png", pose=POSE.tolist(), color=None)
    opened = open_capture(tmp_path)
    assert opened.format == "pairs"
    assert [(frame_ref.name, frame_ref.timestamp) for frame_ref in opened.frames] == [("2", 2.0), ("10", 10.0), ("11", None)]
    assert opened.frames[1].load().data.timestamp == 10.0
    loaded = opened.frames[2].load()
    assert np.array_equal(loaded.mask, scene().mask)
    assert np.array_equal(loaded.pose, POSE)
    assert loaded.data.color is None


def test_a_tiff_of_metres(make, tmp_path):
    make().unlink()
    path = put(tmp_path / "cable.tiff", scene().depth.astype(np.float32))
    check(open_capture(path).frames[0].load(), 0)


def test_camera_from_options(tmp_path, monkeypatch):
    depth, photo = put(tmp_path / "d.png", units(4000)), put(tmp_path / "photos" / "c.png", scene().color)
    check(open_capture(depth, options=SAID.model_copy(update={"color": photo})).frames[0].load(), 1 / 4000)
    assert open_capture(depth, options=SAID).frames[0].load().data.color is None
    monkeypatch.chdir(tmp_path)
    said = ReadOptions.from_pairs([f"camera={[*map(float, scene().pinhole)]}", "depth_scale=4000", "color=photos/c.png"])
    check(open_capture("d.png", options=said).frames[0].load(), 1 / 4000)


def test_options_take_precedence(make):
    path = make(camera=[1.0, 2.0, 3.0, 4.0], depth_scale=1)
    check(open_capture(path, options=SAID).frames[0].load(), 1 / 4000)


def test_from_the_command_line(make, doo3d, tmp_path):
    path = make()
    path.with_suffix(".yaml").unlink()
    camera = f"camera={[*map(float, scene().pinhole)]}"
    said = [word for pair in (camera, "depth_scale=4000", "color=photo.png") for word in ("--input-option", pair)]
    code, out, err = doo3d("detect", path, "-o", tmp_path / "out", *said)
    assert code == 0, err
    assert "1 chain   1.080 m" in out


def test_photographs_and_results_are_no_pairs(make, tmp_path):
    make()
    assert open_capture(tmp_path / "photo.png").format == "photos"
    assert open_capture(make(), images_only=True).format == "photos"
    (tmp_path / "cable.yaml").write_text("segment:\n  camera: 1\n")
    with refuses("intrinsics-missing", "--camera FILE", "-c image"):  # cable.png has 16 bits
        open_capture(tmp_path)
    assert open_capture(tmp_path, images_only=True).format == "photos"


# --- what cannot be read -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "code", "part"),
    [
        ({"camera": [1, 2, 3]}, "value-invalid", "camera.3"),
        ({"camera": [0, 500, 320, 240]}, "value-out-of-bounds", "camera.0"),
        ({"camera": [float("nan"), 500, 320, 240]}, "value-invalid", "camera.0"),
        ({"depth_scale": 0}, "value-out-of-bounds", "depth_scale"),
        ({"scale": 5}, "key-unknown", "scale"),
        ({"pose": [[1, 0], [0, 1]]}, "pose-invalid", "pose"),
        ({"timestamp": "late"}, "value-invalid", "timestamp"),
    ],
)
def test_invalid_yaml_values(make, changes, code, part):
    refused(make(**changes), code, f"cable.yaml: {part}", index=0)


def test_broken_yaml(make):
    path = make()
    path.with_suffix(".yaml").write_text("camera: [1, 2")
    refused(path, "yaml-invalid", "cable.yaml", index=0)
    path.with_suffix(".yaml").write_text("camera: *a")
    refused(path, "yaml-invalid", "cable.yaml", index=0)


def test_images_missing_truncated_and_of_another_size(make):
    path = make(color="other.png")
    refused(path, "file-missing", "other.png", index=0)
    put(path.with_name("other.png"), scene().color[:240])
    refused(path, "color-size", "cable.png", "640x240", "640x480", index=0)
    path.write_bytes(path.read_bytes()[:3000])
    refused(path, "file-damaged", "cable.png", index=0)
    put(path, scene().color)
    refused(path, "depth-shape", "cable.png", "3", index=0)


def test_implausible_unit(make):
    refused(make(depth_scale=1), "depth-unit", "cable.png", index=0)

"""Camera files in the forms that tools and devices write: found beside the images, or given by --camera."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from builders.errors import refused, refuses
from builders.sample_scene import put, scene, units

from doo3d.inputs import ReadOptions, open_capture
from doo3d.inputs.support.camera_files import read_camera_file

MATRIX = [[610.5, 0, 320.25], [0, 611.5, 240.75], [0, 0, 1]]
PINHOLE = (610.5, 611.5, 320.25, 240.75)
FLAT = [value for row in MATRIX for value in row]
COLUMNS = [610.5, 0, 0, 0, 611.5, 0, 320.25, 240.75, 1]

ROS = """header:
  seq: 0
  frame_id: camera_color_optical_frame
height: 480
width: 640
distortion_model: plumb_bob
D: [0.0, 0.0, 0.0, 0.0, 0.0]
K: [610.5, 0.0, 320.25, 0.0, 611.5, 240.75, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [600.0, 0.0, 320.0, 0.0, 0.0, 600.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0]
---
"""
ROS_CALIBRATION = """image_width: 640
image_height: 480
camera_name: head_camera
camera_matrix:
  rows: 3
  cols: 3
  data: [610.5, 0, 320.25, 0, 611.5, 240.75, 0, 0, 1]
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.1, -0.2, 0, 0, 0]
"""
OPENCV = """%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 610.5, 0., 320.25, 0., 611.5, 240.75, 0., 0., 1. ]
"""
KALIBR = "cam0:\n  camera_model: pinhole\n  intrinsics: [610.5, 611.5, 320.25, 240.75]\n  resolution: [640, 480]\n"
ORB_SLAM = (
    "%YAML:1.0\nCamera.fx: 610.5\nCamera.fy: 611.5\nCamera.cx: 320.25\nCamera.cy: 240.75\nCamera.width: 640\nCamera.height: 480\n"
)
ENUMERATED = """Intrinsic of "Depth" / 1280x720 / {Z16}
  Width:        1280
  Height:       720
  PPX:          640.5
  PPY:          360.5
  Fx:           900.5
  Fy:           901.5
  Distortion:   Brown Conrady
  Coeffs:       0       0       0       0       0
  FOV (deg):    69.7 x 42.9

Intrinsic of "Depth" / 640x480 / {Z16}
  Width:        640
  Height:       480
  PPX:          320.25
  PPY:          240.75
  Fx:           610.5
  Fy:           611.5
  Distortion:   Brown Conrady
  Coeffs:       0       0       0       0       0
"""
VIEWER = (
    "Frame Info: \nType,Depth\nResolution x,640\n\n"
    "Intrinsic:,\nFx,610.5\nFy,611.5\nPPx,320.25\nPPy,240.75\nDistorsion,Brown Conrady\n"
)

FILES = {
    "camera_intrinsic.json": json.dumps({"width": 640, "height": 480, "intrinsic_matrix": COLUMNS}),
    "camera.json": json.dumps({"fx": 610.5, "fy": 611.5, "cx": 320.25, "cy": 240.75, "depth_scale": 1.0}),
    "intrinsics.json": json.dumps({"K": MATRIX}),
    "intrinsic.json": json.dumps({"intrinsic_matrix": FLAT}),
    "k.json": json.dumps(MATRIX),
    "calib.json": json.dumps({"color": {"intrinsics": {"fx": 610.5, "fy": 611.5, "ppx": 320.25, "ppy": 240.75}}}),
    "transforms.json": json.dumps({"fl_x": 610.5, "fl_y": 611.5, "cx": 320.25, "cy": 240.75, "w": 640, "h": 480}),
    "camera_pose.yml": "intrinsics:\n  focal_length: [610.5, 611.5]\n  principal_point: [320.25, 240.75]\n",
    "params.yaml": "camera: {fx: 610.5, fy: 611.5, cx: 320.25, cy: 240.75}\nunits: mm\n",
    "camera_info.yaml": ROS,
    "ost.yaml": ROS_CALIBRATION,
    "opencv.yml": OPENCV,
    "camchain.yaml": KALIBR,
    "d435i.yaml": ORB_SLAM,
    "camera.txt": ENUMERATED,
    "realsense_intrinsics.txt": VIEWER,
    "intrinsics_printed.txt": "[ 640x480  p[320.25 240.75]  f[610.5 611.5]  Brown Conrady [0 0 0 0 0] ]",
    "intrinsics_old.txt": "width: 640, height: 480, ppx: 320.25, ppy: 240.75, fx: 610.5, fy: 611.5, "
    "model: Brown Conrady, coeffs: [0, 0, 0, 0, 0]",
    "cam_K.txt": "610.5 0 320.25\n0 611.5 240.75\n0 0 1\n",
    "intrinsic_depth.txt": "610.5 0 320.25 0\n0 611.5 240.75 0\n0 0 1 0\n0 0 0 1\n",
}


def images(folder: Path, color: bool = True) -> Path:
    put(folder / "depth" / "0.png", units(1000))
    if color:
        put(folder / "rgb" / "0.png", scene().color)
    return folder


def pinhole_of(opened) -> tuple[float, ...]:
    data = opened.frames[0].load().data
    assert np.abs(data.depth - scene().depth).max() < 1e-3
    return (data.camera.fx, data.camera.fy, data.camera.cx, data.camera.cy)


@pytest.mark.parametrize("name", FILES)
def test_the_file_is_found_beside_the_images_and_given_by_the_option(doo3d, tmp_path, name):
    folder = images(tmp_path / "capture")
    (tmp_path / name).write_text(FILES[name])
    code, out, err = doo3d("info", "capture", "--camera", name)
    assert code == 0, err
    assert "fx 610.50  fy 611.50  cx 320.25  cy 240.75 px" in out
    (tmp_path / name).rename(folder / name)
    assert pinhole_of(open_capture(folder)) == PINHOLE


def test_every_command_with_an_input_takes_the_camera(doo3d, tmp_path):
    images(tmp_path / "capture")
    (tmp_path / "camera.json").write_text(json.dumps(dict(zip(("fx", "fy", "cx", "cy"), scene().pinhole, strict=True))))
    for command in (("detect", "-o", "out"), ("info",), ("explain",), ("tune",), ("compare", "-o", "compared")):
        code, _, err = doo3d(command[0], "capture", *command[1:], "--camera", "camera.json")
        assert code == 0, (command, err)
    assert "nothing is left to do" in doo3d("detect", "capture", "-o", "out", "--camera", "camera.json")[2]
    assert doo3d("report", "out")[0] == 0
    code, _, err = doo3d("detect", "capture", "-o", "out2")
    assert (code, "[intrinsics-missing]" in err) == (2, True)


def test_the_camera_in_python(tmp_path):
    folder = images(tmp_path / "capture")
    (tmp_path / "K.json").write_text(json.dumps({"K": MATRIX}))
    assert pinhole_of(open_capture(folder, camera=tmp_path / "K.json")) == PINHOLE
    assert pinhole_of(open_capture(folder, options=ReadOptions(camera_file=tmp_path / "K.json"))) == PINHOLE
    assert pinhole_of(open_capture(folder, options=ReadOptions(camera=(1, 2, 3, 4)), camera=tmp_path / "K.json")) == (1, 2, 3, 4)


@pytest.mark.parametrize(
    ("scale", "units_per_metre"), [(1000, 1000), (5000, 5000), (0.001, 1000), (0.0002, 5000), (1.0, 1000), (0.1, 10000)]
)
def test_the_unit_whichever_way_round(tmp_path, scale, units_per_metre):
    (tmp_path / "camera.json").write_text(json.dumps({"K": MATRIX, "depth_scale": scale}))
    put(tmp_path / "depth" / "0.png", units(units_per_metre))
    assert pinhole_of(open_capture(tmp_path)) == PINHOLE


def test_a_distortion_is_told(tmp_path):
    (images(tmp_path) / "ost.yaml").write_text(ROS_CALIBRATION)
    assert "lens distortion, which is not removed" in open_capture(tmp_path).notes[0]


def test_the_camera_of_the_size_of_the_images_is_chosen(tmp_path):
    (tmp_path / "camera.txt").write_text(ENUMERATED)
    opened = open_capture(images(tmp_path))
    assert pinhole_of(opened) == PINHOLE
    assert opened.notes[0] == "the camera is 'camera Depth' of camera.txt, which has 1 more"
    assert pinhole_of(open_capture(tmp_path, camera=tmp_path / "camera.txt")) == PINHOLE


def test_the_color_camera_is_chosen_where_color_belongs_to_the_depth(tmp_path):
    other = {"fx": 383.0, "fy": 383.0, "cx": 319.0, "cy": 239.0, "width": 640, "height": 480}
    (tmp_path / "cameras.json").write_text(json.dumps({"depth": other, "color": {"K": MATRIX, "width": 640, "height": 480}}))
    assert pinhole_of(open_capture(images(tmp_path))) == PINHOLE
    put(tmp_path / "alone" / "depth" / "0.png", units(1000))
    assert pinhole_of(open_capture(tmp_path / "alone", camera=tmp_path / "cameras.json"))[0] == 383


def test_several_cameras_without_a_name_that_tells(tmp_path):
    (tmp_path / "cameras.json").write_text(
        json.dumps({"left": {"K": MATRIX}, "right": {"K": [[500, 0, 320], [0, 500, 240], [0, 0, 1]]}})
    )
    for given in (None, tmp_path / "cameras.json"):
        with refuses("intrinsics-ambiguous", "cameras left", "cameras right", "610.5", "camera=[fx, fy, cx, cy]"):
            open_capture(images(tmp_path), camera=given)


def test_the_camera_of_another_resolution(doo3d, tmp_path):
    images(tmp_path / "capture")
    (tmp_path / "camera.json").write_text(
        json.dumps({"fx": 1221, "fy": 1223, "cx": 641, "cy": 482, "width": 1280, "height": 960})
    )
    code, _, err = doo3d("detect", "capture", "-o", "out", "--camera", "camera.json")
    assert code == 2
    for part in ("1280x960", "640x480", "camera=[610.50, 611.50, 320.25, 240.75]", "[intrinsics-size]"):
        assert part in err


def test_other_files_with_words_of_cameras(tmp_path):
    (images(tmp_path) / "camera.yaml").write_text("fx: 610.5\nfy: 611.5\ncx: 320.25\ncy: 240.75\n")
    (tmp_path / "camera_to_base.yaml").write_text("pose: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n")
    (tmp_path / "annotations.json").write_text("{")
    assert pinhole_of(open_capture(tmp_path)) == PINHOLE


@pytest.mark.parametrize(
    ("name", "text", "code"),
    [
        ("camera.json", "{", "json-invalid"),
        ("camera.json", "[" * 100_000, "json-invalid"),
        ("camera.json", '{"fx": 1' + "0" * 5000 + ', "fy": 1, "cx": 1, "cy": 1}', "json-invalid"),
        ("camera.json", '{"fx": 610, "fy": 610, "cx": 320, "cy": "x"}', "intrinsics-invalid"),
        ("camera.json", '{"K": [[610, 0], [0, 610, 240], 1]}', "intrinsics-invalid"),
        ("camera.json", '{"K": "610"}', "intrinsics-invalid"),
        ("camera.json", '{"pose": [1, 2, 3]}', "intrinsics-missing"),
        ("camera.yaml", "a: [", "yaml-invalid"),
        ("camera.yaml", "a: &a [1]\nb: *c\n", "yaml-invalid"),
        ("camera.yaml", "K: " + "[" * 3000, "yaml-invalid"),
        ("camera.yaml", "- 1\n- 2\n", "intrinsics-missing"),
        ("camera.yaml", "K: {data: [1, 2, 3]}\n", "intrinsics-invalid"),
        ("camera.yaml", "? [1, 2]\n: 3\n", "yaml-invalid"),
        ("camera.txt", "hello\x00", "intrinsics-missing"),
        ("camera.txt", "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 990\n", "file-lfs-pointer"),
        ("camera.txt", "1 2 3\n" * 200_000, "size-too-large"),
    ],
)
def test_files_that_are_no_camera(tmp_path, name, text, code):
    (tmp_path / name).write_text(text)
    refused(images(tmp_path / "capture"), code, name, camera=tmp_path / name)


def test_aliases_of_aliases_are_not_unfolded(tmp_path):
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)]
    (tmp_path / "camera.yaml").write_text("\n".join([*lines, "K: *a11\n"]))
    with refuses("yaml-invalid", "camera.yaml", "aliases"):
        read_camera_file(tmp_path / "camera.yaml")


def test_a_missing_file(doo3d, tmp_path):
    images(tmp_path / "capture")
    assert "[file-missing]" in doo3d("detect", "capture", "--camera", "nowhere.json")[2]

"""Calibrations of stereo pairs as ZED, OpenCV and ROS write them, whole and broken."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders.errors import refuses
from scipy.spatial.transform import Rotation

from doo3d.errors import InputError
from doo3d.inputs import open_capture
from doo3d.inputs.rig.calibration_files import read_stereo_pair

SIZE = (1280, 720)
LEFT = (959.5, 959.4, 658.1, 335.3)
RIGHT = (961.3, 960.9, 679.8, 337.3)
LENS = (-0.07, -0.025, 0.0015, -0.00005, -0.055)
TURN = Rotation.from_rotvec([-0.001, -0.0008, 0.0039]).as_matrix()
SHIFT = np.array([-119.7, 0.41, -0.1])  # mm

ZED = """
[LEFT_CAM_HD]
fx=959.5
fy=959.4
cx=658.1
cy=335.3
k1=-0.07
k2=-0.025
p1=0.0015
p2=-0.00005
k3=-0.055
[RIGHT_CAM_HD]
fx=961.3
fy=960.9
cx=679.8
cy=337.3
k1=-0.07
k2=-0.025
p1=0.0015
p2=-0.00005
k3=-0.055
[STEREO]
Baseline=119.7
TY=-0.41
TZ=0.1
CV_HD=-0.0008
RX_HD=-0.001
RZ_HD=0.0039
"""


def matrix(pinhole: tuple[float, ...]) -> np.ndarray:
    fx, fy, cx, cy = pinhole
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def opencv(path: Path, **changed: object) -> Path:
    """Write what stereoCalibrate returned as OpenCV's FileStorage does; None leaves a key out."""
    values = {"K1": matrix(LEFT), "D1": np.array([LENS]), "K2": matrix(RIGHT), "D2": np.array([LENS]), "R": TURN, "T": SHIFT}
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for key, value in (values | changed).items():
        if value is not None:
            storage.write(key, np.asarray(value, dtype=float))
    storage.release()
    return path


def camera_info(path: Path, pinhole: tuple[float, ...], offset: float, **changed: object) -> Path:
    """Write a camera_info as ROS's camera_calibration does."""
    rectified = [960.0, 0, 660.0, offset, 0, 960.0, 340.0, 0, 0, 0, 1, 0]
    values = {
        "image_width": 1280,
        "image_height": 720,
        "camera_matrix": {"rows": 3, "cols": 3, "data": matrix(pinhole).ravel().tolist()},
        "distortion_model": "plumb_bob",
        "distortion_coefficients": {"rows": 1, "cols": 5, "data": list(LENS)},
        "rectification_matrix": {"rows": 3, "cols": 3, "data": np.eye(3).ravel().tolist()},
        "projection_matrix": {"rows": 3, "cols": 4, "data": rectified},
    }
    path.write_text(json.dumps({key: value for key, value in (values | changed).items() if value is not None}))
    return path


@pytest.fixture
def zed(tmp_path):
    def write(text: str = ZED) -> Path:
        path = tmp_path / "SN1234.conf"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize(
    ("changes", "size", "code", "parts"),
    [
        ({"Baseline=119.7\n": ""}, SIZE, "intrinsics-missing", ["SN1234.conf: STEREO", "Baseline"]),
        ({"[RIGHT_CAM_HD]": "[RIGHT_CAM_VGA]"}, SIZE, "intrinsics-missing", ["RIGHT_CAM_HD"]),
        ({"fx=959.5": "fx=wide"}, SIZE, "intrinsics-invalid", ["LEFT_CAM_HD: fx"]),
        ({}, (640, 480), "intrinsics-size", ["640x480", "1280x720"]),
        ({"119.7": "0", "-0.41": "0", "TZ=0.1": "TZ=0"}, SIZE, "baseline-invalid", ["0 mm apart"]),
    ],
)
def test_a_zed_file_that_is_refused(zed, changes, size, code, parts):
    text = ZED
    for old, new in changes.items():
        text = text.replace(old, new)
    with refuses(code, *parts):
        read_stereo_pair([zed(text)], size, None)


def test_a_translation_in_metres_where_millimetres_belong_is_refused_and_its_unit_asked_for(zed):
    path = zed(ZED.replace("119.7", "0.1197").replace("-0.41", "-0.00041").replace("TZ=0.1", "TZ=0.0001"))
    with refuses("baseline-invalid", "unit"):
        read_stereo_pair([path], SIZE, None)
    assert read_stereo_pair([path], SIZE, "m").baseline == pytest.approx(0.1197, abs=1e-5)


def test_a_zed_file_is_in_millimetres_and_its_resolution_is_that_of_the_images(zed):
    pair = read_stereo_pair([zed()], SIZE, None)
    assert pair.baseline == pytest.approx(0.1197, abs=1e-5)
    assert (pair.left.camera.fx, pair.right.camera.cx) == (959.5, 679.8)
    assert pair.left.coefficients == LENS
    np.testing.assert_allclose(np.reshape(pair.rotation, (3, 3)), TURN, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "translation"),
    [(ZED, (-0.1197, -0.00041, 0.0001)), (ZED.replace("TY=-0.41\n", "").replace("TZ=0.1\n", ""), (-0.1197, 0, 0))],
)
def test_the_baseline_of_a_zed_file_is_a_length_but_ty_and_tz_are_components_of_t(zed, text, translation):
    """Older files have no TY and TZ."""
    np.testing.assert_allclose(read_stereo_pair([zed(text)], SIZE, None).translation, translation, atol=1e-12)


def test_opencv_files_say_no_unit_so_that_it_has_to_be_given(tmp_path):
    path = opencv(tmp_path / "stereo.yml")
    with refuses("unit-missing", "stereo.yml", "unit: mm"):
        read_stereo_pair([path], SIZE, None)
    assert read_stereo_pair([path], SIZE, "mm").baseline == pytest.approx(0.1197, abs=1e-5)


@pytest.mark.parametrize("suffix", [".yml", ".xml"])
def test_opencv_yaml_and_xml_hold_the_same_pair(tmp_path, suffix):
    pair = read_stereo_pair([opencv(tmp_path / f"stereo{suffix}")], SIZE, "mm")
    np.testing.assert_allclose(pair.translation, SHIFT / 1000)
    np.testing.assert_allclose(np.reshape(pair.rotation, (3, 3)), TURN)
    np.testing.assert_allclose(pair.right.coefficients, LENS)


def test_intrinsics_and_extrinsics_may_be_two_files_under_other_names(tmp_path):
    unused = dict.fromkeys(("K1", "D1", "K2", "D2"))
    names = {"M1": matrix(LEFT), "distCoeffsLeft": [LENS], "right_camera_matrix": matrix(RIGHT), "dist_coeffs_2": [LENS]}
    first = opencv(tmp_path / "intrinsics.yml", R=None, T=None, **unused, **names)
    pair = read_stereo_pair([first, opencv(tmp_path / "extrinsics.yml", **unused)], SIZE, "mm")
    assert (pair.left.camera.fx, pair.right.camera.fx) == (959.5, 961.3)


@pytest.mark.parametrize(
    ("changed", "size", "code", "parts"),
    [
        ({"K2": None}, SIZE, "intrinsics-missing", ["stereo.yml", "K2"]),
        ({"D1": None}, SIZE, "intrinsics-missing", ["stereo.yml", "D1"]),
        ({"R": None}, SIZE, "intrinsics-missing", ["stereo.yml", "has no R"]),
        ({"T": None}, SIZE, "intrinsics-missing", ["stereo.yml", "has no T"]),
        ({"R": 2 * TURN}, SIZE, "pose-invalid", ["stereo.yml", "rotation"]),
        ({"T": -SHIFT}, SIZE, "baseline-invalid", ["exchange"]),
        ({"T": SHIFT[[1, 0, 2]]}, SIZE, "baseline-invalid", ["side by side"]),
        ({"image_size": [1280, 720]}, (640, 360), "intrinsics-size", ["1280x720", "640x360"]),
        ({}, (640, 360), "intrinsics-size", ["principal point"]),
        ({"D1": [[0.1, 0.2, 0.3]]}, SIZE, "lens-invalid", []),
    ],
)
def test_a_file_of_opencv_that_is_refused(tmp_path, changed, size, code, parts):
    with refuses(code, *parts):
        read_stereo_pair([opencv(tmp_path / "stereo.yml", **changed)], size, "mm")


@pytest.mark.parametrize("name", ["stereo.yml", "stereo.xml", "stereo.json", "SN1.conf"])
def test_a_file_of_something_else_is_an_input_error(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b"\x00\xffnothing of the kind")
    with pytest.raises(InputError):
        read_stereo_pair([path], SIZE, "mm")


@pytest.fixture
def infos(tmp_path):
    """Return the camera_info of the left and of the right camera."""
    return camera_info(tmp_path / "left.yaml", LEFT, 0.0), camera_info(tmp_path / "right.yaml", RIGHT, -115.2)


def test_camera_infos_that_are_refused(infos):
    left, right = infos
    with refuses("rig-invalid", "both"):
        read_stereo_pair([left], SIZE, None)
    with refuses("baseline-invalid", "exchange"):
        read_stereo_pair([right, left], SIZE, None)
    camera_info(right, RIGHT, -115.2, projection_matrix={"data": [0.0] * 12})
    with refuses("intrinsics-invalid", "right.yaml", "not calibrated"):
        read_stereo_pair([left, right], SIZE, None)


def test_the_baseline_of_ros_is_in_the_projection_matrix_of_the_right_camera(infos):
    raw = read_stereo_pair(infos, SIZE, None)
    assert raw.baseline == pytest.approx(0.12)
    assert raw.left.coefficients == LENS
    rectified = read_stereo_pair(infos, SIZE, None, rectified=True)
    assert rectified.left.camera.fx == 960.0
    assert not rectified.left.coefficients


def test_a_rectified_pair_sees_a_point_in_the_same_row_and_its_disparity_tells_the_depth(tmp_path):
    pair = read_stereo_pair([opencv(tmp_path / "stereo.yml")], SIZE, "mm")
    rectified, points = pair.rectified(), np.array([[0.1, 0.05, 1.1], [-0.3, -0.1, 0.9], [0.0, 0.2, 2.0]])
    own = [points @ rectified.turns[0]]  # in the left camera's frame
    own.append(own[0] @ TURN.T + SHIFT / 1000)
    pinhole = rectified.camera.project(points)
    for side, (local, intrinsics) in enumerate(zip(own, (LEFT, RIGHT), strict=True)):
        seen = cv2.projectPoints(local, np.zeros(3), np.zeros(3), matrix(intrinsics), np.array(LENS))[0][:, 0]
        np.testing.assert_allclose(rectified.pixels(points, side), seen, atol=1e-6)
        shifted = pinhole - np.column_stack((side * rectified.camera.fx * pair.baseline / points[:, 2], np.zeros(3)))
        maps = [
            cv2.remap(each, shifted[:, :1].astype(np.float32), shifted[:, 1:].astype(np.float32), cv2.INTER_LINEAR)[:, 0]
            for each in rectified.maps[side]
        ]
        np.testing.assert_allclose(np.column_stack(maps), seen, atol=0.05)


def test_an_image_of_another_size_is_not_rectified(tmp_path):
    rectified = read_stereo_pair([opencv(tmp_path / "stereo.yml")], SIZE, "mm").rectified()
    image = np.zeros((360, 640, 3), np.uint8)
    with refuses("intrinsics-size", "left image", "640x360"):
        rectified.images(image, image)


def test_photographs_of_a_stereo_pair_beside_its_calibration_name_the_option_for_them(doo3d, tmp_path):
    """The calibration fits half the width of the images; one that does not, or another file, is no reason for a note."""
    width, height = SIZE
    cv2.imwrite(str(tmp_path / "000.png"), np.zeros((height, 2 * width, 3), np.uint8))
    (tmp_path / "notes.yaml").write_text("lens: 4 mm")
    assert open_capture(tmp_path, images_only=True).notes == []
    file = opencv(tmp_path / "stereo.yml")
    note = f"these are images of a stereo pair, side by side: for 3-D give --cameras {file}"
    assert open_capture(tmp_path, images_only=True).notes == [note]
    assert note in doo3d("info", tmp_path)[1]
    assert f"note: {note}" in doo3d("detect", tmp_path)[2]
    cv2.imwrite(str(tmp_path / "000.png"), np.zeros((height, width, 3), np.uint8))
    assert open_capture(tmp_path, images_only=True).notes == []

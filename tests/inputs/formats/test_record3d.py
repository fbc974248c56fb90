"""Recordings of the app Record3D, read in place."""

from __future__ import annotations

import json
import pickle
import stat
import sys
import zipfile

import cv2
import numpy as np
import pytest
from builders import errors
from builders.sample_scene import POSE, POSITION, QUATERNION, assert_detected, check, scene

from doo3d.errors import MissingDependency
from doo3d.inputs import ReadOptions, open_capture
from doo3d.inputs.formats import record3d

packing = pytest.importorskip("lzfse")
SMALL = (320, 240)  # of the depth; the color is twice as large


def refused(path, code, *parts, **how):
    errors.refused(path, code, path.name, *parts, **how)


def jpeg(color):
    return cv2.imencode(".jpg", color[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()


def lzfse(depth):
    return packing.compress(np.ascontiguousarray(depth, dtype="<f4").tobytes())


def about(size=(640, 480), **changes):
    fx, fy, cx, cy = map(float, scene().pinhole)
    given = {
        "w": 640,
        "h": 480,
        "dw": size[0],
        "dh": size[1],
        "fps": 30,
        "K": [fx, 0, 0, 0, fy, 0, cx, cy, 1],
        "poses": [[0, 0, 0, 1, 0, 0, 0], [*QUATERNION, *POSITION]],
        "initPose": [0, 0, 0, 1, 0, 0, 0],
    } | changes
    return {key: value for key, value in given.items() if value is not None}


@pytest.fixture
def make(tmp_path):
    """Return a function that writes `cable.r3d` of two frames: `make(members={name: bytes or None to omit}, size=..., K=...)`."""

    def write(members=None, metadata=None, size=(640, 480), **changes):
        step = 640 // size[0]
        depth, color = scene().depth[::step, ::step], scene().color
        files = {"metadata": json.dumps(about(size, **changes)).encode() if metadata is None else metadata, "icon": jpeg(color)}
        for i in range(2):
            files |= {f"rgbd/{i}.jpg": jpeg(color), f"rgbd/{i}.depth": lzfse(depth), f"rgbd/{i}.conf": lzfse(depth > 0)}
        path = tmp_path / "cable.r3d"
        with zipfile.ZipFile(path, "w") as file:
            for name, data in (files | (members or {})).items():
                if data is not None:
                    file.writestr(name, data)
        return path

    return write


def test_depth_color_camera_pose_and_time(make):
    opened = open_capture(make())
    assert opened.format == "record3d"
    assert [(frame_ref.name, frame_ref.timestamp) for frame_ref in opened.frames] == [("0", 0.0), ("1", 1 / 30)]
    first, second = (frame_ref.load() for frame_ref in pickle.loads(pickle.dumps(opened.frames)))
    check(first, 0, color=2)
    assert np.allclose(first.pose, np.diag([1, -1, -1, 1]))
    assert np.allclose(second.pose[:3, 3], POSITION)
    assert_detected(second)


def test_poses_are_converted_to_the_optical_frame(make):
    """A point ahead of the camera has negative z in the app's frame (y up), positive z in the optical frame."""
    pose = open_capture(make()).frames[1].load().pose
    x, y, z = 0.1, 0.2, 0.7  # right, down, forward
    assert np.allclose(pose @ (x, y, z, 1), POSE @ (x, -y, -z, 1))
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)


def test_color_and_camera_are_scaled_to_the_depth(make):
    loaded = open_capture(make(size=SMALL)).frames[0].load()
    camera, (fx, fy, cx, cy) = loaded.data.camera, scene().pinhole
    assert (camera.width, camera.height) == SMALL
    assert np.allclose((camera.fx, camera.fy, camera.cx, camera.cy), (fx / 2, fy / 2, cx / 2, cy / 2))
    assert loaded.data.color.shape == (240, 320, 3)
    mean = scene().color.reshape(240, 2, 320, 2, 3).mean(axis=(1, 3))
    assert np.abs(loaded.data.color - mean).mean() < 2
    assert np.array_equal(loaded.data.depth, scene().depth[::2, ::2].astype(np.float32))


def test_intrinsics_and_times_of_each_frame(make):
    path = make(perFrameIntrinsicCoeffs=[[400, 401, 300, 200], [410, 411, 310, 210]], frameTimestamps=[0.0, 0.25], size=SMALL)
    frame_ref = open_capture(path).frames[1]
    camera = frame_ref.load().data.camera
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (205, 205.5, 155, 105)
    assert frame_ref.timestamp == 0.25


def test_recordings_without_poses_and_depth_size(make):
    loaded = open_capture(make(poses=None, dw=None, dh=None)).frames[0].load()
    assert loaded.pose is None
    check(loaded, 0, color=2)


def test_camera_from_options(make):
    camera = open_capture(make(K=None, size=SMALL), options=ReadOptions(camera=(1, 2, 3, 4))).frames[0].load().data.camera
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (1, 2, 3, 4)


def test_format_is_detected_by_content_not_by_name(make, tmp_path):
    assert open_capture(make().rename(tmp_path / "recording.zip")).format == "record3d"


def test_nothing_is_written(make, tmp_path):
    for frame_ref in open_capture(make()).frames:
        frame_ref.load()
    assert [file.name for file in tmp_path.iterdir()] == ["cable.r3d"]


def test_missing_package_is_named(make, monkeypatch):
    path = make()
    monkeypatch.setitem(sys.modules, "lzfse", None)
    with pytest.raises(MissingDependency, match=r"pip install 'doo3d\[record3d\]'"):
        open_capture(path)


# --- what is not safe --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["../evil", "rgbd/../../evil", "/etc/evil", "C:/evil", "rgbd\\..\\..\\evil"])
def test_member_paths_out_of_the_archive(make, name):
    refused(make({name: b"x"}), "archive-unsafe", repr(name))


def test_member_links(make):
    link = zipfile.ZipInfo("rgbd/2.jpg")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    path = make()
    with zipfile.ZipFile(path, "a") as file:
        file.writestr(link, "/etc/passwd")
    refused(path, "archive-unsafe", "rgbd/2.jpg")


@pytest.mark.parametrize("lie", [False, True])
def test_depth_that_decompresses_to_too_much(make, lie, monkeypatch):
    data = bytearray(packing.compress(bytes(8_000_000)))
    assert len(data) < 20_000
    if lie:  # many blocks, each of which says that it is small
        at = data.index(b"bvx2")
        data[at + 4 : at + 8] = (100).to_bytes(4, "little")
        data = data[:-4] * 200 + data[-4:]
    path = make({"rgbd/0.depth": bytes(data)})
    monkeypatch.setattr(packing, "decompress", None)
    refused(path, "size-too-large", "rgbd/0.depth", "640x480", index=0)


def test_declared_size_of_compressed_depth():
    rng = np.random.default_rng(0)
    noise, few = rng.integers(0, 256, 300_000, dtype=np.uint8), rng.integers(0, 9, 700_000, dtype=np.uint8)
    for raw in (b"", b"abc", bytes(3000), noise[:500].tobytes(), noise.tobytes(), few.tobytes(), bytes(5_000_000)):
        total, blocks = record3d._declared_size(packing.compress(raw))
        assert total == len(raw)
        assert blocks <= len(raw) // record3d._MIN_BLOCK_BYTES + 2


def test_depth_longer_than_its_image(make):
    refused(make({"rgbd/0.depth": bytes(2_000_000)}), "size-too-large", "rgbd/0.depth", index=0)


def test_member_that_decompresses_to_too_much(make, tmp_path):
    path = make({"rgbd/0.jpg": None})
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as file:
        file.writestr("rgbd/0.jpg", bytes(80_000_000))
    assert path.stat().st_size < 4_000_000
    refused(path, "size-too-large", "rgbd/0.jpg", index=0)


def test_metadata_with_an_unreasonable_size(make):
    refused(make(dw=1_000_000, dh=1_000_000), "size-too-large", "1000000x1000000")


# --- what cannot be read -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "code", "parts"),
    [
        ({"K": [500, 0, 320, 0, 500, 240, 0, 1, 1]}, "intrinsics-invalid", ["metadata: K"]),
        ({"K": None}, "intrinsics-missing", ["metadata: K"]),
        ({"w": 0}, "intrinsics-invalid", ["metadata: w, h", "[0, 480]"]),
        ({"dw": "640"}, "intrinsics-invalid", ["metadata: dw, dh", "['640', 480]"]),
        ({"perFrameIntrinsicCoeffs": [[1, 2]]}, "intrinsics-invalid", ["metadata: perFrameIntrinsicCoeffs: frame 0"]),
        ({"metadata": b"{"}, "json-invalid", ["metadata"]),
        ({"metadata": b"[]"}, "json-invalid", ["metadata"]),
        ({"members": {f"rgbd/{i}.{kind}": None for i in (0, 1) for kind in ("jpg", "depth")}}, "frames-missing", []),
    ],
)
def test_invalid_recordings(make, changes, code, parts):
    refused(make(**changes), code, *parts)


@pytest.mark.parametrize(
    ("changes", "code", "parts"),
    [
        ({"members": {"rgbd/0.jpg": None}}, "file-missing", ["rgbd/0.jpg"]),
        ({"members": {"rgbd/0.depth": None}}, "file-missing", ["rgbd/0.depth"]),
        ({"members": {"rgbd/0.jpg": jpeg(scene().color)[:9000]}}, "file-damaged", ["0.jpg"]),
        ({"members": {"rgbd/0.depth": lzfse(scene().depth)[:-900]}}, "file-damaged", ["0.depth"]),
        ({"members": {"rgbd/0.depth": lzfse(scene().depth[:240])}}, "depth-shape", ["0.depth", "614400", "1228800", "640x480"]),
        ({"members": {"rgbd/0.jpg": jpeg(scene().color[:240])}}, "color-size", ["rgbd/0", "640x240", "640x480"]),
        ({"members": {"rgbd/0.depth": lzfse(1000 * scene().depth)}}, "depth-unit", []),
        ({"poses": [[0, 0, 0, 0, 0, 0, 0]]}, "pose-invalid", ["poses: frame 0"]),
        ({"poses": [[0, 0, 1]]}, "pose-invalid", ["poses: frame 0"]),
    ],
)
def test_invalid_frames(make, changes, code, parts):
    path = make(**changes)
    refused(path, code, *parts, index=0)
    assert open_capture(path).frames[1].load().data.depth.any()


@pytest.mark.parametrize("kept", [0.0, 0.2, 0.99])
def test_truncated(make, kept):
    path = make()
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * kept)])
    refused(path, "file-damaged")


def test_damaged(make):
    path = make()
    data = bytearray(path.read_bytes())
    at = data.index(b"rgbd/0.jpg") + 5000
    data[at : at + 40] = b"\x55" * 40
    path.write_bytes(data)
    refused(path, "file-damaged", "rgbd/0.jpg", index=0)

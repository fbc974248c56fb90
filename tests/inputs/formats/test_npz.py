"""Frames as arrays in an NPZ file."""

from __future__ import annotations

import io
import pickle
import zipfile

import numpy as np
import pytest
from builders.errors import refused
from builders.sample_scene import POSE, assert_detected, check, scene, units

from doo3d.inputs import ReadOptions, open_capture
from doo3d.inputs.formats import _npz_arrays as arrays


def matrix():
    fx, fy, cx, cy = scene().pinhole
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def save(path, compressed=False, **given):
    values = {"depth": scene().depth, "color": scene().color, "K": matrix()} | given
    (np.savez_compressed if compressed else np.savez)(path, **{key: value for key, value in values.items() if value is not None})
    return path


def test_one_frame(tmp_path):
    opened = open_capture(save(tmp_path / "cable.npz", mask=scene().mask, pose=POSE, timestamps=12.5))
    assert opened.format == "arrays"
    (frame_ref,) = opened.frames
    assert (frame_ref.name, frame_ref.timestamp) == ("cable", 12.5)
    loaded = frame_ref.load()
    check(loaded, 0)
    assert np.array_equal(loaded.mask, scene().mask)
    assert np.array_equal(loaded.pose, POSE)
    assert loaded.data.timestamp == 12.5
    assert_detected(loaded)


@pytest.mark.parametrize("given", [{"depth_scale": 4000}, {"depth_scale": np.array([4000.0])}])
def test_integer_depth_has_a_unit(tmp_path, given):
    check(open_capture(save(tmp_path / "a.npz", depth=units(4000), **given)).frames[0].load(), 1 / 4000)
    check(open_capture(save(tmp_path / "a.npz", depth=units(1000).astype(np.int64))).frames[0].load(), 1 / 1000)
    opened = open_capture(save(tmp_path / "a.npz", depth=units(5000)), options=ReadOptions(depth_scale=5000))
    check(opened.frames[0].load(), 1 / 5000)


def numbered(count, **given):
    depth = np.full((count, 40, 50), 0.5) + 0.01 * np.arange(count)[:, None, None]
    color = np.zeros((count, 40, 50, 3), np.uint8) + np.arange(count, dtype=np.uint8)[:, None, None, None]
    return {"depth": depth.astype(np.float32), "color": color, "K": np.diag([50.0, 50, 1])} | given


@pytest.mark.parametrize("compressed", [False, True])
def test_frames_load_in_any_order_and_in_another_process(tmp_path, compressed):
    path = save(tmp_path / "a.npz", compressed, **numbered(9, pose=np.broadcast_to(POSE, (9, 4, 4)), timestamps=np.arange(9.0)))
    opened = open_capture(path)
    assert [frame_ref.name for frame_ref in opened.frames[:2]] == ["000000", "000001"]
    frame_refs = pickle.loads(pickle.dumps(opened.frames))
    for i in [3, 4, 0, 8, 8, 2]:
        loaded = frame_refs[i].load()
        assert loaded.data.depth[7, 7] == pytest.approx(0.5 + 0.01 * i)
        assert loaded.data.color[7, 7, 0] == i
        assert loaded.data.timestamp == i
        assert np.array_equal(loaded.pose, POSE)


def test_only_one_frame_is_in_memory(tmp_path, monkeypatch):
    """No single read from the file is larger than one frame's part."""
    path = save(tmp_path / "a.npz", **numbered(30))
    read, largest = arrays.ArrayStack._read, []

    def counting(self, length):
        largest.append(length)
        return read(self, length)

    monkeypatch.setattr(arrays.ArrayStack, "_read", counting)
    loaded_frames = [frame_ref.load() for frame_ref in open_capture(path).frames]
    assert len(loaded_frames) == 30
    assert max(largest) == 40 * 50 * 4
    assert len(largest) == 61  # K, and of each frame depth and color: nothing twice


def test_camera_per_frame_and_one_mask_for_all(tmp_path):
    cameras = np.array([np.diag([50.0 + i, 50, 1]) for i in range(3)])
    mask = np.eye(40, 50, dtype=np.uint8)
    path = save(tmp_path / "a.npz", **numbered(3, K=cameras, mask=mask, color=None))
    loaded_frames = [frame_ref.load() for frame_ref in open_capture(path).frames]
    assert [loaded.data.camera.fx for loaded in loaded_frames] == [50, 51, 52]
    assert all(np.array_equal(loaded.mask, mask > 0) for loaded in loaded_frames)
    assert loaded_frames[0].data.color is None


def test_column_major_arrays(tmp_path):
    arrays_of = {"depth": scene().depth, "color": scene().color, "K": matrix()}
    given = {name: np.asfortranarray(array) for name, array in arrays_of.items()}
    check(open_capture(save(tmp_path / "a.npz", **given)).frames[0].load(), 0)


def test_rewritten_file_is_read_anew(tmp_path):
    opened = open_capture(save(tmp_path / "a.npz", **numbered(3)))
    opened.frames[0].load()
    again = open_capture(save(tmp_path / "a.npz", **numbered(3, depth=np.full((3, 40, 50), 0.9))))
    assert again.frames[1].load().data.depth[0, 0] == pytest.approx(0.9)


def test_camera_from_options(tmp_path):
    path = save(tmp_path / "a.npz", K=None)
    refused(path, "intrinsics-missing", "a.npz", "K")
    check(open_capture(path, options=ReadOptions(camera=scene().pinhole)).frames[0].load(), 0)


def test_npz_of_points_is_a_cloud(tmp_path):
    np.savez(tmp_path / "a.npz", points=np.ones((3, 3)))
    assert open_capture(tmp_path / "a.npz").format == "cloud"


# --- what cannot be read -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "code", "part"),
    [
        ({"depth": np.ones(5)}, "array-shape", "(5,)"),
        ({"depth": np.zeros((0, 4, 5))}, "array-shape", "(0, 4, 5)"),
        ({"depth": np.array([np.ones((2, 2)), np.ones((3, 3))], dtype=object)}, "array-type", "depth"),
        ({"depth": np.asfortranarray(np.ones((2, 40, 50)))}, "array-order", "depth"),
        ({"color": np.zeros((2, 480, 640, 3), np.uint8)}, "frame-count", "color"),
        ({"depth": np.ones((2, 480, 640))}, "frame-count", "(480, 640, 3)"),
        ({"K": np.ones(5)}, "array-shape", "(5,)"),
        ({"K": np.full((3, 3), "x")}, "array-type", "<U1"),
        ({"timestamps": np.array([1.0, 2.0])}, "frame-count", "timestamps"),
        ({"timestamps": np.array(np.nan)}, "times-not-rising", "timestamps"),
        (numbered(3, timestamps=[1.0, 3.0, 2.0]), "times-not-rising", "timestamps"),
    ],
)
def test_invalid_arrays(tmp_path, given, code, part):
    refused(save(tmp_path / "a.npz", **given), code, "a.npz", part)


@pytest.mark.parametrize(
    ("given", "code", "part"),
    [
        ({"K": matrix() + 1}, "intrinsics-invalid", "frame 0: K"),
        ({"K": np.eye(3) * np.nan}, "intrinsics-invalid", "frame 0: K"),
        ({"K": np.zeros((3, 3))}, "intrinsics-invalid", "frame 0: K"),
        ({"depth_scale": 0}, "depth-scale-invalid", "frame 0: depth_scale"),
        ({"depth": units(1000), "depth_scale": 1}, "depth-unit", "depth_scale"),
        ({"depth": scene().depth * 1000}, "depth-unit", "depth_scale"),
        ({"depth": scene().depth > 0}, "depth-type", "bool"),
        ({"color": scene().color[::2]}, "color-size", "640x240"),
        ({"color": scene().color / 255.0}, "color-shape", "float64"),
        ({"mask": scene().mask[::2]}, "mask-shape", "(240, 640)"),
        ({"mask": scene().mask * 0.5}, "mask-type", "float64"),
        ({"pose": np.ones((4, 4))}, "pose-invalid", "frame 0: pose"),
    ],
)
def test_invalid_frames(tmp_path, given, code, part):
    refused(save(tmp_path / "a.npz", **given), code, "a.npz", part, index=0)


@pytest.mark.parametrize("kept", [0.01, 0.5, 0.99])
def test_truncated(tmp_path, kept):
    path = save(tmp_path / "a.npz")
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * kept)])
    refused(path, "file-damaged", "a.npz", index=0)


@pytest.mark.parametrize("compressed", [False, True])
def test_damaged(tmp_path, compressed):
    path = save(tmp_path / "a.npz", compressed)
    data = bytearray(path.read_bytes())
    data[20_000:20_040] = b"\xff" * 40
    path.write_bytes(data)
    refused(path, "file-damaged", "a.npz", "depth", index=0)


def header(*shape: int) -> bytes:
    """Return the header of an array of float32 with a shape."""
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f4", "fortran_order": False, "shape": shape})
    return head.getvalue()


def test_header_that_declares_too_much(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as file:
        file.writestr("depth.npy", header(10**12, 4, 5) + bytes(80))
    refused(tmp_path / "a.npz", "array-too-large", "depth", "(1000000000000, 4, 5)")


def test_header_that_declares_more_than_the_file_holds(tmp_path):
    np.savez(tmp_path / "k.npz", K=np.diag([5.0, 5, 1]))
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as file:
        file.writestr("depth.npy", header(3, 4, 5) + np.ones(20, "<f4").tobytes())
        file.writestr("K.npy", zipfile.ZipFile(tmp_path / "k.npz").read("K.npy"))
    assert open_capture(tmp_path / "a.npz").frames[0].load().data.depth[0, 0] == 1
    refused(tmp_path / "a.npz", "file-damaged", "depth", index=1)


def test_an_npz_of_more_frames_than_its_bytes_can_hold(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", depth=np.zeros((100_000, 1, 1), np.uint16), K=np.eye(3))
    refused(tmp_path / "a.npz", "array-too-large", "depth", "(100000, 1, 1)")


def test_saturated_depth_is_no_reading(tmp_path):
    depth = np.full((6, 8), 700, np.uint16)
    depth[:2] = 65535
    np.savez(tmp_path / "a.npz", depth=depth, K=np.array([[50.0, 0, 4], [0, 50, 3], [0, 0, 1]]))
    read = open_capture(tmp_path / "a.npz")[0].load().data.depth
    assert (read[:2] == 0).all()
    assert read[2:] == pytest.approx(0.7)

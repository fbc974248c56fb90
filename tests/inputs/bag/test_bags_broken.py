"""Bags that are truncated, damaged or incomplete: complete messages are read, the damage is reported."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rosbags")
from builders.bags import KINDS, SECOND, BagScript, packed_depth
from builders.errors import refuses
from test_bags import COLOR, DEPTH, FRAME, HEIGHT, NUMBERS, SIZE, WIDTH, named, points, script, slope, tint

from doo3d.errors import InputError
from doo3d.inputs import ReadOptions, open_capture

LARGE = (160, 120)


def recording(kind: str, frames: int = 40) -> BagScript:
    """Return an image large enough for several chunks of a megabyte."""
    made = BagScript(kind)
    made.info("/camera/depth/camera_info", LARGE, (200, 200, 80, 60))
    noise = np.random.default_rng(0).integers(300, 900, (frames, LARGE[1], LARGE[0]), dtype=np.uint16)
    for i in range(frames):
        made.image(DEPTH, SECOND + i * FRAME, noise[i], "16UC1")
        made.image(COLOR, SECOND + i * FRAME, np.repeat((noise[i] >> 2).astype(np.uint8)[..., None], 3, 2), "rgb8")
    return made


def file_of(path: Path) -> Path:
    return path if path.is_file() else next(file for file in path.iterdir() if file.suffix in (".db3", ".mcap"))


def refused(path: Path, code: str, *parts: str, **said) -> None:
    with refuses(code, *parts):
        open_capture(path, options=ReadOptions(**said))


@pytest.mark.parametrize(
    ("kind", "packing"),
    [("ros1", None), ("ros1", "lz4"), ("sqlite3", None), ("mcap", None), ("mcap", "storage")],
)
@pytest.mark.parametrize("kept", [0.5, 0.97])
def test_truncated_in_the_middle(tmp_path, kind, packing, kept):
    path = recording(kind).write(tmp_path / named(kind), packing)
    whole = [frame_ref.load().data.depth for frame_ref in open_capture(path).frames]
    assert len(whole) == 40
    file = file_of(path)
    file.write_bytes(file.read_bytes()[: int(file.stat().st_size * kept)])
    opened = open_capture(path)
    *good, last = opened.frames
    assert (30 if kept > 0.9 else 5) <= len(good) < (41 if kept > 0.9 else 25)
    for frame_ref, depth in zip(good, whole, strict=False):
        assert np.array_equal(frame_ref.load().data.depth, depth)
    with refuses("bag-damaged", file.name, f"the {len(good)} frames"):
        last.load()


@pytest.mark.parametrize(("kind", "packing"), [("ros1", "lz4"), ("ros1", "bz2"), ("mcap", "storage")])
def test_corrupt_chunk_loses_its_own_frames_only(tmp_path, kind, packing):
    path = recording(kind).write(tmp_path / named(kind), packing)
    file = file_of(path)
    data = bytearray(file.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 64] = bytes(64)
    file.write_bytes(bytes(data))
    *good, last = open_capture(path).frames
    assert 15 <= len(good) < 40
    for frame_ref in good:
        frame_ref.load()
    assert good[-1].timestamp == pytest.approx(1 + 39 / 30, abs=1e-3)
    with refuses("bag-damaged", file.name, f"the {len(good)} frames"):
        last.load()


@pytest.mark.parametrize("suffix", [".bag", ".mcap", ".db3"])
@pytest.mark.parametrize("content", [b"", b"nothing of the kind", b"#ROSBAG V1.2\n"])
def test_files_with_only_the_suffix_of_a_bag(tmp_path, suffix, content):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    refused(path, "file-damaged" if content else "file-empty", f"a{suffix}")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("kept", [20, 100, 600])
def test_truncated_after_the_signature(tmp_path, kind, kept):
    path = script(kind).write(tmp_path / named(kind))
    file = file_of(path)
    file.write_bytes(file.read_bytes()[:kept])
    refused(path, "bag-damaged", file.name)


@pytest.mark.parametrize("kind", KINDS)
def test_flipped_bytes_are_reported_or_harmless(tmp_path, kind):
    path = script(kind, frames=2).write(tmp_path / named(kind))
    file, random = file_of(path), np.random.default_rng(0)
    whole = file.read_bytes()
    for _ in range(80):
        data = bytearray(whole)
        data[random.integers(len(data))] ^= int(random.integers(1, 256))
        file.write_bytes(bytes(data))
        try:
            for frame_ref in open_capture(path).frames:
                frame_ref.load()
        except InputError as error:
            assert error.code  # noqa: PT017
            assert file.stem.split("_")[0] in str(error)  # noqa: PT017


def test_missing_camera_info(tmp_path):
    path = script(info=False).write(tmp_path / "a.bag")
    refused(path, "intrinsics-missing", DEPTH, "/camera/depth/camera_info", "info_topic", "camera=[fx")


def test_camera_info_of_another_size_or_invalid(tmp_path):
    made = script(info=False)
    made.info("/camera/depth/camera_info", (640, 480), NUMBERS)
    refused(made.write(tmp_path / "a.bag"), "intrinsics-size", "/camera/depth/camera_info", "640x480", "16x12")
    made = script(info=False)
    made.info("/camera/depth/camera_info", SIZE, (0, 0, 0, 0), p=(0, 0, 0, 0))
    refused(made.write(tmp_path / "b.bag"), "intrinsics-invalid", "/camera/depth/camera_info")
    made = script(info=False)
    made.info("/camera/depth/camera_info", SIZE, NUMBERS, model="thin prism", d=(0.1,) * 12)
    refused(made.write(tmp_path / "c.bag"), "lens-unknown", "thin prism", "plumb_bob")


def test_camera_info_of_color_of_another_size(tmp_path):
    made = script()
    made.info("/camera/color/camera_info", (640, 480), NUMBERS)
    path = made.write(tmp_path / "a.bag")
    refused(path, "intrinsics-size", "/camera/color/camera_info", "640x480", COLOR, "16x12", "color_topic=none")


@pytest.mark.parametrize("d", [(0.1, 0.2), (0.1, float("nan"), 0, 0, 0)])
def test_invalid_distortion_coefficients(tmp_path, d):
    made = script(info=False)
    made.info("/camera/depth/camera_info", SIZE, NUMBERS, d=d)
    refused(made.write(tmp_path / "a.bag"), "lens-invalid", "/camera/depth/camera_info", "plumb_bob")


@pytest.mark.parametrize(
    ("change", "code", "parts"),
    [
        ({"point_step": 8}, "message-damaged", ["8 bytes"]),
        ({"width": 400}, "message-damaged", ["400x1", "20 bytes", "240 bytes"]),
        ({"width": 0, "row_step": 0, "height": 2**32 - 1}, "cloud-empty", ["/points"]),
        ({"fields": []}, "points-missing", []),
    ],
)
def test_invalid_clouds(tmp_path, change, code, parts):
    made = BagScript("mcap")
    made.cloud("/points", SECOND, points())
    for name, value in change.items():
        setattr(made.messages[0][3], name, value)
    (frame_ref,) = open_capture(made.write(tmp_path / "bag")).frames
    with refuses(code, "frame 000000", *parts):
        frame_ref.load()


def test_yuv_of_an_odd_width(tmp_path):
    made = script(frames=1, color=False)
    made.image(COLOR, SECOND, np.zeros((HEIGHT, WIDTH - 1, 2), np.uint8), "yuv422")
    made.info("/camera/color/camera_info", (WIDTH - 1, HEIGHT), NUMBERS)
    (frame_ref,) = open_capture(made.write(tmp_path / "a.bag")).frames
    with refuses("color-shape", "15x12", "yuv422"):
        frame_ref.load()


def test_camera_info_under_another_name(tmp_path):
    made = script(info=False)
    made.info("/calibration", SIZE, NUMBERS, frame="elsewhere")
    path = made.write(tmp_path / "a.bag")
    refused(path, "intrinsics-missing", DEPTH)
    assert open_capture(path, options=ReadOptions(info_topic="/calibration")).frames[0].load().data.camera.fx == NUMBERS[0]


@pytest.mark.parametrize("key", ["depth_topic", "color_topic", "info_topic", "cloud_topic"])
def test_missing_topics_with_the_existing_ones(tmp_path, key):
    path = script().write(tmp_path / "a.bag")
    there = {"info_topic": "/camera/depth/camera_info", "cloud_topic": ""}.get(key, f"{COLOR}, {DEPTH}")
    refused(path, "topic-missing", "/nowhere", key, there, **{key: "/nowhere"})


def test_bag_of_other_message_types(tmp_path):
    made = BagScript("mcap")
    made.tf("map", "camera", (0, 0, 0))
    refused(made.write(tmp_path / "bag"), "frames-missing", "/tf (tf2_msgs/msg/TFMessage)")


def test_clocks_without_overlap(tmp_path):
    made = script(color=False)
    made.image(COLOR, 500 * SECOND, tint(), "rgb8")
    path = made.write(tmp_path / "a.bag")
    opened = open_capture(path)  # the color is not required
    assert opened.frames[0].load().data.color is None
    assert COLOR in opened.notes[0]
    assert "498." in opened.notes[0]
    assert "tolerance=" in opened.notes[0]
    refused(path, "times-apart", COLOR, "0.03 s", "498.", "tolerance=", color_topic=COLOR)
    assert open_capture(path, options=ReadOptions(color_topic="none")).frames[0].load().data.color is None


def test_color_of_another_camera_without_intrinsics(tmp_path):
    made = script(color=False)
    made.image(COLOR, SECOND, np.zeros((30, 40, 3), np.uint8), "rgb8", frame="color_optical")
    path = made.write(tmp_path / "a.bag")
    refused(path, "extrinsics-missing", "40x30", "'color_optical'", "16x12", "'camera_optical'", "color_topic=none")


@pytest.mark.parametrize("kind", KINDS)
def test_incomplete_image_fails_alone(tmp_path, kind):
    made = script(kind, frames=0)
    for i in range(3):
        made.image(DEPTH, SECOND + i * FRAME, slope(i), "16UC1")
    made.messages[2][3].data = made.messages[2][3].data[:-10]
    first, second, third = open_capture(made.write(tmp_path / named(kind))).frames
    first.load(), third.load()
    with refuses("message-damaged", "frame 000001", "16x12", "374 bytes"):
        second.load()


def test_damaged_compressed_image_fails_alone(tmp_path):
    made = script(frames=0)
    for i in range(3):
        data = packed_depth(slope(i))
        made.packed(f"{DEPTH}/compressedDepth", SECOND + i, data[: 60 if i == 0 else None], "16UC1; compressedDepth png")
    first, second, _ = open_capture(made.write(tmp_path / "a.bag")).frames
    second.load()
    with refuses("message-damaged", "frame 000000"):
        first.load()


def test_image_size_changes_in_the_middle(tmp_path):
    made = script(frames=2, color=False)
    made.image(DEPTH, 2 * SECOND, np.ones((6, 8), np.uint16), "16UC1")
    *_, last = open_capture(made.write(tmp_path / "a.bag")).frames
    with refuses("depth-shape", "frame 000002", "8x6", "16x12"):
        last.load()


def test_invalid_metadata(tmp_path):
    path = script("sqlite3").write(tmp_path / "bag")
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information: [")
    refused(path, "yaml-invalid", "metadata.yaml")
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information: {relative_file_paths: [gone.db3]}")
    refused(path, "file-missing", "gone.db3")
    (path / "metadata.yaml").write_text(
        "rosbag2_bagfile_information: {relative_file_paths: [bag.db3.zstd], compression_mode: FILE}"
    )
    refused(path, "bag-compressed")


def test_missing_package(tmp_path):
    path = script().write(tmp_path / "a.bag")
    code = (
        "import sys; sys.modules['rosbags'] = None\nfrom doo3d.inputs import open_capture\n"
        f"try:\n    open_capture({str(path)!r})\nexcept Exception as error:\n    print(type(error).__name__, error)"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said.startswith("MissingDependency")
    assert "pip install 'doo3d[bags]'" in said

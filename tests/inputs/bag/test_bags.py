"""Bags: every storage, choice of topics, pairing of images."""

from __future__ import annotations

import pickle
import shutil
import sqlite3
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rosbags")
from builders.bags import KINDS, SECOND, BagScript
from builders.errors import refused

from doo3d.inputs import ReadOptions, open_capture
from doo3d.types import Cloud, Frame, Image

WIDTH, HEIGHT = 16, 12
SIZE, NUMBERS = (WIDTH, HEIGHT), (20.0, 21.0, 8.0, 6.0)
DEPTH, COLOR = "/camera/depth/image_raw", "/camera/color/image_raw"
FRAME = SECOND // 30


def slope(offset: int = 0) -> np.ndarray:
    """Return depth (H, W) uint16 mm, all values different, with a hole."""
    values = 500 + offset + np.arange(WIDTH * HEIGHT, dtype=np.uint16).reshape(HEIGHT, WIDTH)
    values[0, 0] = 0
    return values


def tint(value: int = 0) -> np.ndarray:
    color = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    color[:] = (200, 100, value)
    color[:, : WIDTH // 2, 0] = 10
    return color


def script(kind: str = "ros1", frames: int = 3, color: bool = True, info: bool = True) -> BagScript:
    made = BagScript(kind)
    if info:
        made.info("/camera/depth/camera_info", SIZE, NUMBERS)
    for i in range(frames):
        made.image(DEPTH, SECOND + i * FRAME, slope(i), "16UC1")
        if color:
            made.image(COLOR, SECOND + i * FRAME + 2_000_000, tint(i), "rgb8")
    return made


def named(kind: str) -> str:
    return "Aufnahme 1 für Käbel" + (".bag" if kind == "ros1" else "")


def frames(path: Path, **said) -> list[Frame]:
    return [frame_ref.load().data for frame_ref in open_capture(path, options=ReadOptions(**said)).frames]


@pytest.mark.parametrize(
    ("kind", "packing"),
    [
        ("ros1", None),
        ("ros1", "bz2"),
        ("ros1", "lz4"),
        ("sqlite3", None),
        ("sqlite3", "message"),
        ("mcap", None),
        ("mcap", "storage"),
    ],
)
def test_storages(tmp_path, kind, packing):
    path = script(kind).write(tmp_path / named(kind), packing)
    opened = open_capture(path)
    assert opened.format == "bag"
    assert [frame_ref.name for frame_ref in opened.frames] == ["000000", "000001", "000002"]
    for i, frame_ref in enumerate(pickle.loads(pickle.dumps(list(opened.frames)))):
        loaded = frame_ref.load()
        assert frame_ref.timestamp == loaded.data.timestamp == pytest.approx(1 + i / 30, abs=1e-6)
        assert loaded.pose is None
        assert loaded.mask is None
        assert np.array_equal(loaded.data.depth, (slope(i) / np.float32(1000)).astype(np.float32))
        assert np.array_equal(loaded.data.color, tint(i))
        assert (loaded.data.camera.fx, loaded.data.camera.fy, loaded.data.camera.cx, loaded.data.camera.cy) == NUMBERS


@pytest.mark.parametrize("kind", KINDS)
def test_topics_are_listed(tmp_path, kind):
    path = script(kind).write(tmp_path / named(kind))
    assert open_capture(path).topics == [
        f"{COLOR} (sensor_msgs/msg/Image, 3 messages), read as color",
        "/camera/depth/camera_info (sensor_msgs/msg/CameraInfo, 1 message)",
        f"{DEPTH} (sensor_msgs/msg/Image, 3 messages), read as depth",
    ]


def test_files_of_a_ros_2_bag_without_its_folder(tmp_path):
    for kind, suffix in (("sqlite3", "db3"), ("mcap", "mcap")):
        (file,) = script(kind).write(tmp_path / kind).glob(f"*.{suffix}")
        assert len(frames(file)) == 3
        bare = file.rename(tmp_path / f"{kind} without a name")
        assert len(frames(bare)) == 3


def test_folder_without_metadata_after_a_killed_recorder(tmp_path):
    path = script("sqlite3").write(tmp_path / "bag")
    (path / "metadata.yaml").unlink()
    assert len(frames(path)) == 3


def test_rows_in_the_journal_of_a_killed_recorder(tmp_path):
    (file,) = script("sqlite3").write(tmp_path / "bag").glob("*.db3")
    database = sqlite3.connect(file)
    database.execute("PRAGMA journal_mode = WAL")
    database.execute("UPDATE messages SET id = id + 100 WHERE timestamp > 1010000000")
    database.commit()
    database.execute("DELETE FROM messages WHERE id > 102")
    database.commit()
    (tmp_path / "killed").mkdir()
    for part in (file, file.with_name(f"{file.name}-wal")):
        shutil.copy(part, tmp_path / "killed")
    database.close()
    assert len(frames(tmp_path / "killed")) == 1


def test_a_bag_in_several_files(tmp_path):
    first, second = (script("mcap").write(tmp_path / name) for name in ("a", "b"))
    (second / "b.mcap").rename(first / "b.mcap")
    text = (first / "metadata.yaml").read_text()
    (first / "metadata.yaml").write_text(text.replace("- a.mcap", "- a.mcap\n  - b.mcap", 1))
    assert len(frames(first)) == 6


def test_unit_and_camera_from_options(tmp_path):
    path = script(info=False).write(tmp_path / "a.bag")
    frame = frames(path, depth_scale=5000, camera=(30, 31, 7, 5), color_topic="none")[0]
    assert frame.depth[0, 1] == pytest.approx(501 / 5000)
    assert (frame.camera.fx, frame.camera.cy) == (30, 5)
    assert frame.color is None


def test_only_one_topic_has_header_stamps(tmp_path):
    made = script(frames=0)
    made.image(DEPTH, 50 * SECOND, slope(), "16UC1", time=SECOND)
    made.image(COLOR, 0, tint(4), "rgb8", time=SECOND + 1000)
    (frame,) = frames(made.write(tmp_path / "a.bag"))
    assert frame.color[0, 0, 2] == 4
    assert frame.timestamp == 50


def test_messages_of_other_types_are_skipped(tmp_path):
    (file,) = script("mcap").write(tmp_path / "bag").glob("*.mcap")
    file.write_bytes(file.read_bytes().replace(b"\x03\0\0\0cdr", b"\x03\0\0\0pro"))
    refused(file, "frames-missing", "/camera/depth/image_raw (sensor_msgs/msg/Image, pro)")


def test_depth_aligned_to_color_is_preferred(tmp_path):
    made = script()
    made.image("/camera/aligned_depth_to_color/image_raw", SECOND, slope(100), "16UC1", frame="color_optical")
    made.info("/camera/aligned_depth_to_color/camera_info", SIZE, (22, 22, 8, 6), frame="color_optical")
    made.info("/camera/color/camera_info", SIZE, (22, 22, 8, 6), frame="color_optical")
    made.image("/camera/infra1/image_rect_raw", SECOND, tint()[:, :, 0], "mono8")
    path = made.write(tmp_path / "a.bag")
    (frame,) = frames(path)
    assert frame.depth[0, 1] == pytest.approx(0.601)
    assert frame.camera.fx == 22
    assert np.array_equal(frame.color, tint())
    assert len(frames(path, depth_topic=DEPTH[1:], color_topic=COLOR)) == 3


def test_two_equal_cameras_are_ambiguous(tmp_path):
    made = BagScript("ros1")
    for name in ("left", "right"):
        made.image(f"/{name}/depth/image_raw", SECOND, slope(), "16UC1")
        made.info(f"/{name}/depth/camera_info", SIZE, NUMBERS)
    path = made.write(tmp_path / "a.bag")
    refused(path, "topic-ambiguous", "/left/depth/image_raw, /right/depth/image_raw", "--input-option depth_topic=")
    assert len(frames(path, depth_topic="/right/depth/image_raw")) == 1


def test_depth_is_paired_with_the_nearest_color_or_kept_alone(tmp_path):
    made = script(frames=0)
    for i in range(6):
        made.image(DEPTH, SECOND + i * FRAME, slope(i), "16UC1")
    for i in (0, 2, 3):  # color at half the rate of the depth, and a gap at the end
        made.image(COLOR, SECOND + i * FRAME + 1_000_000, tint(i), "rgb8")
    read = frames(made.write(tmp_path / "a.bag"), tolerance=0.005)
    assert [None if frame.color is None else int(frame.color[0, 0, 2]) for frame in read] == [0, None, 2, 3, None, None]


def test_frames_are_in_the_order_of_their_stamps(tmp_path):
    made = script(frames=0)
    for i in (2, 0, 1):
        made.image(DEPTH, SECOND + i * FRAME, slope(i), "16UC1", time=9 * SECOND - i)
        made.image(COLOR, SECOND + i * FRAME, tint(i), "rgb8", time=9 * SECOND - i)
    read = frames(made.write(tmp_path / "a.bag"))
    assert [int(frame.color[0, 0, 2]) for frame in read] == [0, 1, 2]
    assert [round(1000 * float(frame.depth[0, 1])) for frame in read] == [501, 502, 503]


def test_headers_without_stamps(tmp_path):
    made = script(frames=0)
    for i in range(3):
        made.image(DEPTH, 0, slope(i), "16UC1", time=SECOND * (i + 1))
        made.image(COLOR, 0, tint(i), "rgb8", time=SECOND * (i + 1))
    read = frames(made.write(tmp_path / "a.bag"))
    assert [int(frame.color[0, 0, 2]) for frame in read] == [0, 1, 2]
    assert [frame.timestamp for frame in read] == [1, 2, 3]


def points() -> np.ndarray:
    cells = np.zeros(
        12, np.dtype({"names": ["x", "y", "z", "rgb"], "formats": ["f4"] * 4, "offsets": [0, 4, 8, 16], "itemsize": 20})
    )
    for k, axis in enumerate("xyz"):
        cells[axis] = np.arange(12) + 0.5 * k
    cells["x"][5] = np.nan
    cells["rgb"] = np.full(12, 0x00C86432, np.uint32).view(np.float32)
    return cells


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("height", [1, 3])
def test_clouds(tmp_path, kind, height):
    made = BagScript(kind)
    for i in range(2):
        made.cloud("/points", SECOND * (i + 1), points(), height, pad=7)
    read = frames(made.write(tmp_path / named(kind)))
    assert all(isinstance(cloud, Cloud) for cloud in read)
    kept = np.delete(np.arange(12), 5)
    assert np.array_equal(read[1].points, np.stack([kept, kept + 0.5, kept + 1.0], axis=1))
    assert np.array_equal(read[1].colors, np.tile([200, 100, 50], (11, 1)))
    assert np.array_equal(read[1].viewpoint, np.zeros(3))
    assert read[1].timestamp == 2


def test_clouds_beside_images_are_read_on_request(tmp_path):
    made = script()
    cells = np.zeros(4, [("x", "f8"), ("y", "f8"), ("z", "f8")])
    cells["z"] = 0.7
    made.cloud("/camera/points", SECOND, cells, frame="base_link")
    path = made.write(tmp_path / "a.bag")
    assert len(frames(path)) == 3
    (cloud,) = frames(path, cloud_topic="/camera/points")
    assert np.array_equal(cloud.points[:, 2], np.full(4, 0.7))
    assert cloud.colors is None
    assert cloud.viewpoint is None


def test_bag_with_color_only_has_images(tmp_path):
    made = BagScript("mcap")
    made.image(COLOR, SECOND, tint(), "bgr8")
    (image,) = frames(made.write(tmp_path / "bag"))
    assert isinstance(image, Image)
    assert np.array_equal(image.color, tint()[:, :, ::-1])

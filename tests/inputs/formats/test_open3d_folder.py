"""The Open3D recorder's layout: content and errors."""

from __future__ import annotations

import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders.captures import cut
from builders.errors import refused, refuses
from builders.sample_scene import put

from doo3d.inputs import ReadOptions, open_capture
from doo3d.types import Frame


def frame_of(folder: Path, index: int = 0) -> Frame:
    data = open_capture(folder).frames[index].load().data
    assert isinstance(data, Frame)
    return data


def test_frames_depth_color_and_intrinsics(capture):
    opened = open_capture(capture(frames=3))
    assert opened.format == "folder"
    assert [frame_ref.name for frame_ref in opened.frames] == ["000000", "000001", "000002"]
    loaded = opened.frames[1].load()
    assert loaded.mask is None
    assert loaded.data.name == "000001"
    assert loaded.data.camera.fx == 400
    assert (loaded.data.camera.cx, loaded.data.camera.cy) == (160, 120)
    assert loaded.data.depth.dtype == np.float32
    assert loaded.data.depth[0, 0] == pytest.approx(0.56)
    assert np.abs(loaded.data.color[0, 0].astype(int) - (170, 160, 150)).max() <= 3  # RGB, through JPEG


@pytest.mark.parametrize(
    "matrix",
    [
        [410, 0, 0, 0, 420, 0, 150, 110, 1],
        [[410, 0, 0], [0, 420, 0], [150, 110, 1]],
        [410, 0, 150, 0, 420, 110, 0, 0, 1],
    ],
)
def test_the_matrix_is_column_major_and_may_be_row_by_row(capture, matrix):
    camera = frame_of(capture(intrinsics={"intrinsic_matrix": matrix})).camera
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (410, 420, 150, 110)


def test_depth_scale_is_units_per_metre(capture):
    assert frame_of(capture(intrinsics={"depth_scale": 5000})).depth[0, 0] == pytest.approx(0.112)


def test_float_tiff_depth_is_metres(capture):
    folder = capture()
    (folder / "depth" / "000000.png").unlink()
    depth = np.full((240, 320), 0.75, np.float32)
    depth[0, 0] = np.nan
    put(folder / "depth" / "000000.tiff", depth)
    read = frame_of(folder).depth
    assert read[5, 5] == np.float32(0.75)
    assert read[0, 0] == 0


def test_color_may_be_missing(capture):
    assert frame_of(capture(color=False)).color is None


def test_masks_come_with_the_frame(capture):
    mask = open_capture(capture(mask=True)).frames[0].load().mask
    assert mask is not None
    assert mask.dtype == bool
    assert 1000 < mask.sum() < 10000


def test_mask_saved_as_color_image(capture):
    folder = capture(mask=True)
    path = folder / "mask" / "000000.png"
    grey = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    put(path, np.dstack([grey * 0, grey * 0, grey]))
    mask = open_capture(folder).frames[0].load().mask
    assert mask is not None
    assert np.array_equal(mask, grey > 0)


def test_camera_and_unit_from_options_take_precedence(capture):
    folder, said = capture(mask=True), ReadOptions(camera=(410, 420, 150, 110), depth_scale=2000)
    for _ in range(2):
        loaded = open_capture(folder, options=said).frames[0].load()
        camera = loaded.data.camera
        assert (camera.fx, camera.fy, camera.cx, camera.cy) == (410, 420, 150, 110)
        assert (camera.width, camera.height) == (320, 240)
        assert loaded.data.depth[0, 0] == pytest.approx(0.28)
        assert loaded.mask.any()
        (folder / "camera_intrinsic.json").unlink(missing_ok=True)


def test_only_camera_or_only_unit_from_options(capture):
    folder = capture(intrinsics={"depth_scale": 2000})
    loaded = open_capture(folder, options=ReadOptions(camera=(410, 420, 150, 110))).frames[0].load()
    assert loaded.data.depth[0, 0] == pytest.approx(0.28)
    loaded = open_capture(folder, options=ReadOptions(depth_scale=500)).frames[0].load()
    assert loaded.data.depth[0, 0] == pytest.approx(1.12)
    assert loaded.data.camera.fx == 400


@pytest.mark.parametrize("name", ["rgb", "image"])
def test_other_names_for_color(capture, name):
    folder = capture()
    (folder / "color").rename(folder / name)
    assert frame_of(folder).color is not None


def test_images_match_by_order_if_no_stem_agrees(capture):
    folder = capture(frames=2)
    for i in range(2):
        (folder / "color" / f"{i:06d}.jpg").rename(folder / "color" / f"rgb-{i}.jpg")
    assert frame_of(folder, 1).color is not None


def test_numbers_without_leading_zeros_sort_as_numbers(capture):
    folder = capture(frames=1, color=False)
    for name in ("10", "9"):
        (folder / "depth" / f"{name}.png").write_bytes((folder / "depth" / "000000.png").read_bytes())
    (folder / "depth" / "000000.png").unlink()
    assert [frame_ref.name for frame_ref in open_capture(folder).frames] == ["9", "10"]


def test_names_with_spaces_and_non_ascii_letters(capture):
    folder = capture("Seil über dem Tisch 電線")
    for part in ("color", "depth"):
        (old,) = (folder / part).iterdir()
        old.rename(old.with_stem("Bild é 1"))
    opened = open_capture(folder)
    assert opened.frames[0].load().data.name == "Bild é 1"


def test_other_files_in_the_folders_are_no_frames(capture):
    folder = capture()
    (folder / "depth" / "Thumbs.db").write_bytes(b"x")
    (folder / "depth" / "._000000.png").write_bytes(b"x")
    assert len(open_capture(folder).frames) == 1


def test_frames_load_lazily(capture):
    folder = capture(frames=2)
    (folder / "depth" / "000000.png").write_bytes(b"")
    opened = open_capture(folder)
    assert opened.frames[1].load().data is not None
    with refuses("file-empty", "000000.png"):
        opened.frames[0].load()


# --- what cannot be read: before any frame -----------------------------------------------------------------------------


def write_json(folder: Path, text: str) -> None:
    (folder / "camera_intrinsic.json").write_text(text)


@pytest.mark.parametrize("text", ["", "{", "[1, 2]", "null", "\x00\x01", '"x"'])
def test_invalid_json_of_intrinsics(capture, text):
    folder = capture()
    write_json(folder, text)
    refused(folder, "json-invalid", "camera_intrinsic.json")


NO_MATRICES = [
    [[400, 0], [0, 400]],
    [[400, 0, 0], [0, 400, 0], [160, 120]],
    "400",
    [400, 0, 160, 0, 400, 120, 0, 0, 2],
    *([400, 0, 0, 0, value, 0, 160, 120, 1] for value in (None, "x", math.nan, math.inf)),
]


@pytest.mark.parametrize(
    ("values", "code", "part"),
    [
        ({"intrinsic_matrix": [400, 0, 0, 0, 400, 0, 160, 120]}, "intrinsics-invalid", "8"),
        ({"intrinsic_matrix": [0, 0, 0, 0, 400, 0, 160, 120, 1]}, "intrinsics-invalid", "fx=0"),
        ({"width": 0}, "intrinsics-invalid", "width"),
        ({"width": "wide"}, "intrinsics-invalid", "wide"),
        *(({"intrinsic_matrix": matrix}, "intrinsics-invalid", "intrinsic_matrix") for matrix in NO_MATRICES),
        *(({"height": height}, "intrinsics-invalid", "height") for height in (None, 240.5, math.inf, math.nan)),
        *(({"depth_scale": scale}, "depth-scale-invalid", "depth_scale") for scale in (0, -1000, math.nan, "mm", True)),
    ],
)
def test_intrinsics_with_a_wrong_value(capture, values, code, part):
    folder = capture(intrinsics=values)
    refused(folder, code, "camera_intrinsic.json", part)


@pytest.mark.parametrize("values", [None, {"width": 320, "height": 240}])
def test_missing_intrinsics(capture, values):
    folder = capture()
    (folder / "camera_intrinsic.json").unlink()
    if values:
        write_json(folder, json.dumps(values))
    refused(folder, "intrinsics-missing", "camera_intrinsic.json", "intrinsic_matrix")


def test_intrinsics_without_the_size_are_for_images_of_any(capture):
    folder = capture()
    write_json(folder, json.dumps({"intrinsic_matrix": [410, 0, 0, 0, 420, 0, 150, 110, 1]}))
    camera = frame_of(folder).camera
    assert (camera.fx, camera.width, camera.height) == (410, 320, 240)


def test_folder_without_frames(capture):
    refused(capture(frames=0), "folder-empty", "depth")


def test_empty_depth_folder(capture):
    folder = capture()
    (folder / "depth" / "000000.png").unlink()
    refused(folder, "folder-empty", str(folder / "depth"))


def test_two_depth_images_of_one_name(capture):
    folder = capture()
    put(folder / "depth" / "000000.tiff", np.ones((240, 320), np.float32))
    refused(folder, "names-clash", "000000.tiff")


# --- what cannot be read: one frame ------------------------------------------------------------------------------------


def test_depth_and_color_of_different_sizes(capture):
    folder = capture()
    put(folder / "color" / "000000.jpg", np.zeros((480, 640, 3), np.uint8))
    refused(folder, "color-size", "640x480", "320x240", "color=none", "intrinsic_depth.txt")
    assert open_capture(folder, options=ReadOptions(color="none")).frames[0].load().data.color is None


def test_depth_of_another_resolution_than_the_intrinsics(capture):
    folder = capture(color=False)
    put(folder / "depth" / "000000.png", np.zeros((480, 640), np.uint16))
    refused(folder, "intrinsics-size", "camera_intrinsic.json", "640x480", "320x240", "camera=[800")


def test_mask_as_jpeg(capture):
    folder = capture(mask=True)
    (folder / "mask" / "000000.png").unlink()
    put(folder / "mask" / "000000.jpg", np.zeros((240, 320), np.uint8))
    refused(folder, "mask-format", "000000.jpg", index=0)


@pytest.mark.parametrize("part", ["color", "mask"])
def test_depth_without_its_partner(capture, part):
    folder = capture(frames=3, mask=True)
    next(path for path in (folder / part).iterdir() if path.stem == "000001").unlink()
    opened = open_capture(folder)
    assert opened.frames[2].load().data is not None
    refused(folder, f"{part}-missing", "000001", index=1)


def test_color_without_its_depth_fails(capture):
    folder = capture(frames=3)
    (folder / "depth" / "000001.png").unlink()
    opened = open_capture(folder)
    assert [frame_ref.name for frame_ref in opened.frames] == ["000000", "000001", "000002"]
    refused(folder, "depth-missing", "000001", index=1)


@pytest.mark.parametrize("kept", [0.0, 0.02, 0.5, 0.98])
@pytest.mark.parametrize("part", ["depth", "color", "mask"])
def test_truncated_image(capture, part, kept, capfd):
    folder = capture(mask=True)
    (path,) = (folder / part).iterdir()
    cut(path, kept)
    refused(folder, "file-damaged" if kept else "file-empty", path.name, index=0)
    assert capfd.readouterr() == ("", "")


def test_png_with_a_flipped_byte(capture, capfd):
    folder = capture()
    path = folder / "depth" / "000000.png"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(bytes(data))
    refused(folder, "file-damaged", "000000.png", index=0)
    path.write_bytes(b"not an image at all")
    refused(folder, "image-unreadable", "000000.png", index=0)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("part", "image", "code", "parts"),
    [
        ("depth", np.full((240, 320), 200, np.uint8), "depth-type", ["8-bit"]),
        ("depth", np.zeros((240, 320, 3), np.uint8), "depth-shape", ["3"]),
        ("mask", np.zeros((480, 640), np.uint8), "mask-shape", ["640x480", "320x240"]),
    ],
)
def test_image_of_a_wrong_type_or_size(capture, part, image, code, parts):
    folder = capture(mask=True)
    put(folder / part / "000000.png", image)
    refused(folder, code, str(Path(part, "000000.png")), *parts, index=0)

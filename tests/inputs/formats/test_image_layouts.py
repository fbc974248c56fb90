"""Layouts of depth and color images as scripts write them: side by side, in sub-folders of any name, as arrays."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from builders.errors import refused, refuses
from builders.sample_scene import LENGTH, assert_detected, check, put, scene, units

from doo3d.inputs import ReadOptions, open_capture
from doo3d.inputs.support.listing import frame_key, role_of


def with_camera(folder: Path, name: str = "camera.json") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    fx, fy, cx, cy = scene().pinhole
    (folder / name).write_text(json.dumps({"fx": fx, "fy": fy, "cx": cx, "cy": cy, "width": 640, "height": 480}))
    return folder


def save_array(path: Path, array: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    np.save(path, array)


def put_any(path: Path, image: np.ndarray) -> None:
    (save_array if path.suffix == ".npy" else put)(path, image)


@pytest.mark.parametrize(
    ("depth", "color", "names"),
    [
        ("{}_depth.png", "{}_color.png", ["000", "001"]),
        ("frame_{}.depth.png", "frame_{}.color.jpg", ["frame_000", "frame_001"]),
        ("depth_{}.png", "rgb_{}.png", ["000", "001"]),
        ("Depth{}.tiff", "Color{}.bmp", ["000", "001"]),
        ("aligned_depth_to_color-{}.png", "color-{}.jpg", ["000", "001"]),
        ("{}.png", "{}.jpg", ["000", "001"]),
        ("{}_depth.npy", "{}_rgb.png", ["000", "001"]),
        ("{}_depth.npy", "{}_color.npy", ["000", "001"]),
        ("depth/{}.npy", "rgb/{}.png", ["000", "001"]),
        ("depth/{}.png", "rgb/{}.jpg", ["000", "001"]),
        ("depth_images/{}.png", "color_images/{}.png", ["000", "001"]),
        ("depth_raw/depth_{}.png", "rgb_raw/color_{}.png", ["depth_000", "depth_001"]),
        ("aligned_depth/{}.png", "images/{}.png", ["000", "001"]),
    ],
)
def test_detect_reads_the_layout(doo3d, tmp_path, depth, color, names):
    folder = with_camera(tmp_path / "capture")
    for i in ("000", "001"):
        metres = depth.endswith(".tiff")
        put_any(folder / depth.format(i), scene().depth.astype(np.float32) if metres else units(1000))
        put_any(folder / color.format(i), scene().color)
    opened = open_capture(folder)
    assert [frame_ref.name for frame_ref in opened.frames] == names
    check(opened.frames[1].load(), 1 / 1000, color=4)
    code, _, err = doo3d("detect", "capture", "-o", "out", "--frames", "0")
    assert code == 0, err
    chains = json.loads((tmp_path / "out" / f"{names[0]}.json").read_text())["chains"]
    assert len(chains) == 1
    assert abs(chains[0]["length"] - LENGTH) < 0.03


def test_depth_png_and_color_png(tmp_path):
    folder = with_camera(tmp_path, "intrinsics.json")
    put(folder / "depth.png", units(1000))
    put(folder / "color.png", scene().color)
    put(folder / "mask.png", scene().mask)
    opened = open_capture(folder)
    (frame_ref,) = opened.frames
    assert frame_ref.name == "depth"
    loaded = frame_ref.load()
    check(loaded, 1 / 1000)
    assert np.array_equal(loaded.mask, scene().mask)
    assert opened.notes == ["the camera is read from intrinsics.json"]


def test_one_depth_image_of_a_folder(doo3d, tmp_path):
    folder = with_camera(tmp_path)
    for i in range(2):
        put(folder / f"{i:03d}_depth.png", units(1000))
        put(folder / f"{i:03d}_color.png", scene().color)
    opened = open_capture(folder / "001_depth.png")
    assert [frame_ref.name for frame_ref in opened.frames] == ["001"]
    check(opened.frames[0].load(), 1 / 1000)


def test_images_of_16_bits_are_depth_and_not_photographs(doo3d, tmp_path):
    folder = tmp_path / "capture"
    for i in range(2):
        put(folder / f"{i}.png", units(1000))
    code, out, err = doo3d("detect", "capture", "-o", "out")
    assert (code, out) == (2, "")
    for part in ("2 depth images", "--camera FILE", "-c image", "[intrinsics-missing]"):
        assert part in err
    with_camera(tmp_path / "elsewhere")
    code, _, err = doo3d("detect", "capture", "-o", "out", "--camera", "elsewhere/camera.json")
    assert code == 0, err
    check_alone = open_capture(folder, camera=tmp_path / "elsewhere" / "camera.json").frames[0].load()
    assert check_alone.data.color is None
    assert check_alone.data.camera.fx == pytest.approx(scene().pinhole[0])


def test_photographs_stay_photographs(tmp_path):
    for i in range(9):
        put(tmp_path / f"{i}.png", scene().color)
    put(tmp_path / "9.png", units(1000))
    assert open_capture(tmp_path).format == "photos"
    assert len(open_capture(tmp_path).frames) == 10


def test_previews_of_depth_are_left_out(tmp_path):
    folder = with_camera(tmp_path)
    put(folder / "000_depth.png", units(1000))
    put(folder / "000_color.png", scene().color)
    put(folder / "000_depth_colormap.png", scene().color)
    put(folder / "depth_preview" / "000.png", scene().color)
    (frame_ref,) = open_capture(folder).frames
    check(frame_ref.load(), 1 / 1000)


def test_two_depth_images_for_one_frame(tmp_path):
    folder = with_camera(tmp_path)
    put(folder / "000_depth.png", units(1000))
    put(folder / "depth_000.png", units(1000))
    refused(folder, "names-clash", "000_depth.png", "depth_000.png")


def test_a_frame_without_its_color_fails_alone(tmp_path):
    folder = with_camera(tmp_path)
    for i in range(2):
        put(folder / f"{i}_depth.png", units(1000))
    put(folder / "1_color.png", scene().color)
    first, second = open_capture(folder).frames
    with refuses("color-missing", "frame 0"):
        first.load()
    check(second.load(), 1 / 1000)


def test_color_images_of_other_names_are_left_out_with_a_note(tmp_path):
    folder = with_camera(tmp_path)
    put(folder / "0_depth.png", units(1000))
    put(folder / "background_color.png", scene().color)
    opened = open_capture(folder)
    assert opened.frames[0].load().data.color is None
    assert "0_depth.png" in opened.notes[0]


def test_only_the_color_images_are_photographs_in_two_dimensions(tmp_path):
    put(tmp_path / "0_depth.png", units(1000))
    put(tmp_path / "0_color.png", scene().color)
    assert [frame_ref.name for frame_ref in open_capture(tmp_path, images_only=True).frames] == ["0_color"]
    put(tmp_path / "b" / "depth_images" / "0.png", units(1000))
    put(tmp_path / "b" / "color_images" / "0.png", scene().color)
    assert [frame_ref.source.parent.name for frame_ref in open_capture(tmp_path / "b", images_only=True).frames] == [
        "color_images"
    ]


def test_the_camera_may_lie_beside_the_folder_and_its_change_is_noticed(doo3d, tmp_path):
    with_camera(tmp_path, "camera.json")
    put(tmp_path / "scene" / "0_depth.png", units(1000))
    assert doo3d("detect", "scene", "-o", "out")[0] == 0
    assert "already" in doo3d("detect", "scene", "-o", "out")[2]
    (tmp_path / "camera.json").write_text(json.dumps({"K": [[500, 0, 320], [0, 500, 240], [0, 0, 1]]}))
    assert "already" not in doo3d("detect", "scene", "-o", "out", "--force")[2]


# --- arrays ------------------------------------------------------------------------------------------------------------


def array_file(tmp_path: Path, array: np.ndarray) -> Path:
    np.save(tmp_path / "depth.npy", array)
    return tmp_path / "depth.npy"


@pytest.mark.parametrize(
    ("array", "options"),
    [
        (lambda: units(1000), {}),
        (lambda: units(1000).astype(np.int32)[..., None], {}),
        (lambda: units(5000), {"depth_scale": 5000}),
        (lambda: scene().depth.astype(np.float32), {}),
        (lambda: units(1000).astype(np.float64), {"depth_scale": 1000}),
    ],
)
def test_depth_as_an_array(tmp_path, array, options):
    path = array_file(tmp_path, array())
    opened = open_capture(path, options=ReadOptions(camera=scene().pinhole, **options))
    loaded = opened.frames[0].load()
    assert np.abs(loaded.data.depth - scene().depth).max() < 1e-3
    put(tmp_path / "color.png", scene().color)
    loaded = open_capture(path, options=ReadOptions(camera=scene().pinhole, **options)).frames[0].load()
    check(loaded, 1e-3)
    assert_detected(loaded)


@pytest.mark.parametrize(
    ("array", "code", "part"),
    [
        (np.full((40, 50), 700.0), "depth-unit", "depth_scale=1000"),
        (np.full((2, 40, 50), 700, np.uint16), "depth-shape", "numpy.savez"),
        (np.full((40, 50), 7, np.uint8), "depth-type", "uint8"),
        (np.full((40, 50), 7j), "depth-type", "complex"),
    ],
)
def test_arrays_that_are_no_depth(tmp_path, array, code, part):
    (tmp_path / "depth").mkdir()
    np.save(tmp_path / "depth" / "0.npy", array)
    opened = open_capture(tmp_path, options=ReadOptions(camera=(50, 50, 25, 20)))
    with refuses(code, "0.npy", part):
        opened.frames[0].load()


def test_damaged_arrays(tmp_path):
    path = tmp_path / "depth" / "0.npy"
    save_array(path, units(1000))
    whole = path.read_bytes()
    frame_ref = open_capture(tmp_path, options=ReadOptions(camera=(50, 50, 25, 20))).frames[0]
    for content in (b"", b"no array", whole[:50], whole[:-1], whole.replace(b"(480, 640)", b"(480, 6e9)")):
        path.write_bytes(content)
        with refuses("file-damaged", "0.npy"):
            frame_ref.load()
    path.write_bytes(whole.replace(b"(480, 640), }  ", b"(480000,640000)"[:10] + b", }  "))
    np.save(path, np.array([{}], dtype=object), allow_pickle=True)
    with refuses("array-type", "0.npy"):
        frame_ref.load()


# --- names -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "role", "key"),
    [
        ("000_depth", "depth", "000"),
        ("frame_0.color", "color", "frame_0"),
        ("frame-000000.depth", "depth", "frame-000000"),
        ("aligned_depth_to_color_7", "depth", "7"),
        ("DepthImage12", "depth", "12"),
        ("depthwise", None, "depthwise"),
        ("0001", None, "0001"),
        ("depth_colormap_3", None, "colormap_3"),
        ("mask_3", "mask", "3"),
    ],
)
def test_role_and_frame_in_a_name(name, role, key):
    assert (role_of(name), frame_key(name)) == (role, key)

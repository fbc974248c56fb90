"""Photographs: every kind of image, matching of masks, and errors of damaged files."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders.errors import refuses

from doo3d.inputs import open_capture
from doo3d.types import Image

COLORS = np.array([[[200, 30, 30], [30, 180, 30]], [[30, 30, 190], [240, 240, 240]]], np.uint8)  # RGB, by quarters


def picture(height: int = 40, width: int = 60) -> np.ndarray:
    """Return an image (H, W, 3) uint8 RGB with red, green, blue and white quarters."""
    return cv2.resize(COLORS, (width, height), interpolation=cv2.INTER_NEAREST)


def put(path: Path, image: np.ndarray, *options: int) -> Path:
    """Write an image, RGB or grey."""
    path.parent.mkdir(parents=True, exist_ok=True)
    bgr = image[:, :, [2, 1, 0, *range(3, image.shape[2])]] if image.ndim == 3 else image
    path.write_bytes(cv2.imencode(path.suffix, bgr, options)[1].tobytes())
    return path


def exif(orientation: int) -> bytes:
    """Return TIFF-coded EXIF data with an orientation only."""
    return b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01" + struct.pack(">HH", orientation, 0) + b"\0\0\0\0"


def turn_jpeg(path: Path, orientation: int) -> Path:
    data = path.read_bytes()
    payload = b"Exif\0\0" + exif(orientation)
    path.write_bytes(data[:2] + b"\xff\xe1" + struct.pack(">H", len(payload) + 2) + payload + data[2:])
    return path


def turn_png(path: Path, orientation: int) -> Path:
    data, chunk = path.read_bytes(), b"eXIf" + exif(orientation)
    path.write_bytes(data[:33] + struct.pack(">I", len(chunk) - 4) + chunk + struct.pack(">I", zlib.crc32(chunk)) + data[33:])
    return path


def load(path: Path, index: int = 0, **how):
    return open_capture(path, images_only=True, **how).frames[index].load()


def color_of(path: Path) -> np.ndarray:
    data = load(path).data
    assert isinstance(data, Image)
    return data.color


def refused(path: Path, code: str, *parts: str, index: int = 0, **how) -> None:
    with refuses(code, *parts):
        load(path, index, **how)


# --- kinds of images ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tiff", ".bmp", ".webp"])
def test_formats(tmp_path, suffix):
    path = put(tmp_path / f"a b é{suffix}", picture())
    opened = open_capture(path)
    assert opened.format == "photos"
    assert [frame_ref.name for frame_ref in opened.frames] == ["a b é"]
    loaded = opened.frames[0].load()
    assert loaded.mask is None
    assert loaded.data.name == "a b é"
    assert loaded.data.color.dtype == np.uint8
    assert np.abs(loaded.data.color[[5, 5, 35, 35], [5, 55, 5, 55]].astype(int) - COLORS.reshape(4, 3)).max() <= 6


def test_format_is_detected_by_the_first_bytes(tmp_path):
    path = put(tmp_path / "a.png", picture()).rename(tmp_path / "photo.data")
    assert np.array_equal(color_of(path), picture())


@pytest.mark.parametrize("suffix", [".png", ".tiff"])
def test_grey_and_sixteen_bits(tmp_path, suffix):
    grey = picture()[:, :, 0]
    assert np.array_equal(color_of(put(tmp_path / f"grey{suffix}", grey)), np.dstack([grey] * 3))
    assert np.array_equal(color_of(put(tmp_path / f"deep{suffix}", picture().astype(np.uint16) * 257)), picture())
    assert np.array_equal(color_of(put(tmp_path / f"both{suffix}", grey.astype(np.uint16) * 257)), np.dstack([grey] * 3))


def test_sixteen_bits_are_scaled_by_their_range_and_rounded(tmp_path):
    values = np.array([[0, 128, 129, 257, 32768, 65535]], np.uint16)
    assert color_of(put(tmp_path / "a.png", values))[0, :, 0].tolist() == [0, 0, 1, 1, 128, 255]


def test_floats_from_0_to_1(tmp_path):
    assert np.abs(color_of(put(tmp_path / "a.tiff", picture().astype(np.float32) / 255)).astype(int) - picture()).max() <= 1
    refused(put(tmp_path / "b.tiff", picture().astype(np.float32)), "color-type", "b.tiff", "float32")
    refused(put(tmp_path / "c.tiff", np.full((4, 4), np.nan, np.float32)), "color-type", "c.tiff", "float32")


def test_alpha_is_ignored(tmp_path):
    clear = np.dstack([picture(), np.zeros((40, 60), np.uint8)])
    assert np.array_equal(color_of(put(tmp_path / "rgba.png", clear)), picture())


def test_palette_cmyk_and_color_profile(tmp_path):
    pil = pytest.importorskip("PIL.Image")
    whole = pil.fromarray(picture())
    whole.quantize(8).save(tmp_path / "palette.png")
    whole.convert("CMYK").save(tmp_path / "cmyk.jpg", quality=95)
    whole.save(tmp_path / "profile.png", icc_profile=b"\0" * 200)
    for name in ("palette.png", "cmyk.jpg", "profile.png"):
        assert np.abs(color_of(tmp_path / name)[[5, 35], [5, 55]].astype(int) - COLORS[[0, 1], [0, 1]]).max() <= 6, name


def test_one_pixel(tmp_path):
    assert color_of(put(tmp_path / "a.png", np.full((1, 1), 7, np.uint8))).tolist() == [[[7, 7, 7]]]


@pytest.mark.parametrize(("suffix", "turn"), [(".jpg", turn_jpeg), (".png", turn_png)])
def test_photographs_are_rotated_by_exif(tmp_path, suffix, turn):
    flat = put(tmp_path / f"a{suffix}", picture())
    stored = color_of(flat)
    assert np.array_equal(color_of(turn(flat, 6)), np.rot90(stored, -1))
    assert np.array_equal(color_of(turn(put(flat, picture()), 3)), stored[::-1, ::-1])


def test_data_appended_to_a_jpeg_is_ignored(tmp_path):
    path = put(tmp_path / "a.jpg", picture())
    before = color_of(path)
    path.write_bytes(path.read_bytes() + b"\0\0\0\x18ftypmp42" + bytes(range(256)) * 20)
    assert np.array_equal(color_of(path), before)


# --- masks -------------------------------------------------------------------------------------------------------------


def half() -> np.ndarray:
    return (np.arange(60)[None] < 30).repeat(40, axis=0).astype(np.uint8)


@pytest.fixture
def album(tmp_path):
    """Return a folder with the photographs 2, 9 and 10."""
    for name in ("10", "9", "2"):
        put(tmp_path / "album" / f"{name}.png", picture())
    return tmp_path / "album"


def test_a_folder_of_photographs(album):
    (album / "notes.txt").write_text("x")
    opened = open_capture(album)
    assert opened.format == "photos"
    assert [frame_ref.name for frame_ref in opened.frames] == ["2", "9", "10"]
    assert all(frame_ref.load().mask is None for frame_ref in opened.frames)


@pytest.mark.parametrize("folder", ["mask", "masks"])
def test_masks_beside_the_photographs(album, folder):
    for name in ("2", "9", "10"):
        put(album / folder / f"{name}.png", half() * int(name))
    for frame_ref in open_capture(album).frames:
        assert np.array_equal(frame_ref.load().mask, half() > 0)
    assert np.array_equal(load(album / "9.png").mask, half() > 0)


def test_masks_with_other_names_match_by_order(album):
    for name in ("m1", "m2", "m3"):
        put(album / "mask" / f"{name}.png", half())
    assert all(frame_ref.load().mask is not None for frame_ref in open_capture(album).frames)
    assert load(album / "9.png").mask is None


def test_photographs_without_mask_and_masks_without_photograph(album):
    for name in ("2", "9", "11"):
        put(album / "mask" / f"{name}.png", half())
    opened = open_capture(album)
    assert [frame_ref.name for frame_ref in opened.frames] == ["2", "9", "10", "11"]
    assert load(album, 0).mask is not None
    refused(album, "mask-missing", "10.png", index=2)
    refused(album, "color-missing", "11.png", index=3)
    assert load(album / "10.png").mask is None


def test_mask_is_rotated_by_its_own_exif(tmp_path):
    turn_jpeg(put(tmp_path / "a.jpg", picture()), 6)
    turn_png(put(tmp_path / "mask" / "a.png", half()), 6)
    assert np.array_equal(load(tmp_path).mask, np.rot90(half(), -1) > 0)
    put(tmp_path / "mask" / "a.png", np.rot90(half(), -1))
    assert np.array_equal(load(tmp_path).mask, np.rot90(half(), -1) > 0)
    put(tmp_path / "mask" / "a.png", half())
    refused(tmp_path, "mask-shape", "a.png", "60x40", "40x60", "EXIF")


def test_mask_of_another_size_and_as_jpeg(album):
    put(album / "mask" / "2.png", half()[:30])
    put(album / "mask" / "9.jpg", half())
    put(album / "mask" / "10.png", half())
    refused(album, "mask-shape", "2.png", "60x30", "60x40")
    refused(album, "mask-format", "9.jpg", index=1)
    assert load(album, 2).mask is not None


def test_external_masks(album, tmp_path, capture):
    mask = put(tmp_path / "m.png", half())
    assert np.array_equal(load(album / "2.png", masks=mask).mask, half() > 0)
    refused(album, "frame-count", "m.png", "album has 3", masks=mask)
    for name in ("2", "9"):
        put(tmp_path / "other" / f"{name}.png", 1 - half())
    put(album / "mask" / "2.png", half())
    assert np.array_equal(load(album, masks=tmp_path / "other").mask, half() == 0)
    refused(album, "mask-missing", "other", "10", index=2, masks=tmp_path / "other")
    refused(album, "file-missing", "nowhere", masks=tmp_path / "nowhere")
    (tmp_path / "none").mkdir()
    refused(album, "mask-missing", str(tmp_path / "none"), masks=tmp_path / "none")
    folder = capture(mask=True)
    put(tmp_path / "all.png", np.ones((240, 320), np.uint8))
    assert open_capture(folder, masks=tmp_path / "all.png").frames[0].load().mask.all()
    np.savez(tmp_path / "c.npz", points=np.random.default_rng(0).normal(size=(9, 3)))
    refused(tmp_path / "c.npz", "mask-on-cloud", "m.png", masks=mask)


# --- folders with depth ------------------------------------------------------------------------------------------------


def test_color_of_a_recorded_folder(capture):
    folder = capture(frames=2, mask=True)
    put(folder / "preview.png", picture())
    assert open_capture(folder).format == "folder"
    opened = open_capture(folder, images_only=True)
    assert opened.format == "photos"
    assert [frame_ref.name for frame_ref in opened.frames] == ["000000", "000001"]
    loaded = opened.frames[1].load()
    assert isinstance(loaded.data, Image)
    assert loaded.mask.any()
    assert load(folder / "color" / "000001.jpg").mask.any()


def test_color_of_a_recorded_folder_is_not_rotated(capture):
    folder = capture(mask=True)
    turn_jpeg(folder / "color" / "000000.jpg", 6)
    assert load(folder).data.color.shape == (240, 320, 3)


def test_depth_and_intrinsics_are_not_needed(capture):
    folder = capture(mask=True)
    for path in (folder / "depth" / "000000.png", folder / "camera_intrinsic.json"):
        path.unlink()
    (folder / "depth").rmdir()
    assert load(folder).mask.any()


def test_recorded_folder_without_color_is_still_a_folder(capture):
    assert open_capture(capture(color=False), images_only=True).format == "folder"


# --- what cannot be read -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kept", [0.0, 0.02, 0.5, 0.98])
@pytest.mark.parametrize("suffix", [".jpg", ".png"])
def test_truncated(tmp_path, suffix, kept, capfd):
    rng = np.random.default_rng(0)
    path = put(tmp_path / f"a{suffix}", rng.integers(0, 255, (40, 60, 3), dtype=np.uint8))
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * kept)])
    refused(path, "file-damaged" if kept else "file-empty", path.name)
    assert capfd.readouterr() == ("", "")


def test_thumbnail_is_not_the_end_of_a_jpeg(tmp_path):
    rng = np.random.default_rng(0)
    path = put(tmp_path / "a.jpg", rng.integers(0, 255, (40, 60, 3), dtype=np.uint8))
    data = path.read_bytes()
    note = b"Exif\0\0" + data  # with an end marker of its own
    path.write_bytes(data[:2] + b"\xff\xe1" + struct.pack(">H", len(note) + 2) + note + data[2 : len(data) // 2])
    refused(path, "file-damaged", "a.jpg")


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (b"not an image", "image-unreadable"),
        (b"\x89PNG\r\n\x1a\n" + b"x" * 100, "file-damaged"),
        (b"II*\0" + bytes(40), "image-unreadable"),
        (b"BM" + bytes(60), "image-unreadable"),
    ],
)
def test_not_an_image(tmp_path, content, code, capfd):
    path = tmp_path / "a.png"
    path.write_bytes(content)
    refused(path, code, "a.png")
    assert capfd.readouterr() == ("", "")


def test_heic(tmp_path):
    (tmp_path / "a.heic").write_bytes(b"\0\0\0\x18ftypheic" + bytes(100))
    refused(tmp_path / "a.heic", "encoding-unsupported", "a.heic", "HEIC")


def test_two_photographs_of_one_stem(album):
    put(album / "9.jpg", picture())
    refused(album, "names-clash", "9.jpg")


def test_photograph_of_16_bits_with_few_values(tmp_path):
    image = np.full((40, 60), 80, np.uint16)
    image[20, 5:55] = 560
    assert cv2.imwrite(str(tmp_path / "a.tif"), image)
    capture = open_capture(tmp_path / "a.tif")
    color = capture[0].load().data.color
    assert (color[20, 5:55] == 255).all()
    assert (color[21] == 0).all()
    assert any("values from 80 to 560" in note for note in capture.notes)
    assert cv2.imwrite(str(tmp_path / "b.tif"), image * 100)
    capture = open_capture(tmp_path / "b.tif")
    assert capture[0].load().data.color.max() == round(56000 * 255 / 65535)
    assert not capture.notes

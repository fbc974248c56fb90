"""Images in bags: every encoding of depth and color, raw and compressed."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

pytest.importorskip("rosbags")
from builders.bags import KINDS, SECOND, packed_depth, png
from builders.errors import refuses
from test_bags import COLOR, DEPTH, HEIGHT, WIDTH, frames, named, script, slope, tint


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("big", [0, 1])
def test_float_metres_with_nan_and_padded_rows(tmp_path, kind, big):
    depth = slope().astype(np.float32) / 1000
    depth[2, 3] = np.nan
    made = script(kind, frames=0)
    made.image(DEPTH, SECOND, depth, "32FC1", pad=8, big=big)
    made.image("/camera/other/image_raw", SECOND, tint(), "rgb8", pad=5)
    (frame,) = frames(made.write(tmp_path / named(kind)))
    assert np.array_equal(frame.depth, np.nan_to_num(depth))
    assert np.array_equal(frame.color, tint())


def test_big_endian_millimetres(tmp_path):
    made = script(frames=0)
    made.image(DEPTH, SECOND, slope(), "16UC1", big=1)
    assert np.array_equal(frames(made.write(tmp_path / "a.bag"))[0].depth, (slope() / np.float32(1000)).astype(np.float32))


def bayer(image: np.ndarray, pattern: str) -> np.ndarray:
    """Return a Bayer image (H, W) of an image (H, W, 3) RGB; `pattern` has the colors of 2x2 pixels row by row."""
    channels = np.array(["rgb".index(letter) for letter in pattern]).reshape(2, 2)
    where = np.tile(channels, (HEIGHT // 2, WIDTH // 2))
    return np.take_along_axis(image, where[..., None], axis=2)[..., 0]


ENCODINGS = ["rgb8", "bgr8", "rgba8", "bgra8", "8UC3", "mono8", "yuv422", "yuv422_yuy2"]
ENCODINGS += [f"bayer_{pattern}8" for pattern in ("rggb", "bggr", "gbrg", "grbg")]


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_color_encodings(tmp_path, encoding):
    whole = tint(50)
    data = whole
    if encoding.startswith("bayer"):
        data = bayer(whole, encoding[6:10])
    elif encoding == "mono8":
        data = whole[:, :, 0]
    elif encoding in ("bgr8", "8UC3", "bgra8"):
        data = whole[:, :, ::-1]
    elif encoding.startswith("yuv"):
        to_yuv = np.array([[0.257, 0.504, 0.098], [-0.148, -0.291, 0.439], [0.439, -0.368, -0.071]])  # BT.601, 16 to 235
        yuv = np.rint(whole @ to_yuv.T + (16, 128, 128)).astype(np.uint8)
        chroma = np.where(np.arange(WIDTH) % 2 == 0, yuv[:, :, 1], yuv[:, :, 2])
        data = np.stack([yuv[:, :, 0], chroma] if encoding.endswith("yuy2") else [chroma, yuv[:, :, 0]], axis=2)
    if encoding.endswith("a8"):
        data = np.dstack([data, np.full(data.shape[:2], 9, np.uint8)])
    made = script(frames=1, color=False)
    made.image(COLOR, SECOND, data, encoding)
    color = frames(made.write(tmp_path / "a.bag"))[0].color
    inner = (slice(2, -2), [3, 4, 11, 12])
    expected = np.repeat(data[:, :, None], 3, axis=2) if encoding == "mono8" else whole
    assert np.abs(color[inner].astype(int) - expected[inner]).max() <= (4 if encoding.startswith("yuv") else 0)


@pytest.mark.parametrize("kind", KINDS)
def test_compressed_color_and_depth(tmp_path, kind):
    made = script(kind, frames=0)
    made.packed(f"{DEPTH}/compressedDepth", SECOND, packed_depth(slope()), "16UC1; compressedDepth png")
    made.packed(f"{COLOR}/compressed", SECOND, png(tint(3)[:, :, ::-1]), "rgb8; png compressed bgr8")
    (frame,) = frames(made.write(tmp_path / named(kind)))
    assert np.array_equal(frame.depth, (slope() / np.float32(1000)).astype(np.float32))
    assert np.array_equal(frame.color, tint(3))


def test_depth_as_16_bit_png_and_preview_of_depth(tmp_path):
    made = script(frames=0, color=False)
    made.packed(f"{DEPTH}/compressed", SECOND, png(slope()), "16UC1; png compressed")
    assert np.array_equal(frames(made.write(tmp_path / "a.bag"))[0].depth, (slope() / np.float32(1000)).astype(np.float32))
    made.packed("/preview/compressed", SECOND, png(tint()), "bgr8; jpeg compressed bgr8")
    with refuses("depth-type", "uint8", "(12, 16, 3)"):
        frames(made.write(tmp_path / "b.bag"), depth_topic="/preview/compressed", color_topic="none", camera=(20, 20, 8, 6))


def test_compressed_color_as_jpeg(tmp_path):
    made = script(frames=1, color=False)
    jpeg = cv2.imencode(".jpg", np.full((HEIGHT, WIDTH, 3), (30, 60, 200), np.uint8))[1].tobytes()
    made.packed(f"{COLOR}/compressed", SECOND, jpeg, "rgb8; jpeg compressed bgr8")
    assert np.abs(frames(made.write(tmp_path / "a.bag"))[0].color.astype(int) - (200, 60, 30)).max() <= 4


def test_inverse_depth_is_exact_to_its_quantization(tmp_path):
    """Parameters as in the transport's defaults: depth_quantization 100, depth_max 10 m."""
    depth = slope().astype(np.float32) / 1000
    depth[0, 0] = np.nan
    a = 100 * (100 + 1.0)
    b = 1.0 - a / 10.0
    made = script(frames=0, color=False)
    made.packed(f"{DEPTH}/compressedDepth", SECOND, packed_depth(depth, a, b), "32FC1; compressedDepth png")
    read = frames(made.write(tmp_path / "a.bag"))[0].depth
    assert read[0, 0] == 0
    step = depth**2 / a
    assert (np.abs(read - depth)[depth > 0] <= 1.01 * step[depth > 0]).all()

"""Depth in bags that is compressed: RVL is read, JPEG is not, and what is not read is said."""

from __future__ import annotations

import struct

import cv2
import numpy as np
import pytest

pytest.importorskip("rosbags")
from builders.bags import KINDS, SECOND, packed_depth, png, rvl
from builders.errors import refused, refuses
from test_bags import COLOR, DEPTH, frames, named, script, slope, tint

from doo3d.config import load_config
from doo3d.errors import InputError
from doo3d.guard.limits import Limits, limited
from doo3d.inputs import open_capture
from doo3d.inputs.bag.rvl import decode_rvl
from doo3d.runs.run import run

ALIGNED = "/camera/aligned_depth_to_color/image_raw"


@pytest.mark.parametrize("values", ["noise", "zeros", "full", "single", "ends with a reading"])
def test_images_come_back_as_they_were(values):
    rng = np.random.default_rng(0)
    image = rng.integers(0, 2**16, (47, 61)).astype(np.uint16)
    if values == "zeros":
        image[:] = 0
    elif values == "single":
        image[rng.random(image.shape) < 0.5] = 0
    elif values != "full":
        image[10:20] = 0
        image[-1, -1] = 0 if values == "noise" else 9
    assert np.array_equal(decode_rvl(rvl(image)), image)


def test_damaged_images():
    """Cut off anywhere, or with any byte changed, it is an error or an image of its size."""
    data, rng = rvl(slope()), np.random.default_rng(1)
    for length in range(0, len(data), 7):
        with refuses("message-damaged"):
            decode_rvl(data[:length])
    for at in rng.integers(8, len(data), 200).tolist():
        changed = bytearray(data)
        changed[at] ^= int(rng.integers(1, 256))
        outcome: object = slope().shape
        try:
            outcome = decode_rvl(bytes(changed)).shape
        except InputError as error:
            outcome = error.code
        assert outcome in (slope().shape, "message-damaged")


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (struct.pack("<ii", 1 << 20, 1 << 20) + bytes(8), "size-too-large"),
        (struct.pack("<ii", -4, 4) + bytes(8), "message-damaged"),
        (struct.pack("<ii", 4, 4) + b"\xff" * 64, "message-damaged"),
        (struct.pack("<ii", 4, 4) + bytes(1 << 20), "message-damaged"),  # runs of nothing
    ],
)
def test_images_made_to_do_harm(data, code):
    with limited(Limits(max_pixels=1 << 20)), refuses(code):
        decode_rvl(data)


@pytest.mark.parametrize("kind", KINDS)
def test_bag_with_rvl(tmp_path, kind):
    made = script(kind, frames=0)
    made.packed(f"{DEPTH}/compressedDepth", SECOND, packed_depth(slope(), pack=rvl), "16UC1; compressedDepth rvl")
    made.packed(f"{COLOR}/compressed", SECOND, png(tint(3)[:, :, ::-1]), "rgb8; png compressed bgr8")
    (frame,) = frames(made.write(tmp_path / named(kind)))
    assert np.array_equal(frame.depth, (slope() / np.float32(1000)).astype(np.float32))
    assert np.array_equal(frame.color, tint(3))


def test_metres_in_rvl(tmp_path):
    depth = slope().astype(np.float32) / 1000
    made = script(frames=0, color=False)
    data = packed_depth(depth, 10100.0, -1009.0, pack=rvl)
    made.packed(f"{DEPTH}/compressedDepth", SECOND, data, "32FC1; compressedDepth rvl")
    assert np.abs(frames(made.write(tmp_path / "a.bag"))[0].depth - depth).max() < 0.001


def jpeg() -> bytes:
    return cv2.imencode(".jpg", (slope() >> 4).astype(np.uint8))[1].tobytes()


@pytest.mark.parametrize("color", [False, True])
@pytest.mark.parametrize(
    ("topic", "data", "how", "words"),
    [
        (f"{ALIGNED}/compressed", jpeg(), "16UC1; jpeg compressed mono8", "8 bits (JPEG)"),
        (f"{ALIGNED}/compressedDepth", bytes(99), "16UC1; compressedDepth new", "compressedDepth new"),
    ],
)
def test_depth_that_is_not_read_is_named(tmp_path, color, topic, data, how, words):
    made = script(frames=0)
    made.packed(topic, SECOND, data, how)
    if color:
        made.image(COLOR, SECOND, tint(), "rgb8")
    path = made.write(tmp_path / "a.bag")
    if not color:
        refused(path, "frames-missing", topic, words)
        return
    capture = open_capture(path)
    assert words in capture.no_depth
    assert np.array_equal(capture[0].load().data.color, tint())
    with refuses("mode-needs-depth", topic, words):
        run(capture, tmp_path / "out", load_config("default"))
    assert not open_capture(path, options=capture.options.model_copy(update={"depth_topic": "none"})).no_depth


def test_requested_topic_that_cannot_be_read_says_why(tmp_path):
    made = script(frames=1)
    made.packed("/other/compressedDepth", SECOND, bytes(99), "16UC1; compressedDepth new")
    with refuses("encoding-unsupported", "/other/compressedDepth", "neither PNG nor RVL"):
        frames(made.write(tmp_path / "a.bag"), depth_topic="/other/compressedDepth")

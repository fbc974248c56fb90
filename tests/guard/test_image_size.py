"""The size that an image announces: of several in a file the largest, and none where the decoder may take another."""

import itertools
import struct
import sys

import cv2
import numpy as np
import pytest
from builders.errors import refuses

from doo3d.guard.image_size import announced_size
from doo3d.inputs.support import images
from doo3d.inputs.support.images import decode_image

SMALL, LARGE = 10, 30_000  # px: 900 million pixels are more than is allowed
SHORT, LONG, SIGNED = 3, 4, 9  # types of values in a TIFF


def tiff(*sides: tuple[int, int, int]) -> bytes:
    """A TIFF of one strip; `sides` are (tag, type, value) of 256 and 257, width and height."""
    rest = [
        (258, SHORT, 8),
        (259, SHORT, 1),
        (262, SHORT, 1),
        (273, LONG, 200),
        (277, SHORT, 1),
        (278, LONG, LARGE),
        (279, LONG, 16),
    ]
    entries = b"".join(struct.pack("<HHII", tag, kind, 1, value) for tag, kind, value in (*sides, *rest))
    return b"II*\0" + struct.pack("<IH", 8, len(sides) + len(rest)) + entries + bytes(300)


def both(kind: int, *values: int) -> list[tuple[int, int, int]]:
    return [(tag, kind, value) for tag, value in itertools.product((256, 257), values)]


def jp2(box_bytes: int, codestream_only: bool = False) -> bytes:
    """A JPEG 2000 file whose codestream has LARGE sides, with a box of so many bytes before its header."""
    data = bytearray(cv2.imencode(".jp2", np.zeros((64, 64, 3), np.uint8))[1].tobytes())
    stream = data.index(b"\xffO\xffQ")
    struct.pack_into(">8I", data, stream + 8, LARGE, LARGE, 0, 0, LARGE, LARGE, 0, 0)
    header = data.index(b"jp2h") - 4
    padded = bytes(data[:header]) + struct.pack(">I4s", 8 + box_bytes, b"free") + bytes(box_bytes) + bytes(data[header:])
    return bytes(data[stream:]) if codestream_only else padded


TWO_SIZES = {
    "comment of Radiance": b"#?RADIANCE\n# -Y 10 +X 10\nFORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 30000\n" + bytes(100),
    "Radiance without blanks": b"#?RADIANCE\n# -Y 10 +X 10\nFORMAT=32-bit_rle_rgbe\n\n-Y30000+X30000\n" + bytes(100),
    "tags of TIFF, the small first": tiff(*both(LONG, SMALL, LARGE)),
    "tags of TIFF, the large first": tiff(*both(LONG, LARGE, SMALL)),
    "signed tags of TIFF": tiff(*both(SIGNED, LARGE)),
    "tiles of TIFF": tiff(*both(LONG, SMALL), (322, LONG, LARGE), (323, LONG, LARGE)),
    "comment of PGM that ends with CR": b"P5\n# x\r30000 30000 255 \n10 10\n255\n" + bytes(100),
    "sides of PAM the other way round": b"P7\nHEIGHT 30000\nWIDTH 30000\nDEPTH 1\nMAXVAL 255\nENDHDR\n" + bytes(100),
    "padded JPEG 2000": jp2(70_000),
    "codestream of JPEG 2000": jp2(0, codestream_only=True),
}
NOT_SURE = {
    "long header of Radiance": b"#?RADIANCE\n"
    + b"# x\n" * 20_000
    + b"FORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 30000\n"
    + bytes(100),
    "long comment of PGM": b"P5\n#" + b"x" * 70_000 + b"\n30000 30000\n255\n" + bytes(100),
    "float tags of TIFF": tiff(*both(11, LARGE)),
    "JPEG of empty segments": b"\xff\xd8\xff" + b"\xff\xe0\0\2" * 70_000 + bytes(100),
}


@pytest.mark.parametrize("name", TWO_SIZES)
def test_the_largest_size_counts(name, tmp_path):
    assert announced_size(TWO_SIZES[name]) == (LARGE, LARGE)
    with refuses("size-too-large", "announces 30000x30000 pixels"):
        decode_image(tmp_path / "a.png", cv2.IMREAD_UNCHANGED, TWO_SIZES[name])


@pytest.mark.parametrize("name", NOT_SURE)
def test_an_image_of_no_sure_size_is_not_decoded(name, tmp_path, monkeypatch):
    assert announced_size(NOT_SURE[name]) is None
    monkeypatch.setattr(cv2, "imdecode", None)
    with refuses("file-damaged" if name.startswith("JPEG") else "image-unreadable", "a.png"):
        decode_image(tmp_path / "a.png", cv2.IMREAD_UNCHANGED, NOT_SURE[name])


@pytest.mark.skipif(sys.platform != "linux", reason="the memory of a process is bounded on Linux only")
def test_an_avif_whose_data_are_larger_than_its_header_says(tmp_path, monkeypatch):
    try:
        data = bytearray(cv2.imencode(".avif", np.zeros((4000, 4000, 3), np.uint8), [cv2.IMWRITE_AVIF_SPEED, 9])[1].tobytes())
    except cv2.error:
        pytest.skip("this OpenCV writes no AVIF")
    assert decode_image(tmp_path / "a.avif", cv2.IMREAD_COLOR, bytes(data)).shape == (4000, 4000, 3)
    struct.pack_into(">II", data, data.index(b"ispe") + 8, 64, 64)
    monkeypatch.setattr(images, "_BASE_BYTES", 1 << 24)
    with refuses("image-unreadable", "a.avif"):
        decode_image(tmp_path / "a.avif", cv2.IMREAD_COLOR, bytes(data))

"""Hostile and damaged files end in one sentence from the shell: no traceback, no abort, no memory without bound."""

from __future__ import annotations

import io
import itertools
import json
import struct
import sys
import time
import zipfile
import zlib

import laspy
import numpy as np
import pytest
from builders.errors import code_in, refused

from doo3d.guard.image_size import announced_size
from doo3d.guard.isolation import isolated
from doo3d.inputs import FrameRef, open_capture

BOMB = "a: &a [0,0,0,0,0,0,0,0,0]\n" + "\n".join(
    f"{b}: &{b} [{','.join([f'*{a}'] * 9)}]" for a, b in itertools.pairwise("abcdefghi")
)


def failed(doo3d, *args) -> tuple[str, str]:
    """The only failed frame's sentence, and its code, or those of the command, which ends with 2."""
    status, _, err = doo3d("detect", *args, "-o", "out")
    assert status == 2, err
    assert "Traceback" not in err
    lines = [line for line in err.splitlines() if " [" in line] or err.splitlines()
    return lines[0], code_in(lines[0])


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width: int, height: int) -> bytes:
    """A valid PNG of 16 bits that is all zero, compressed a thousandfold."""
    squeeze = zlib.compressobj(9)
    row = bytes(1 + 2 * width)
    data = b"".join(squeeze.compress(row) for _ in range(height)) + squeeze.flush()
    header = struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def laz(path, points=5000):
    header = laspy.LasHeader(point_format=2, version="1.2")
    header.scales = [1e-4] * 3
    cloud = laspy.LasData(header)
    cloud.xyz = np.random.default_rng(0).normal(size=(points, 3))
    cloud.write(str(path))
    return path


def test_a_png_that_unpacks_to_a_gigabyte(doo3d, capture):
    folder = capture(frames=2)
    (folder / "depth" / "000000.png").write_bytes(png(25_000, 20_000))
    status, out, err = doo3d("detect", folder, "-o", "out")
    assert status == 1
    assert "input.max_pixels" in out + err
    assert "--set input.max_pixels=500000000" in out + err
    assert "size-too-large" in (folder.parent / "out" / "manifest.json").read_text()
    assert doo3d("detect", capture("other"), "-o", "out2", "--set", "input.max_pixels=100")[0] == 2


def test_the_limit_of_points_is_a_setting(doo3d, tmp_path):
    np.savetxt("a.xyz", np.random.default_rng(0).normal(size=(500, 3)))
    laz(tmp_path / "a.laz")
    for name in ("a.xyz", "a.laz"):
        assert failed(doo3d, name, "--set", "input.max_points=400")[1] == "size-too-large"
    with zipfile.ZipFile("a.npz", "w", zipfile.ZIP_DEFLATED) as archive, archive.open("points.npy", "w") as file:
        np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": (10**9, 3)})
        file.write(bytes(1 << 20))
    assert failed(doo3d, "a.npz")[1] == "size-too-large"
    (tmp_path / "a.ply").write_text("ply\nformat ascii 1.0\nelement vertex 9999999999\nproperty float x\nend_header\n1\n")
    assert failed(doo3d, "a.ply")[1] == "size-too-large"


def test_a_laz_whose_decompressor_aborts_is_one_failed_frame(doo3d, tmp_path):
    (tmp_path / "clouds").mkdir()
    for name in "abc":
        laz(tmp_path / "clouds" / f"{name}.laz")
    path = tmp_path / "clouds" / "b.laz"
    data = bytearray(path.read_bytes())
    at = int.from_bytes(data[96:100], "little")
    table = int.from_bytes(data[at : at + 8], "little")
    data[table + 4 : table + 8] = b"\xff\xff\xff\xff"  # chunks in the table: 58 GB for their offsets
    path.write_bytes(data)
    for _ in range(2):  # and at each resume
        status, out, err = doo3d("detect", "clouds", "-o", "out", "--retry-failed")
        frames = json.loads((tmp_path / "out" / "manifest.json").read_text())["frames"] if status == 1 else []
        assert [frame["status"] for frame in frames] == ["ok", "failed", "ok"], (status, out, err)
        assert frames[1]["code"] in ("file-damaged", "size-too-large")
        assert "b.laz" in frames[1]["error"]


def _abort() -> None:
    import os

    os.abort()


def _fault() -> None:
    import os
    import signal

    os.write(2, b"[ WARN] what a library says about what it can read\n")
    os.kill(os.getpid(), signal.SIGSEGV)


def _panic() -> None:
    raise SystemExit("no Exception")


def test_an_abort_and_what_is_no_exception_end_the_call_only():
    from builders.errors import refuses

    with refuses("file-damaged", "x.laz", "SIGABRT"):
        isolated(_abort, where="x.laz")
    with refuses("file-damaged", "x.laz", "no Exception"):
        isolated(_panic, where="x.laz")
    with refuses("onnx-unreadable", "x.onnx", "SIGSEGV" if sys.platform != "win32" else "exit code"):
        isolated(_fault, where="x.onnx", code="onnx-unreadable")
    with refuses("file-damaged", "x.laz", "no answer within 0.5 s"):
        isolated(time.sleep, 60, where="x.laz", seconds=0.5)
    assert isolated(max, 2, 3, where="", seconds=60) == 3


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (BOMB, "aliases"),
        ("[" * 100_000, "nest"),  # libyaml or PyYAML, whichever comes first
        ("a: " + "{a: " * 5000, "nested"),
        ("merge: {chains: " + "9" * 5000 + "}", "5000"),
        ("merge: {max_cost: 0x" + "f" * 350 + "}", "beyond"),
        ("a: &a [*a]", "itself"),
        ("when: 2026-99-99", "month"),
        ("a: !!int ''", ""),
    ],
)
def test_yaml_of_a_configuration(doo3d, tmp_path, capture, text, parts):
    (tmp_path / "mine.yaml").write_text(text)
    sentence, code = failed(doo3d, capture(), "-c", "mine.yaml")
    assert code == "yaml-invalid"
    assert parts in sentence
    assert len(sentence) < 1000
    assert failed(doo3d, capture("two"), "--set", f"merge.chains={text}")[1] == "yaml-invalid"


@pytest.mark.parametrize("text", ["[" * 100_000, '{"K": ' * 900 + "1" + "}" * 900, '{"fx": ' + "9" * 5000 + "}", "\udc80"])
def test_json_beside_images(doo3d, capture, text):
    folder = capture()
    (folder / "camera_intrinsic.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    assert failed(doo3d, folder)[1] == "json-invalid"


@pytest.mark.parametrize("rows", [[[1, 2], [3]], "K", [[1e400] * 3] * 3, [[10**350, 0, 1], [0, 1, 1], [0, 0, 1]], {"a": 1}])
def test_a_camera_matrix_that_is_none(doo3d, capture, rows):
    folder = capture(intrinsics={"intrinsic_matrix": rows})
    assert failed(doo3d, folder)[1] in ("intrinsics-invalid", "intrinsics-missing", "json-invalid")


def test_a_null_byte_in_a_path(tmp_path, capture):

    refused("a\0b", "file-missing")
    folder = capture()
    (folder / "depth.txt").write_text("1.0 depth/a\0b.png\n")
    refused(folder, "file-damaged", index=0)


def test_segments_too_short_for_the_unit(doo3d, capture):
    """A length in metres in the 2-D mode, where it is in pixels."""
    sentence, code = failed(doo3d, capture(mask=True), "-c", "image", "--set", "fit.segment_length=0.001")
    assert code == "value-out-of-bounds"
    assert "fit.segment_length" in sentence


def test_arrays_that_no_camera_gives():
    from builders.errors import refuses

    from doo3d import Camera, Cloud, Frame

    for focal in (1e300, 1e-300, -1.0):
        with refuses("intrinsics-invalid"):
            Camera(focal, 60, 2, 2, 4, 4)
    depth = np.array([[1.0, 1e30], [1e-30, np.inf]])
    assert Frame(None, depth, Camera(9, 9, 1, 1, 2, 2)).depth.tolist() == [[1, 0], [0, 0]]
    assert len(Cloud(np.array([[0, 0, 1.0], [1e200, 0, 1], [np.nan, 0, 1]])).points) == 1
    flipped = np.asfortranarray(np.ones((4, 6)))[::-1]
    assert Frame(None, flipped, Camera(9, 9, 1, 1, 6, 4)).depth.flags.c_contiguous


def test_the_limits_stay_with_a_frame(tmp_path):
    from builders.errors import refuses

    from doo3d.guard.limits import Limits

    np.savetxt(tmp_path / "a.xyz", np.random.default_rng(0).normal(size=(500, 3)))
    frame: FrameRef = open_capture(tmp_path / "a.xyz", limits=Limits(max_points=400)).frames[0]
    with refuses("size-too-large", "a.xyz"):
        frame.load()
    assert len(open_capture(tmp_path / "a.xyz").frames[0].load().data.points) == 500


@pytest.mark.parametrize(
    "suffix", [".png", ".jpg", ".tif", ".bmp", ".webp", ".jp2", ".ppm", ".exr", ".gif", ".hdr", ".ras", ".avif"]
)
def test_the_size_in_the_header_of_an_image(suffix):
    import cv2

    image = np.zeros((31, 47, 3), np.float32 if suffix in (".exr", ".hdr") else np.uint8)
    try:
        done, data = cv2.imencode(suffix, image)
    except cv2.error:
        done = False
    if not done:
        pytest.skip(f"this OpenCV writes no {suffix}")
    assert announced_size(data.tobytes()) == (47, 31)
    for end in range(64):
        announced_size(data.tobytes()[:end])


def test_an_array_of_a_billion_frames(doo3d, tmp_path):
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": "|u1", "fortran_order": False, "shape": (10**9, 1, 1)})
    with zipfile.ZipFile("a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("depth.npy", "w") as file:
            file.write(buffer.getvalue())
            for _ in range(20):
                file.write(bytes(50_000_000))
        np.save(buffer := io.BytesIO(), np.eye(3))
        archive.writestr("K.npy", buffer.getvalue())
    assert failed(doo3d, "a.npz")[1] == "array-too-large"


@pytest.mark.parametrize("name", ["../../x", "/tmp/x", "a/b", "..", "", "a\0b", "a\nb", "C:\\x", "x" * 300])
def test_a_name_in_results_is_never_a_path(doo3d, tmp_path, capture, name):
    assert doo3d("detect", capture(), "-o", "deep/er/out", "-q")[0] == 0
    out = tmp_path / "deep" / "er" / "out"
    file = out / "000000.json"
    values = json.loads(file.read_text())
    file.write_text(json.dumps(values | {"frame": name}))
    before = sorted(tmp_path.rglob("*"))
    for to in ("obj", "mjcf", "urdf", "swc", "nodes"):
        status, _, err = doo3d("export", "deep/er/out", "--to", to, "-o", "deep/er/there")
        assert (status, code_in(err)) == (2, "frame-name-invalid"), err
    assert sorted(tmp_path.rglob("*")) == before
    file.write_text(json.dumps(values))
    manifest = json.loads((out / "manifest.json").read_text())
    manifest["frames"][0]["name"] = name
    (out / "manifest.json").write_text(json.dumps(manifest))
    for command in (["report", "deep/er/out", "-o", "r.html"], ["export", "deep/er/out", "--to", "csv"]):
        status, _, err = doo3d(*command)
        assert (status, code_in(err)) == (2, "frame-name-invalid"), err


@pytest.mark.parametrize("change", [{"input": [1]}, {"versions": 3}, {"frames": [1]}, {"frames": {"a": 1}}, {"schema": 5}])
def test_a_manifest_of_other_types(doo3d, tmp_path, capture, change):
    assert doo3d("detect", capture(), "-o", "out", "-q")[0] == 0
    file = tmp_path / "out" / "manifest.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | change))
    for command in (["report", "out", "-o", "r.html"], ["export", "out", "--to", "csv"]):
        status, _, err = doo3d(*command)
        assert (status, code_in(err)) == (2, "results-damaged"), err

"""Files without an end or of a size that only the directory shows, in place of images, tables, arrays and clouds."""

from __future__ import annotations

import json
import os
import struct
import sys
from contextlib import suppress

import cv2
import numpy as np
import pytest
from builders.errors import refused, refuses

from doo3d.errors import InputError
from doo3d.guard import image_size
from doo3d.guard.limits import Limits
from doo3d.inputs import open_capture
from doo3d.inputs.formats import _cloud_files
from doo3d.inputs.formats._cloud_files import read_open3d
from doo3d.inputs.formats.trajectory import read_lines
from doo3d.inputs.support.arrays import read_depth_array
from doo3d.inputs.support.images import decode_image, read_color, read_depth

SPARSE_BYTES = 3 << 30  # no block of it is on the disk

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="links to devices, pipes, sparse files")


def replaced_by(path, kind: str):
    """Put a link to an endless device, a pipe or a sparse file in a file's place, and return its path."""
    path.unlink(missing_ok=True)
    if kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "pipe":
        os.mkfifo(path)
    else:
        path.touch()
        os.truncate(path, SPARSE_BYTES)
    return path


@pytest.fixture
def folder(tmp_path):
    """A folder of one frame of depth and color, with its camera."""
    for name, image in (("depth", np.full((48, 64), 500, np.uint16)), ("rgb", np.zeros((48, 64, 3), np.uint8))):
        (tmp_path / name).mkdir()
        cv2.imwrite(str(tmp_path / name / "0.png"), image)
    (tmp_path / "camera.json").write_text(json.dumps({"fx": 60, "fy": 60, "cx": 32, "cy": 24, "width": 64, "height": 48}))
    return tmp_path


KINDS = {"device": "file-unreadable", "pipe": "file-unreadable", "sparse": "size-too-large"}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["depth/0.png", "rgb/0.png"])
def test_an_image_of_a_folder(folder, name, kind):
    replaced_by(folder / name, kind)
    with refuses(KINDS[kind], name):
        open_capture(folder).frames[0].load()


@pytest.mark.parametrize("kind", KINDS)
def test_a_table_of_a_folder(folder, kind):
    (folder / "depth.txt").write_text("0.0 depth/0.png\n")
    replaced_by(folder / "rgb.txt", kind)
    if kind == "sparse":
        refused(folder, "size-too-large", "rgb.txt")
    else:  # no list, so the depth is read alone
        assert len(open_capture(folder).frames) == 1


@pytest.mark.parametrize("kind", ["device", "pipe"])
@pytest.mark.parametrize("name", ["camera.json", "traj.log", "pose.json", "depth/0.npy"])
def test_other_files_of_a_folder_do_not_block(folder, name, kind):
    replaced_by(folder / name, kind)
    with suppress(InputError):  # it may be needed
        open_capture(folder).frames[0].load()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("suffix", [".raw", ".exr", ".npy"])
def test_depth_of_other_programs(tmp_path, suffix, kind):
    path = replaced_by(tmp_path / f"a{suffix}", kind)
    (tmp_path / "a_metadata.csv").write_text("Resolution x,64\nResolution y,48\nFx,60\nFy,60\nPPx,32\nPPy,24\n")
    damaged = "size-too-large" if suffix == ".raw" else "file-damaged"
    with refuses(damaged if kind == "sparse" else KINDS[kind], path.name):
        read_depth(path, 1000)


@pytest.mark.parametrize("name", ["a.xyz", "a.pts"])
def test_a_sparse_cloud_of_text(tmp_path, name):
    refused(replaced_by(tmp_path / name, "sparse"), "file-damaged", "a line of more than", index=0)


@pytest.mark.parametrize("name", ["a.csv", "a.ptx", "a.pts"])
def test_a_line_without_end_after_rows(tmp_path, name):
    """The file begins as one of its format."""
    head = {"a.csv": "x,y,z\n", "a.pts": "2\n", "a.ptx": "1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n" + 4 * "1 0 0 1\n"}[name]
    (tmp_path / name).write_text(head + ("1,2,3\n" if name == "a.csv" else "1 2 3 1\n"))
    os.truncate(tmp_path / name, 4 << 20)
    refused(tmp_path / name, "file-damaged", "a line of more than", index=0)


def test_a_text_of_more_lines_than_points_are_allowed(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,z\n" + 20 * "1,2,3\n")
    refused(tmp_path / "a.csv", "size-too-large", "announces 21 points", index=0, limits=Limits(max_points=20))


@pytest.mark.parametrize(("name", "text"), [("a.obj", "# " * 2000 + "x"), ("a.xyz", "1 2 " + "1" * 1_000_000 + "x\n")])
def test_a_first_line_on_which_patterns_could_take_hours(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    with refuses("file-damaged" if name == "a.xyz" else "format-unknown", name):
        open_capture(tmp_path / name).frames[0].load()


def test_a_cloud_without_the_end_of_its_header(tmp_path, monkeypatch):
    monkeypatch.setattr(_cloud_files, "open3d", None)
    with refuses("file-damaged", "no line DATA"):
        read_open3d(replaced_by(tmp_path / "a.pcd", "sparse"), "pcd")


def test_a_row_without_end(tmp_path):
    (tmp_path / "rgb.txt").write_text("a " * 20_000)
    with refuses("size-too-large", "letters in line 1"):
        read_lines(tmp_path / "rgb.txt", 2, "time and file name")


def test_a_header_of_an_array_that_announces_gigabytes(tmp_path):
    path = tmp_path / "a.npy"
    path.write_bytes(b"\x93NUMPY\x02\x00" + struct.pack("<I", SPARSE_BYTES - 12))
    os.truncate(path, SPARSE_BYTES)
    with refuses("file-damaged", f"its header has {SPARSE_BYTES - 12} bytes"):
        read_depth_array(path, 1000)


def test_an_image_may_have_no_more_bytes_than_its_pixels_need(tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    cv2.imwrite(str(path), np.zeros((48, 64), np.uint8))
    with path.open("ab") as file:
        file.write(bytes(1000))  # as a phone appends a video
    assert read_color(path).shape == (48, 64, 3)
    monkeypatch.setattr(image_size, "_MAX_EXTRA_BYTES", 0)
    assert read_color(path).shape == (48, 64, 3)
    os.truncate(path, 16 * 48 * 64 + 1)
    with refuses("size-too-large", "a.png", f"more than such a file can have ({16 * 48 * 64})"):
        decode_image(path, cv2.IMREAD_COLOR)

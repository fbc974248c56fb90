"""Pixels that differ from a reference without the object."""

from __future__ import annotations

import os
import struct

import cv2
import numpy as np
import pytest
from builders.errors import refuses

from doo3d.config import SegmentConfig
from doo3d.segment.methods.background import mask
from doo3d.types import Camera, Cloud, Frame, Image

CAMERA = Camera(fx=100.0, fy=100.0, cx=20.0, cy=15.0, width=40, height=30)
OBJECT = np.zeros((30, 40), bool)
OBJECT[10:14, 5:35] = True


def config(path, **settings):
    return SegmentConfig(method="background", reference=str(path), **settings)


def write(path, image):
    assert cv2.imwrite(str(path), image)
    return path


def frame(color=True):
    depth = np.where(OBJECT, 0.59, 0.6).astype(np.float32)
    depth[0, :5] = 0
    image = np.full((30, 40, 3), (100, 120, 140), np.uint8)
    image[OBJECT] = (160, 90, 100)
    return Frame(image if color else None, depth, CAMERA)


@pytest.mark.parametrize(("scale", "settings"), [(1000, {}), (5000, {"reference_depth_scale": 5000.0})])
def test_depth(tmp_path, scale, settings):
    reference = np.full((30, 40), 0.6 * scale, np.uint16)
    reference[12, 20] = 0
    path = write(tmp_path / "empty.png", reference)
    expected = OBJECT.copy()
    expected[12, 20] = False
    np.testing.assert_array_equal(mask(frame(False), config(path, **settings), 0), expected)
    np.testing.assert_array_equal(mask(frame(), config(path, depth_difference=0.02, **settings), 0), False & OBJECT)


def test_pixels_farther_than_the_reference_are_not_the_object(tmp_path):
    path = write(tmp_path / "empty.png", np.full((30, 40), 500, np.uint16))
    assert not mask(frame(), config(path), 0).any()


def test_color(tmp_path):
    path = write(tmp_path / "empty.png", np.full((30, 40, 3), (140, 120, 100), np.uint8))
    np.testing.assert_array_equal(mask(frame(), config(path), 0), OBJECT)
    np.testing.assert_array_equal(mask(frame(), config(path, color_difference=80), 0), False & OBJECT)


def test_references_that_do_not_fit_are_refused(tmp_path):
    small = write(tmp_path / "small.png", np.zeros((20, 40), np.uint16))
    with refuses("reference-size", "small.png", "40x20", "40x30"):
        mask(frame(), config(small), 0)
    with refuses("file-missing", "nowhere.png"):
        mask(frame(), config(tmp_path / "nowhere.png"), 0)
    (tmp_path / "broken.png").write_bytes(b"not an image")
    with refuses("image-unreadable", "broken.png"):
        mask(frame(), config(tmp_path / "broken.png"), 0)
    grey = write(tmp_path / "grey.png", np.zeros((30, 40), np.uint8))
    with refuses("reference-type", "grey.png", "(30, 40)", "uint8"):
        mask(frame(), config(grey), 0)
    color = write(tmp_path / "color.png", np.zeros((30, 40, 3), np.uint8))
    with refuses("method-needs-color"):
        mask(frame(False), config(color), 0)
    with refuses("method-needs-image"):
        mask(Cloud(np.random.default_rng(0).random((9, 3))), config(color), 0)


def test_a_reference_that_changed_on_disk_is_read_again(tmp_path):
    path = write(tmp_path / "empty.png", np.full((30, 40), 600, np.uint16))
    assert mask(frame(), config(path), 0).any()
    write(path, np.full((30, 40), 500, np.uint16))
    os.utime(path, ns=(1, 1))
    assert not mask(frame(), config(path), 0).any()


def turned(path, orientation):
    """The JPEG at the path with EXIF that says nothing but how it is to be turned."""
    exif = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01" + struct.pack(">HH", orientation, 0) + b"\0\0\0\0"
    data = path.read_bytes()
    path.write_bytes(data[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + data[2:])
    return path


def halves():
    """Dark above, bright below."""
    image = np.full((30, 40, 3), 200, np.uint8)
    image[:15] = 40
    return image


@pytest.mark.parametrize(("orientation", "quarters"), [(6, -1), (3, 2)])
def test_the_reference_of_photographs_is_turned_as_its_exif_says(tmp_path, orientation, quarters):
    photo = np.rot90(halves(), quarters).copy()
    photo[10:14, 5:20] = (160, 90, 100)
    expected = np.zeros(photo.shape[:2], bool)
    expected[10:14, 5:20] = True
    path = turned(write(tmp_path / "empty.jpg", halves()), orientation)
    np.testing.assert_array_equal(mask(Image(photo), config(path), 0), expected)


def test_the_reference_of_frames_is_as_stored_like_their_color(tmp_path):
    path = turned(write(tmp_path / "empty.jpg", halves()), 3)
    same = Frame(halves(), np.full((30, 40), 0.6, np.float32), CAMERA)
    assert not mask(same, config(path), 0).any()
    assert mask(Image(halves()), config(path), 0).all()

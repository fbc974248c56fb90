"""A capture of any format is a sequence of its frames."""

from __future__ import annotations

import pytest
from builders.errors import refuses
from builders.paths import ROOT

import doo3d
from doo3d.errors import ArgumentError, UnknownFrame
from doo3d.inputs import ReadOptions

SAMPLES = ROOT / "sample_clouds"
OPENED = {
    "folder": lambda: doo3d.open_capture(SAMPLES / "crossing"),
    "bag": lambda: doo3d.open_capture(SAMPLES / "bags" / "crossing"),
    "cloud": lambda: doo3d.open_capture(SAMPLES / "clouds"),
    "photos": lambda: doo3d.open_capture(SAMPLES / "photos"),
    "masks": lambda: doo3d.open_capture(SAMPLES / "photos", masks=SAMPLES / "photos" / "mask"),
    "images": lambda: doo3d.open_capture(SAMPLES / "crossing", images_only=True),
    "pose": lambda: doo3d.open_capture(SAMPLES / "crossing", options=ReadOptions(pose="0,0,0,0,0,0,1")),
}


@pytest.mark.parametrize("kind", OPENED)
def test_every_kind_is_a_sequence(kind):
    capture = OPENED[kind]()
    frames = list(capture)
    assert len(capture) == len(frames) >= 1
    assert capture[0] is frames[0] is capture[frames[0].name]
    assert capture[-1] is frames[-1] is next(reversed(capture))
    assert frames[-1] in capture
    assert frames[-1].name in capture
    assert "nothing such" not in capture
    assert capture[:] is not None
    assert [each.name for each in capture[::2]] == [each.name for each in frames[::2]]
    assert [each.name for each in capture[-2:]] == [each.name for each in frames[-2:]]
    assert len(capture[:0]) == 0
    assert f"{len(capture)} frame" in repr(capture)
    assert capture[0].load().data is not None


def test_a_slice_is_a_capture():
    capture = OPENED["folder"]()
    assert capture[1:].selection == "--start 1 --end 2"
    assert capture[1:][1:].selection == "--frames 2"
    assert capture[1:].path == capture.path


@pytest.mark.parametrize("key", [3, -4, "x", 10**30])
def test_a_frame_that_is_not_there_is_an_index_error(key):
    assert issubclass(UnknownFrame, IndexError)
    with refuses("frame-unknown", "000000, 000001", kind=UnknownFrame):
        OPENED["folder"]()[key]


@pytest.mark.parametrize("key", [1.5, None, slice("a", None)])
def test_a_key_of_another_type_is_a_type_error(key):
    with refuses("argument-type", kind=ArgumentError):
        OPENED["folder"]()[key]

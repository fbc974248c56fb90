"""What a capture is said to be, against captures that are known."""

from __future__ import annotations

import re

import numpy as np
import pytest

from doo3d.errors import InputError
from doo3d.inputs import open_capture
from doo3d.inputs.capture import FrameData, FrameRef
from doo3d.inputs.frame_selection import Selection, selected
from doo3d.inputs.inspection import summarize_capture
from doo3d.types import Camera, Cloud, Frame


class Made:
    """A capture of shots made here."""

    format, path = "folder", "made"

    def __init__(self, shots, stamps=None):
        stamps = stamps or [None] * len(shots)
        pairs = enumerate(zip(shots, stamps, strict=True))
        self.frames = [FrameRef(f"f{i}", self.path, lambda shot=shot: give(shot), stamp) for i, (shot, stamp) in pairs]


def give(shot):
    if isinstance(shot, Exception):
        raise shot
    return shot


def frame(depth, fx=100.0, cx=20.0):
    depth = np.broadcast_to(np.asarray(depth, dtype=np.float32), (30, 40))
    return FrameData(Frame(None, depth, Camera(fx, fx, cx, 15, 40, 30)))


def test_what_a_folder_holds(capture):
    found = summarize_capture(open_capture(capture(frames=20, mask=True)), 5)
    assert [look.index for look in found.looks] == [0, 5, 10, 14, 19]
    assert (found.frames, found.names, found.timing, found.notes) == (20, ("000000", "000019"), None, [])
    assert all(look.kind == "depth" and look.color and look.mask and not look.pose for look in found.looks)
    assert {look.size for look in found.looks} == {(320, 240)}
    assert found.depth == pytest.approx((0.495, 0.56, 0.56), abs=0.002)
    assert found.missing == 0


def test_depth_and_what_is_missing():
    depth = np.full((30, 40), 0.5)
    depth[:, :10] = 0
    depth[0, 39] = 99.0  # a single reading does not make the range
    found = summarize_capture(Made([frame(depth), frame(0.7)]), 8)
    assert found.depth == pytest.approx((0.5, 0.6, 0.7))
    assert found.missing == pytest.approx(0.125)
    assert len(found.looks) == 2


@pytest.mark.parametrize(
    ("shots", "said"),
    [
        ([frame(650.0)], r"median depth is 650 m, too large.*depth_scale"),
        ([frame(0.0006)], r"median depth is 0\.0006 m, too small.*depth_scale"),
        ([frame(0.0)], r"no frame that was looked at has any depth"),
        ([frame(0.5, fx=4.0)], r"focal length of 4 px for 40 px of width"),
        ([frame(0.5, cx=39.0)], r"principal point \(39, 15\) lies far from the middle of 40x30"),
        ([FrameData(Cloud(np.eye(3) * 400))], r"f0 is 692\.8 m across: are its coordinates metres"),
        ([frame(0.5), InputError("gone", code="file-missing")], r"1 of the 2 frames that were looked at cannot be read"),
    ],
)
def test_what_looks_wrong(shots, said):
    (note,) = summarize_capture(Made(shots), 8).notes
    assert re.search(said, note), note


def test_when_the_frames_were_taken():
    found = summarize_capture(Made([frame(0.5)] * 5, [10.0, 10.1, 10.2, 12.2, 12.3]), 1)
    assert found.timing.rate == pytest.approx(10)
    assert (found.timing.first, found.timing.last) == (10.0, 12.3)
    assert (found.timing.longest, found.timing.longest_after) == (pytest.approx(2.0), "f2")
    assert found.notes == ["after f2 there is no frame for 2 s"]


def test_of_a_selection_the_numbers_are_those_of_the_whole():
    found = summarize_capture(selected(Made([frame(0.5)] * 10), Selection(every=4, start="1")), 8)
    assert [look.index for look in found.looks] == [1, 5, 9]
    assert (found.frames, found.total, found.selection) == (3, 10, "--start 1 --every 4")


def test_one_shot_in_memory_at_a_time():
    """Each is given on before the next is read, and not kept."""
    order = []

    class Loud(Made):
        def __init__(self, count):
            super().__init__([frame(0.5)] * count)
            self.frames = [FrameRef(e.name, e.source, lambda e=e: order.append(e.name) or e.loader()) for e in self.frames]

    found = summarize_capture(Loud(3), 3, lambda look, shot: order.append(shot.data.depth.shape))
    assert order == ["f0", (30, 40), "f1", (30, 40), "f2", (30, 40)]
    assert not any(isinstance(value, FrameData | Frame) for look in found.looks for value in vars(look).values())


def test_a_capture_without_frames():
    found = summarize_capture(Made([]), 8)
    assert (found.frames, found.looks, found.depth, found.notes) == (0, (), None, [])

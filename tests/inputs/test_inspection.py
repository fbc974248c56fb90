"""Summaries of captures, against captures of known content."""

from __future__ import annotations

import re
from functools import partial

import numpy as np
import pytest

from doo3d.errors import InputError
from doo3d.inputs import open_capture
from doo3d.inputs.capture import Capture, FrameData, FrameRef
from doo3d.inputs.frame_selection import Selection, select_frames
from doo3d.inputs.inspection import summarize_capture
from doo3d.types import Camera, Cloud, Frame


def made_capture(frames, stamps=None):
    """Return a capture of frames made in memory; an exception stands for a frame that cannot be read."""
    pairs = enumerate(zip(frames, stamps or [None] * len(frames), strict=True))
    return Capture("made", "folder", [FrameRef(f"f{i}", "made", partial(load, data), stamp) for i, (data, stamp) in pairs])


def load(data):
    if isinstance(data, Exception):
        raise data
    return data


def frame(depth, fx=100.0, cx=20.0):
    depth = np.broadcast_to(np.asarray(depth, dtype=np.float32), (30, 40))
    return FrameData(Frame(None, depth, Camera(fx, fx, cx, 15, 40, 30)))


@pytest.mark.slow
def test_content_of_a_folder(capture):
    summary = summarize_capture(open_capture(capture(frames=20, mask=True)), 5)
    assert [frame.index for frame in summary.checked] == [0, 5, 10, 14, 19]
    assert (summary.frames, summary.names, summary.timing, summary.warnings) == (20, ("000000", "000019"), None, [])
    assert all(frame.kind == "depth" and frame.color and frame.mask and not frame.pose for frame in summary.checked)
    assert {frame.size for frame in summary.checked} == {(320, 240)}
    assert summary.depth == pytest.approx((0.495, 0.56, 0.56), abs=0.002)
    assert summary.missing == 0


def test_depth_percentiles_and_missing_share():
    depth = np.full((30, 40), 0.5)
    depth[:, :10] = 0
    depth[0, 39] = 99.0  # a single measurement does not make the range
    summary = summarize_capture(made_capture([frame(depth), frame(0.7)]), 8)
    assert summary.depth == pytest.approx((0.5, 0.6, 0.7))
    assert summary.missing == pytest.approx(0.125)
    assert len(summary.checked) == 2


@pytest.mark.parametrize(
    ("frames", "expected"),
    [
        ([frame(650.0)], r"median depth is 650 m, too large.*depth_scale"),
        ([frame(0.0006)], r"median depth is 0\.0006 m, too small.*depth_scale"),
        ([frame(0.0)], r"none of the checked frames has any depth"),
        ([frame(0.5, fx=4.0)], r"focal length of 4 px for an image 40 px wide"),
        ([frame(0.5, cx=39.0)], r"principal point \(39, 15\) lies far from the middle of the 40x30"),
        ([FrameData(Cloud(np.eye(3) * 400))], r"f0 is 692\.8 m across: coordinates have to be metres"),
        ([frame(0.5), InputError("gone", code="file-missing")], r"1 of the 2 checked frames cannot be read"),
    ],
)
def test_warnings(frames, expected):
    (warning,) = summarize_capture(made_capture(frames), 8).warnings
    assert re.search(expected, warning), warning


def test_times_rate_and_longest_step():
    summary = summarize_capture(made_capture([frame(0.5)] * 5, [10.0, 10.1, 10.2, 12.2, 12.3]), 1)
    assert summary.timing.rate == pytest.approx(10)
    assert (summary.timing.first, summary.timing.last) == (10.0, 12.3)
    assert (summary.timing.longest, summary.timing.longest_after) == (pytest.approx(2.0), "f2")
    assert summary.warnings == ["there is no frame for 2 s after frame f2"]


def test_selected_frames_keep_their_numbers():
    summary = summarize_capture(select_frames(made_capture([frame(0.5)] * 10), Selection(every=4, start="1")), 8)
    assert [frame.index for frame in summary.checked] == [1, 5, 9]
    assert (summary.frames, summary.total, summary.selection) == (3, 10, "--start 1 --every 4")


def test_one_frame_in_memory_at_a_time():
    """Each frame is passed on before the next is read, and not kept."""
    order = []

    recorder = made_capture([frame(0.5)] * 3)
    recorder.frames = [FrameRef(e.name, e.source, lambda e=e: order.append(e.name) or e.loader()) for e in recorder]
    summary = summarize_capture(recorder, 3, lambda frame, loaded: order.append(loaded.data.depth.shape))
    assert order == ["f0", (30, 40), "f1", (30, 40), "f2", (30, 40)]
    assert not any(isinstance(value, FrameData | Frame) for frame in summary.checked for value in vars(frame).values())


def test_a_capture_without_frames():
    summary = summarize_capture(made_capture([]), 8)
    assert (summary.frames, summary.checked, summary.depth, summary.warnings) == (0, (), None, [])

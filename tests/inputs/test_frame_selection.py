"""Selection of a capture's frames."""

from __future__ import annotations

from pathlib import Path

import pytest
from builders.errors import refuses

from doo3d.inputs import open_capture
from doo3d.inputs.capture import Capture, FrameRef
from doo3d.inputs.frame_selection import Selection, select_frames


def recording(count=10, stamps=True):
    """Return a capture of ten frames, 0.1 s apart, with times of a recorder's clock."""
    path = Path("recording")
    times = [1.7e9 + 0.1 * i if stamps else None for i in range(count)]
    return Capture(path, "folder", [FrameRef(f"{i + 100}", path, lambda: None, time) for i, time in enumerate(times)])


def chosen(count=10, **selection) -> list[int]:
    return [int(frame_ref.name) - 100 for frame_ref in select_frames(recording(count), Selection(**selection)).frames]


@pytest.mark.parametrize(
    ("selection", "expected"),
    [
        ({"every": 3}, [0, 3, 6, 9]),
        ({"every": 100}, [0]),
        ({"start": "7"}, [7, 8, 9]),
        ({"start": "-2"}, [8, 9]),
        ({"start": "-100"}, list(range(10))),
        ({"end": "2"}, [0, 1, 2]),
        ({"end": "-8"}, [0, 1, 2]),
        ({"end": "100"}, list(range(10))),
        ({"start": "3", "end": "5"}, [3, 4, 5]),
        ({"start": "0.3s", "end": "0.5s"}, [3, 4, 5]),
        ({"start": "0.25s", "end": "-0.35s"}, [3, 4, 5]),
        ({"start": "-0.1s"}, [8, 9]),
        ({"start": "1", "end": "0.6s", "every": 2}, [1, 3, 5]),
        ({"frames": "3,7, 8-9"}, [3, 7, 8, 9]),
        ({"frames": "9,2,2,1"}, [1, 2, 9]),
        ({"frames": "-1"}, [9]),
        ({"frames": "-3--2,0"}, [0, 7, 8]),
        ({"frames": "8-200"}, [8, 9]),
        ({"frames": "0.2s-0.4s,0.78s,-0s"}, [2, 3, 4, 8, 9]),
        ({"frames": "1-8", "start": "4", "every": 2}, [4, 6, 8]),
    ],
)
def test_selected_frames(selection, expected):
    assert chosen(**selection) == expected


def test_empty_selection_returns_the_capture_itself():
    capture = recording()
    assert select_frames(capture, Selection()) is capture


def test_selection_as_text():
    capture = select_frames(recording(), Selection(every=2, start="1", end="0.6s", frames="0-3, 7"))
    assert capture.selection == "--frames 0-3,7 --start 1 --end 0.6s --every 2"
    assert (capture.path, capture.format) == (Path("recording"), "folder")


def test_masks_are_kept(capture, tmp_path):
    folder = capture(frames=3, mask=True)
    opened = open_capture(folder, masks=folder / "mask")
    picked = select_frames(opened, Selection(frames="1"))
    assert picked.masks == folder / "mask"
    assert picked.frames[0].load().mask.any()


@pytest.mark.parametrize(
    ("selection", "code", "parts"),
    [
        ({"start": "10"}, "selection-empty", ["recording", "--start 10", "0 to 9", "0s to 0.9s"]),
        ({"start": "5", "end": "4"}, "selection-empty", ["--start 5 --end 4"]),
        ({"frames": "20-30"}, "selection-empty", ["--frames 20-30"]),
        ({"frames": "3,10"}, "frame-unknown", ["10", "--frames", "0 to 9"]),
        ({"frames": "-11"}, "frame-unknown", ["-11"]),
        ({"frames": "1.2s"}, "frame-unknown", ["1.2s"]),
        ({"frames": "3;4"}, "selection-invalid", ["--frames 3;4", "'3;4'"]),
        ({"frames": ""}, "selection-invalid", ["--frames"]),
        ({"frames": "1-2-3"}, "selection-invalid", ["'1-2-3'"]),
        ({"start": "1.5"}, "selection-invalid", ["--start 1.5"]),
        ({"end": "last"}, "selection-invalid", ["--end last"]),
        ({"start": ""}, "selection-invalid", ["--start"]),
        ({"every": 0}, "selection-invalid", ["--every 0"]),
    ],
)
def test_invalid_selections(selection, code, parts):
    with refuses(code, *parts):
        chosen(**selection)


def test_frames_without_times():
    with refuses("times-missing", "recording", "--end 2s"):
        select_frames(recording(stamps=False), Selection(end="2s"))
    assert len(select_frames(recording(stamps=False), Selection(end="2")).frames) == 3


def test_no_frames_at_all():
    for selection, code in (
        (Selection(every=2), "selection-empty"),
        (Selection(frames="0"), "frame-unknown"),
        (Selection(start="0"), "selection-empty"),
    ):
        with refuses(code, "recording"):
            select_frames(recording(0), selection)

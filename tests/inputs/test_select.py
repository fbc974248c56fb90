"""Some of a capture's frames."""

from __future__ import annotations

from pathlib import Path

import pytest

from doo3d.errors import InputError
from doo3d.inputs import open_capture
from doo3d.inputs.base import Entry
from doo3d.inputs.select import Selection, selected


class Recording:
    """Ten frames, a tenth of a second apart, in the time of a recorder's clock."""

    format = "folder"
    path = Path("recording")

    def __init__(self, count=10, stamps=True):
        self.frames = [Entry(f"{i + 100}", self.path, lambda: None, 1.7e9 + 0.1 * i if stamps else None) for i in range(count)]


def chosen(count=10, **selection) -> list[int]:
    return [int(entry.name) - 100 for entry in selected(Recording(count), Selection(**selection)).frames]


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
def test_what_is_left(selection, expected):
    assert chosen(**selection) == expected


def test_the_whole_is_the_capture_itself():
    capture = Recording()
    assert selected(capture, Selection()) is capture


def test_the_selection_in_words():
    capture = selected(Recording(), Selection(every=2, start="1", end="0.6s", frames="0-3, 7"))
    assert capture.selection == "--frames 0-3,7 --start 1 --end 0.6s --every 2"
    assert (capture.path, capture.format) == (Path("recording"), "folder")


def test_masks_stay(capture, tmp_path):
    folder = capture(frames=3, mask=True)
    opened = open_capture(folder, masks=folder / "mask")
    picked = selected(opened, Selection(frames="1"))
    assert picked.masks == folder / "mask"
    assert picked.frames[0].load().mask.any()


@pytest.mark.parametrize(
    ("selection", "said"),
    [
        ({"start": "10"}, r"recording: --start 10 leaves no frame; it has the frames 0 to 9, 0s to 0\.9s"),
        ({"start": "5", "end": "4"}, r"--start 5 --end 4 leaves no frame"),
        ({"frames": "20-30"}, r"--frames 20-30 leaves no frame"),
        ({"frames": "3,10"}, r"no frame 10 \(--frames\); it has the frames 0 to 9"),
        ({"frames": "-11"}, r"no frame -11"),
        ({"frames": "1.2s"}, r"no frame 1\.2s"),
        ({"frames": "3;4"}, r"--frames 3;4: expected numbers and spans such as .*got '3;4'"),
        ({"frames": ""}, r"--frames : expected"),
        ({"frames": "1-2-3"}, r"got '1-2-3'"),
        ({"start": "1.5"}, r"--start 1\.5: expected a frame's number"),
        ({"end": "last"}, r"--end last: expected a frame's number"),
        ({"start": ""}, r"--start : expected"),
        ({"every": 0}, r"--every 0: expected 1 or more"),
    ],
)
def test_what_cannot_be(selection, said):
    with pytest.raises(InputError, match=said):
        chosen(**selection)


def test_frames_without_times():
    with pytest.raises(InputError, match=r"recording: not all frames have a time, so --end 2s says nothing"):
        selected(Recording(stamps=False), Selection(end="2s"))
    assert len(selected(Recording(stamps=False), Selection(end="2")).frames) == 3


def test_no_frames_at_all():
    for selection in (Selection(every=2), Selection(frames="0"), Selection(start="0")):
        with pytest.raises(InputError, match="no frame"):
            selected(Recording(0), selection)

"""Video files: every frame once and in order, without decoding earlier frames again, up to the end of a truncated file."""

from __future__ import annotations

import pickle
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders.captures import cut
from builders.errors import code_in, refused, refuses

from doo3d.inputs import open_capture
from doo3d.inputs.formats import video
from doo3d.types import Image

FRAMES, FPS = 12, 25.0
KINDS = [("a.avi", "MJPG"), ("b.avi", "XVID"), ("a.mp4", "mp4v"), ("a.mkv", "mp4v"), ("a.mpg", "mpg1")]


def film(path: Path, codec: str = "MJPG", frames: int = FRAMES) -> Path:
    """Write frames of increasing brightness, with noise for a larger file."""
    rng = np.random.default_rng(0)
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, cv2.VideoWriter_fourcc(*codec), FPS, (160, 120))
    for i in range(frames):
        frame = np.full((120, 160, 3), (0, 0, 20 * i), np.uint8)
        frame[:60] = rng.integers(0, 255, (60, 160, 3))
        writer.write(frame)
    writer.release()
    return path


def brightness(data: Image) -> int:
    """Return the number of a frame, from its red channel."""
    assert isinstance(data, Image)
    return round(float(data.color[100:, :, 0].mean()) / 20)


def boxes(data: bytes) -> list[tuple[bytes, bytes]]:
    found, at = [], 0
    while at < len(data):
        (size,) = struct.unpack(">I", data[at : at + 4])
        found.append((data[at + 4 : at + 8], data[at : at + size]))
        at += size
    return found


def index_first(path: Path) -> Path:
    """Return an MP4 rearranged for streaming: its index before its frames."""
    parts = dict(boxes(path.read_bytes()))
    index = bytearray(parts.pop(b"moov"))
    at = index.index(b"stco")
    (count,) = struct.unpack(">I", index[at + 8 : at + 12])
    for i in range(at + 12, at + 12 + 4 * count, 4):
        index[i : i + 4] = struct.pack(">I", struct.unpack(">I", index[i : i + 4])[0] + len(index))
    path.write_bytes(parts.pop(b"ftyp") + bytes(index) + b"".join(parts.values()))
    return path


@pytest.mark.parametrize(("name", "codec"), KINDS)
def test_frames_in_order_with_their_times(tmp_path, name, codec):
    opened = open_capture(film(tmp_path / name, codec))
    assert opened.format == "video"
    assert [frame_ref.name for frame_ref in opened.frames] == [f"{i:06d}" for i in range(FRAMES)]
    assert [frame_ref.timestamp for frame_ref in opened.frames] == [i / FPS for i in range(FRAMES)]
    loaded_frames = [frame_ref.load() for frame_ref in opened.frames]
    assert [brightness(loaded.data) for loaded in loaded_frames] == list(range(FRAMES))
    assert (loaded_frames[3].data.name, loaded_frames[3].data.timestamp, loaded_frames[3].mask) == ("000003", 3 / FPS, None)


def test_format_is_detected_by_the_first_bytes(tmp_path):
    film(tmp_path / "a.avi").rename(tmp_path / "a.data")
    assert open_capture(tmp_path / "a.data").format == "video"


def test_frames_load_in_any_order(tmp_path):
    opened = open_capture(film(tmp_path / "a.avi"))
    order = [5, 2, 2, 11, 0, 11]
    assert [brightness(opened.frames[i].load().data) for i in order] == order


def test_next_frame_needs_no_decoding_of_earlier_frames(tmp_path, monkeypatch):
    opened = open_capture(film(tmp_path / "a.avi"))
    decoded = {"opened": 0, "frames": 0}

    class Counting:
        def __init__(self, path):
            self.video = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
            decoded["opened"] += 1

        def read(self):
            decoded["frames"] += 1
            return self.video.read()

        def grab(self):
            decoded["frames"] += 1
            return self.video.grab()

        def release(self):
            self.video.release()

    monkeypatch.setattr(video, "_open", Counting)
    assert [brightness(frame_ref.load().data) for frame_ref in opened.frames] == list(range(FRAMES))
    assert decoded == {"opened": 1, "frames": FRAMES}


def test_frame_references_can_be_pickled(tmp_path):
    frame_refs = pickle.loads(pickle.dumps(open_capture(film(tmp_path / "a.avi")).frames))
    assert [brightness(frame_ref.load().data) for frame_ref in frame_refs] == list(range(FRAMES))


def test_rewritten_file_is_read_anew(tmp_path):
    first = open_capture(film(tmp_path / "a.avi"))
    first.frames[0].load()
    again = open_capture(film(tmp_path / "a.avi", frames=3))
    assert [brightness(frame_ref.load().data) for frame_ref in again.frames] == [0, 1, 2]
    with refuses("video-unreadable", "a.avi", "11"):
        first.frames[11].load()


# --- broken files ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.95, 0.6, 0.3])
@pytest.mark.parametrize(("name", "codec"), [*KINDS, ("first.mp4", "mp4v")])
def test_truncated(tmp_path, name, codec, share, capfd):
    path = film(tmp_path / name, codec)
    if name == "first.mp4":
        index_first(path)
        assert len(open_capture(path).frames) == FRAMES
    cut(path, share)
    capfd.readouterr()
    if name == "a.mp4":
        refused(path, "file-damaged", "a.mp4")
        return
    *whole, last = open_capture(path).frames
    assert FRAMES * share - 3 < len(whole) <= FRAMES * share
    assert [brightness(frame_ref.load().data) for frame_ref in whole] == list(range(len(whole)))
    assert last.name == f"{len(whole):06d}"
    with refuses("file-damaged", name, str(len(whole))):
        last.load()
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (b"", "file-empty"),
        (b"\0\0\0\x18ftypmp42" + bytes(60), "file-damaged"),
        (b"RIFF\xff\0\0\0AVI " + bytes(60), "video-unreadable"),
        (b"\x1aE\xdf\xa3", "file-damaged"),
    ],
)
def test_no_video(tmp_path, content, code, capfd):
    path = tmp_path / "a.mp4"
    path.write_bytes(content)
    refused(path, code, "a.mp4")
    assert capfd.readouterr().err == ""


def test_truncated_in_the_first_frame(tmp_path):
    path = film(tmp_path / "a.avi")
    path.write_bytes(path.read_bytes()[:7000])
    refused(path, "file-damaged", "a.avi")


def test_a_recording_of_azure_kinect_is_named_with_the_way_out(doo3d, tmp_path):
    path = film(tmp_path / "a.mkv")
    assert open_capture(path).no_depth == ""
    tag, data = b"K4A_DEPTH_MODE", path.read_bytes()
    at = data.index(b"\xec\x01") + 9  # the content of the void element that FFmpeg leaves behind the header: readers skip it
    path.write_bytes(data[:at] + tag + data[at + len(tag) :])
    assert "Azure Kinect" in open_capture(path).no_depth
    code, _, err = doo3d("detect", path)
    assert (code, "azure_kinect_mkv_reader.py" in err, code_in(err)) == (2, True, "mode-needs-depth")

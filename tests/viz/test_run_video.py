"""The video, read back."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders.errors import code_in, refuses

from doo3d.outputs.run_reader import open_results
from doo3d.viz.video import failed_card, letterboxed, write_video

COLORS = [(200, 40, 40), (40, 200, 40), (40, 40, 200)]


def results(place: Path, sizes, stamps=None, failed=()) -> Path:
    """Write a folder with plain pictures; `failed` are the indices of failed frames."""
    place.mkdir()
    frames = []
    for i, (width, height) in enumerate(sizes):
        bad = i in failed
        stamp = None if stamps is None else stamps[i]
        status = {"status": "failed", "error": "torn"} if bad else {"status": "ok", "error": None, "picture": "png"}
        frames.append({"name": f"f{i}", "timestamp": stamp, **status})
        if not bad:
            cv2.imwrite(str(place / f"f{i}.png"), np.full((height, width, 3), COLORS[i % 3], np.uint8))
    (place / "manifest.json").write_text(json.dumps({"schema": "doo3d/manifest/1", "finished": True, "frames": frames}))
    return place


def read(path: Path) -> tuple[list[np.ndarray], float]:
    video = cv2.VideoCapture(str(path))
    frames = []
    while (found := video.read())[0]:
        frames.append(found[1])
    return frames, video.get(cv2.CAP_PROP_FPS)


def like(pixel: np.ndarray, color: tuple[int, int, int]) -> bool:
    return bool(np.abs(pixel.astype(int) - color).max() < 16)


@pytest.mark.parametrize(
    ("codec", "suffix"), [("mp4v", ".mp4"), ("vp09", ".mp4"), (None, ".mp4"), (None, ".webm"), ("vp09", ".webm")]
)
def test_every_frame_in_order(tmp_path, codec, suffix, capfd):
    first, second = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
    opened = open_results(results(tmp_path / "out", [(320, 240)] * 3))
    made = write_video(opened, first, codec=codec)
    frames, fps = read(first)
    assert (made.frames, made.fps, made.size) == (len(frames), fps, (320, 240)) == (3, 10.0, (320, 240))
    for frame, color in zip(frames, COLORS, strict=True):
        assert like(frame[120, 160], color)
    assert [file.name for file in tmp_path.iterdir() if file.is_file()] == [first.name]
    write_video(opened, second, codec=codec)
    assert first.read_bytes() == second.read_bytes()
    assert capfd.readouterr() == ("", "")
    assert (first.read_bytes()[:4] == b"\x1a\x45\xdf\xa3") == (suffix == ".webm"), "the mark of Matroska"


def test_the_rate_is_of_the_timestamps_or_as_given(tmp_path):
    opened = open_results(results(tmp_path / "out", [(64, 48)] * 4, stamps=[10.0, 10.04, 10.08, 10.5]))
    assert write_video(opened, tmp_path / "a.mp4").fps == read(tmp_path / "a.mp4")[1] == 25
    assert write_video(opened, tmp_path / "b.mp4", fps=5).fps == read(tmp_path / "b.mp4")[1] == 5


def test_another_size_is_letterboxed_and_an_odd_one_cut(tmp_path):
    write_video(open_results(results(tmp_path / "out", [(321, 241), (240, 320), (642, 482)])), tmp_path / "a.mp4")
    first, tall, large = read(tmp_path / "a.mp4")[0]
    assert first.shape == (240, 320, 3)
    assert like(tall[120, 160], COLORS[1])
    assert like(tall[120, 10], (0, 0, 0))
    assert like(tall[120, 310], (0, 0, 0))
    assert like(large[2, 2], COLORS[2])


def test_failed_frames_are_shown_or_skipped(tmp_path):
    opened = open_results(results(tmp_path / "out", [(320, 240)] * 3, failed=[0]))
    assert write_video(opened, tmp_path / "a.mp4").failed == 1
    frames, _ = read(tmp_path / "a.mp4")
    assert len(frames) == 3
    assert frames[0].mean() < 60
    assert frames[0].max() > 150, "the reason is written there"
    made = write_video(opened, tmp_path / "b.mp4", skip_failed=True)
    frames, _ = read(tmp_path / "b.mp4")
    assert (made.frames, made.failed, len(frames)) == (2, 1, 2)
    assert like(frames[0][120, 160], COLORS[1])


def test_a_missing_picture_is_named(tmp_path):
    place = results(tmp_path / "out", [(64, 48)] * 2)
    (place / "f1.png").unlink()
    with refuses("picture-missing", "f1.png"):
        write_video(open_results(place), tmp_path / "a.mp4")
    assert [file.name for file in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize(
    ("asked", "code", "parts"),
    [
        ({"codec": "mpg"}, "choice-unknown", ("mpg", "mp4v")),
        ({"codec": "mp4v", "path": "a.webm"}, "options-conflict", ("mp4v", ".mp4")),
        ({"fps": 0.0}, "value-out-of-bounds", ("fps 0",)),
        ({"fps": float("nan")}, "value-out-of-bounds", ("fps nan",)),
    ],
)
def test_invalid_options_are_refused(tmp_path, asked, code, parts):
    with refuses(code, *parts):
        place = tmp_path / asked.pop("path", "a.mp4")
        write_video(open_results(results(tmp_path / "out", [(64, 48)])), place, **asked)


def test_a_run_without_frames_is_refused(tmp_path):
    with refuses("results-empty"):
        write_video(open_results(results(tmp_path / "out", [])), tmp_path / "a.mp4")


@pytest.mark.parametrize("size", [(640, 480), (1920, 1080), (64, 48), (2, 2)])
def test_a_card_fits_any_size(size):
    card = failed_card("a" * 300, "depth/000001.png is cut off " * 40, size)
    assert card.shape == (size[1], size[0], 3)
    assert letterboxed(np.full((7, 500, 3), 255, np.uint8), size).shape == card.shape


def test_the_command(doo3d, tmp_path):
    place = results(tmp_path / "out", [(64, 48)] * 3, failed=[1])
    assert doo3d("video", place) == (0, f"3 frames (1 failed, shown as such), 10 per second, 64x48 -> {place}.webm\n", "")
    place.with_suffix(".webm").write_bytes(b"edited")
    code, _, err = doo3d("video", place)
    assert code == 2
    assert code_in(err) == "out-exists"
    assert "--force" in err
    out = doo3d("video", place, "--force", "--skip-failed", "--fps", 4)[1]
    assert out == f"2 frames (1 failed, left out), 4 per second, 64x48 -> {place}.webm\n"

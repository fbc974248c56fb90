"""Data sets of LeRobot with depth as video."""

import importlib

import numpy as np
import pytest
from builders.drawn_masks import frame_of, wave
from builders.errors import refused
from builders.lerobot import CODING, COLOR, DEPTH, FPS, ramps, write

import doo3d
from doo3d.errors import MissingDependency
from doo3d.inputs import ReadOptions, open_capture

pytest.importorskip("av")
pa = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")

PINHOLE = "600,600,31.5,23.5"
MAX_CODE = 4095


def metres(codes):
    """Return the depth of codes by the formula of the data set, one value after the other."""
    low, high = (np.log(CODING[key] + CODING["shift"]) for key in ("depth_min", "depth_max"))
    return [[0 if code == 0 else np.exp(code * (high - low) / MAX_CODE + low) - CODING["shift"] for code in row] for row in codes]


def codes_of(depth):
    low, high = (np.log(CODING[key] + CODING["shift"]) for key in ("depth_min", "depth_max"))
    codes = np.rint((np.log(np.maximum(depth, 0.01) + CODING["shift"]) - low) / (high - low) * MAX_CODE)
    return np.where(depth > 0, codes, 0).astype(np.uint16)


@pytest.mark.parametrize("prefix", ["", "video."])
def test_codes_become_metres_in_any_order(tmp_path, prefix):
    images = ramps(40)
    capture = open_capture(write(tmp_path / "set", images, prefix=prefix), camera=PINHOLE)
    assert (capture.format, len(capture)) == ("lerobot", 40)
    for i in (0, 1, 2, 19, 1, 20, 38, 23, 22, 3, 39):
        frame = capture[i].load().data
        np.testing.assert_allclose(frame.depth, metres(images[i]), rtol=1e-6)
        assert frame.timestamp == capture[i].timestamp == pytest.approx(i / FPS)
    assert (frame.camera.fx, frame.camera.cx) == (600, 31.5)


def test_linear_codes(tmp_path):
    images = ramps()
    (frame, *_) = open_capture(write(tmp_path / "set", images, use_log=False, shift=None), camera=PINHOLE)
    expected = np.where(images[0] > 0, 0.01 + images[0] / MAX_CODE * 9.99, 0)
    np.testing.assert_allclose(frame.load().data.depth, expected, rtol=1e-6)


def test_times_of_the_parquet_files_and_color(tmp_path):
    color = [np.full((48, 64, 3), (20 * i, 100, 50), np.uint8) for i in range(6)]
    folder = write(tmp_path / "set", ramps(), color)
    stamps = {"timestamp": [0, 0.04, 0.08, 0, 0.03, 0.07], "episode_index": [0, 0, 0, 1, 1, 1]}
    (folder / "data" / "chunk-000").mkdir(parents=True)
    parquet.write_table(pa.table(stamps), folder / "data" / "chunk-000" / "file-000.parquet")
    capture = open_capture(folder, camera=PINHOLE)
    start = 0.08 + 1 / FPS
    assert [ref.timestamp for ref in capture] == pytest.approx([0, 0.04, 0.08, start, start + 0.03, start + 0.07])
    assert any(f"color_topic={COLOR}" in note for note in capture.notes)
    assert capture[0].load().data.color is None
    capture = open_capture(folder, options=ReadOptions(color_topic=COLOR), camera=PINHOLE)
    assert not capture.notes
    for i in (0, 5, 3):
        np.testing.assert_allclose(capture[i].load().data.color[24, 32], color[i][24, 32], atol=2)
    refused(folder, "topic-missing", "other", COLOR, options=ReadOptions(color_topic="other"), camera=PINHOLE)
    parquet.write_table(pa.table({key: values[:4] for key, values in stamps.items()}), next(folder.rglob("*.parquet")))
    refused(folder, "frame-count", "4 rows for 6 frames", camera=PINHOLE)


def test_a_cable_is_found(tmp_path):
    frame, mask = frame_of(wave())
    folder = write(tmp_path / "set", [codes_of(frame.depth)] * 4)
    camera = frame.camera
    loaded = open_capture(folder, camera=f"{camera.fx},{camera.fy},{camera.cx},{camera.cy}")[1].load()
    (chain,) = doo3d.detect(loaded.data, mask=mask).chains
    (expected,) = doo3d.detect(frame, mask=mask).chains
    assert chain.length == pytest.approx(expected.length, rel=0.03)


@pytest.mark.parametrize(
    ("changes", "code", "parts"),
    [
        ({"depth_min": 20.0}, "depth-scale-invalid", (DEPTH, "depth_min=20.0")),
        ({"use_log": None}, "depth-scale-invalid", ("use_log=None",)),
        ({"is_depth_map": False}, "depth-missing", ("-c image",)),
    ],
)
def test_a_coding_that_is_none(tmp_path, changes, code, parts):
    folder = write(tmp_path / "set", ramps(4), **changes)
    refused(folder, code, "info.json", *parts, camera=PINHOLE)


def test_what_is_missing_is_named(tmp_path, monkeypatch):
    folder = write(tmp_path / "set", ramps(4))
    refused(folder, "intrinsics-missing", "--camera")
    refused(folder, "topic-missing", "other", DEPTH, options=ReadOptions(depth_topic="other"), camera=PINHOLE)
    file = folder / "videos" / DEPTH / "chunk-000" / "file-001.mp4"
    file.write_bytes(file.read_bytes()[:200])
    refused(folder, "file-damaged", "file-001.mp4", camera=PINHOLE)
    real = importlib.import_module

    def missing(name, *rest):
        if name == "av":
            raise ImportError("No module named 'av'")
        return real(name, *rest)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(MissingDependency, match=r"doo3d\[lerobot\]|\[lerobot\]"):
        open_capture(folder, camera=PINHOLE)

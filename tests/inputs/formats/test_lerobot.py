"""Data sets of LeRobot with depth as video."""

import importlib
import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from builders.drawn_masks import frame_of, wave
from builders.errors import refuses

import doo3d
from doo3d.errors import MissingDependency
from doo3d.inputs import ReadOptions, open_capture

av = pytest.importorskip("av")
pa = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")

DEPTH, COLOR = "observation.images.top_depth", "observation.images.top"
CODING = {"depth_min": 0.01, "depth_max": 10.0, "shift": 0.1, "use_log": True}
PINHOLE = "600,600,31.5,23.5"
MAX_CODE = 4095
FPS = 30


def metres(codes):
    """Return the depth of codes by the formula of the data set, one value after the other."""
    low, high = (np.log(CODING[key] + CODING["shift"]) for key in ("depth_min", "depth_max"))
    return [[0 if code == 0 else np.exp(code * (high - low) / MAX_CODE + low) - CODING["shift"] for code in row] for row in codes]


def codes_of(depth):
    low, high = (np.log(CODING[key] + CODING["shift"]) for key in ("depth_min", "depth_max"))
    codes = np.rint((np.log(np.maximum(depth, 0.01) + CODING["shift"]) - low) / (high - low) * MAX_CODE)
    return np.where(depth > 0, codes, 0).astype(np.uint16)


def encode(file: Path, images, pixels: str, kind: str) -> None:
    """Write images as lossless HEVC, with frames that refer to later ones."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(file), "w") as container:
        stream = container.add_stream("libx265", rate=FPS, options={"x265-params": "lossless=1:keyint=4:log-level=none"})
        stream.height, stream.width = images[0].shape[:2]
        stream.pix_fmt, stream.time_base = kind, Fraction(1, FPS)
        for number, image in enumerate(images):
            frame = av.VideoFrame(image.shape[1], image.shape[0], pixels)
            plane = frame.planes[0]
            rows = np.zeros((plane.height, plane.line_size), np.uint8)
            data = image.view(np.uint8).reshape(len(image), -1)
            rows[:, : data.shape[1]] = data
            plane.update(rows.tobytes())
            frame.pts, frame.time_base = number, stream.time_base
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def write(folder: Path, depth, color=None, prefix="video.", **changes):
    """Write a data set of version 3: two episodes, the depth in two files, the color in one."""
    coding = {prefix + key: value for key, value in (CODING | changes).items() if value is not None}
    features = {DEPTH: {"dtype": "video", "info": {prefix + "is_depth_map": True} | coding}}
    half = len(depth) // 2
    for number, images in enumerate((depth[:half], depth[half:])):
        encode(folder / "videos" / DEPTH / "chunk-000" / f"file-{number:03d}.mp4", images, "gray12le", "gray12le")
    if color is not None:
        features[COLOR] = {"dtype": "video", "info": {"video.is_depth_map": False}}
        encode(folder / "videos" / COLOR / "chunk-000" / "file-000.mp4", color, "rgb24", "gbrp")
    (folder / "meta").mkdir()
    (folder / "meta" / "info.json").write_text(json.dumps({"codebase_version": "v3.0", "fps": FPS, "features": features}))
    return folder


def ramps(count=6):
    """Return images of codes, each another, with pixels of code 0."""
    rows = np.arange(48 * 64, dtype=np.uint16).reshape(48, 64)
    return [np.where(rows % 7 == 0, 0, 1000 + (rows + 50 * i) % 1500).astype(np.uint16) for i in range(count)]


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
    with refuses("topic-missing", "other", COLOR):
        open_capture(folder, options=ReadOptions(color_topic="other"), camera=PINHOLE)
    parquet.write_table(pa.table({key: values[:4] for key, values in stamps.items()}), next(folder.rglob("*.parquet")))
    with refuses("frame-count", "4 rows for 6 frames"):
        open_capture(folder, camera=PINHOLE)


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
    with refuses(code, "info.json", *parts):
        open_capture(folder, camera=PINHOLE)


def test_what_is_missing_is_named(tmp_path, monkeypatch):
    folder = write(tmp_path / "set", ramps(4))
    with refuses("intrinsics-missing", "--camera"):
        open_capture(folder)
    with refuses("topic-missing", "other", DEPTH):
        open_capture(folder, options=ReadOptions(depth_topic="other"), camera=PINHOLE)
    file = folder / "videos" / DEPTH / "chunk-000" / "file-001.mp4"
    file.write_bytes(file.read_bytes()[:200])
    with refuses("file-damaged", "file-001.mp4"):
        open_capture(folder, camera=PINHOLE)
    real = importlib.import_module

    def missing(name, *rest):
        if name == "av":
            raise ImportError("No module named 'av'")
        return real(name, *rest)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(MissingDependency, match=r"doo3d\[lerobot\]|\[lerobot\]"):
        open_capture(folder, camera=PINHOLE)

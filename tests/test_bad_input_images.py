"""Bad images and videos from the shell, in the 2-D mode: one sentence, exit code 2, nothing written; or a result."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders.captures import save

PRESETS = ["image", "paper_2d"]
RED = "segment.ranges=[{low: [170, 100, 60], high: [10, 255, 255]}]"


def wave(width: int, height: int) -> np.ndarray:
    t = np.linspace(0, 1, 300)
    return np.column_stack((width * (0.1 + 0.8 * t), height * (0.5 + 0.25 * np.sin(7 * t))))


def length(width: int, height: int) -> float:
    return float(np.linalg.norm(np.diff(wave(width, height), axis=0), axis=1).sum())


def rope(width: int = 320, height: int = 240, thick: int = 9) -> tuple[np.ndarray, np.ndarray]:
    """A red wave on grey: (H, W, 3) uint8 BGR, and its (H, W) uint8 mask."""
    line = wave(width, height).astype(np.int32)
    color, mask = np.full((height, width, 3), 170, np.uint8), np.zeros((height, width), np.uint8)
    cv2.polylines(color, [line], False, (40, 40, 200), thick)
    cv2.polylines(mask, [line], False, 255, thick)
    return color, mask


def photograph(color: np.ndarray | None = None, mask: np.ndarray | None = None) -> None:
    """Write a photograph and its mask, those of the rope where none are given."""
    usual = rope()
    save(Path("photo.jpg"), usual[0] if color is None else color)
    save(Path("m.png"), usual[1] if mask is None else mask)


@pytest.fixture
def found(doo3d):
    """Return a function that runs `detect`, checks for one chain in every frame, and returns the results."""

    def run(*args) -> list[dict]:
        code, _, err = doo3d("detect", *args, "-o", "found", "--force")
        assert code == 0, err
        names = [frame["name"] for frame in json.loads(Path("found/manifest.json").read_text())["frames"]]
        results = [json.loads(Path(f"found/{name}.json").read_text()) for name in names]
        assert [len(result["chains"]) for result in results] == [1] * len(names)
        assert all((result["mode"], result["units"]) == ("2d", "px") for result in results)
        assert all(Path(f"found/{name}.jpg").exists() for name in names)
        return results

    return run


@pytest.mark.parametrize("preset", PRESETS)
def test_a_photograph_and_its_mask(found, preset):
    photograph()
    (result,) = found("photo.jpg", "-c", preset, "--mask", "m.png")
    assert result["chains"][0]["length"] == pytest.approx(length(320, 240), abs=15)
    assert result["chains"][0]["radius"] == pytest.approx(5, abs=1)
    found("photo.jpg", "-c", preset, "--set", RED)


def test_kinds_of_images(found):
    color, mask = rope()
    deep = np.dstack([color.astype(np.uint16) * 257, np.full(mask.shape, 9, np.uint16)])
    for name, image in {"grey": color[:, :, 1], "deep": deep, "deep_grey": color[:, :, 1].astype(np.uint16) * 257}.items():
        save(Path(f"kinds/{name}.png"), image)
        save(Path(f"kinds/mask/{name}.png"), mask)
    assert len(found("kinds", "-c", "image")) == 3


def test_a_recorded_folder_in_2d(found, capture):
    folder = capture(frames=2, mask=True)
    (folder / "camera_intrinsic.json").unlink()
    assert len(found(folder, "-c", "image")) == 2


def test_a_video(found, doo3d):
    color, _ = rope()
    writer = cv2.VideoWriter("a.avi", cv2.CAP_FFMPEG, cv2.VideoWriter_fourcc(*"MJPG"), 20, (320, 240))
    for i in range(6):
        writer.write(np.roll(color, 2 * i, axis=0))
    writer.release()
    results = found("a.avi", "-c", "image", "--set", RED)
    assert [result["timestamp"] for result in results] == [i / 20 for i in range(6)]
    Path("a.avi").write_bytes(Path("a.avi").read_bytes()[:-20_000])
    code, out, err = doo3d("detect", "a.avi", "-c", "image", "--set", RED, "-o", "cut")
    assert code == 1
    assert "failed: a.avi: " in err
    assert "frames, " in out.splitlines()[-1]


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize(("value", "code"), [(0, "mask-empty"), (255, "mask-full")])
def test_masks_without_an_edge(refused, preset, value, code):
    photograph(mask=np.full((240, 320), value, np.uint8))
    assert "frame photo" in refused("photo.jpg", "-c", preset, "--mask", "m.png", code=code)


@pytest.mark.parametrize("preset", PRESETS)
def test_one_pixel(doo3d, refused, preset):
    photograph(np.full((1, 1, 3), 200, np.uint8), np.full((1, 1), 255, np.uint8))
    code, _, err = doo3d("detect", "photo.jpg", "-c", preset)
    assert code in (0, 2)
    assert "fault" not in err
    refused("photo.jpg", "-c", preset, "--mask", "m.png", "-o", "other", code="mask-full")


@pytest.mark.parametrize("preset", PRESETS)
def test_a_mask_of_one_pixel(doo3d, preset):
    mask = np.zeros((240, 320), np.uint8)
    mask[7, 9] = 255
    photograph(mask=mask)
    code, _, err = doo3d("detect", "photo.jpg", "-c", preset, "--mask", "m.png")
    assert code == 0
    assert "fault" not in err


def test_mask_of_another_size(refused):
    photograph(mask=rope()[1][:100])
    sentence = refused("photo.jpg", "-c", "image", "--mask", "m.png", code="mask-shape")
    assert all(part in sentence for part in ("m.png", "320x100", "320x240"))


def test_a_mask_a_pixel_off_is_cropped_with_a_note(doo3d):
    photograph(mask=np.pad(rope()[1], ((0, 1), (0, 1))))
    code, out, _ = doo3d("detect", "photo.jpg", "-c", "image", "--mask", "m.png")
    assert (code, out.count("the mask is 321x241 px and the image 320x240")) == (0, 1)


def test_truncated_photograph(refused):
    photograph()
    Path("photo.jpg").write_bytes(Path("photo.jpg").read_bytes()[:-500])
    assert "photo.jpg" in refused("photo.jpg", "-c", "image", code="file-damaged")


def test_an_image_in_3d(refused):
    photograph()
    assert "-c image" in refused("photo.jpg", code="mode-needs-depth")


def test_captures_without_images_in_2d(refused, capture):
    refused(capture(color=False), "-c", "image", code="mode-needs-image")
    np.savez("a.npz", points=np.random.default_rng(0).normal(size=(99, 3)))
    refused("a.npz", "-c", "image", code="mode-needs-image")


@pytest.mark.slow
@pytest.mark.parametrize("preset", PRESETS)
def test_a_hundred_megapixels(found, preset):
    photograph(*rope(12_500, 8_000, 40))
    (result,) = found("photo.jpg", "-c", preset, "--mask", "m.png")
    if preset == "image":
        assert result["chains"][0]["length"] == pytest.approx(length(12_500, 8_000), rel=0.01)

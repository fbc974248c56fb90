"""Wrong captures from the shell: `doo3d info` warns, `doo3d detect` notes it, and the manifest and the report keep it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders.paths import DATA, SAMPLES
from builders.runs import files_of, read_manifest

YELLOW = "segment.ranges=[{low: [15, 90, 60], high: [32, 255, 255]}]"


def checks(notes: list[str]) -> list[str]:
    """The notes without those on the method of segmentation."""
    return [note for note in notes if not note.startswith("segment: method")]


def altered(folder: Path, change: Callable[[np.ndarray], np.ndarray], times: int = 1) -> Path:
    """Write the sample capture, `times` times over, with its color images changed."""
    (folder / "color").mkdir(parents=True)
    (folder / "depth").mkdir()
    shutil.copy(SAMPLES / "crossing" / "camera_intrinsic.json", folder)
    for i in range(3 * times):
        cv2.imwrite(str(folder / "color" / f"{i:06d}.png"), change(cv2.imread(str(SAMPLES / f"crossing/color/{i % 3:06d}.jpg"))))
        shutil.copy(SAMPLES / f"crossing/depth/{i % 3:06d}.png", folder / "depth" / f"{i:06d}.png")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    ("option", "topic", "words"),
    [
        ("depth_scale=5000", "depth unit", "read as 5000 units per metre"),
        ("depth_scale=10000", "depth unit", "read as 10000 units per metre"),
        ("depth_scale=200", "depth unit", "multiples of 5 mm"),
        ("camera=[400,400,635,363]", "camera", "a field of view of 116 degrees"),
    ],
)
def test_wrong_numbers(doo3d, option, topic, words):
    sample = SAMPLES / "crossing"
    code, out, _ = doo3d("info", sample, "--input-option", option, "--samples", 1)
    assert code == 0
    assert f"warning         check the {topic}: " in out
    assert words in out
    code, out, _ = doo3d("detect", sample, "-o", "out", "--input-option", option, "--frames", "0,1")
    assert code == 0
    assert out.count(f"note: check the {topic}: ") == 1, "once, not for every frame"
    (note,) = checks(read_manifest(Path("out"))["notes"])
    assert note.startswith(f"check the {topic}: ")
    assert words in note
    assert "(frame 00000" in note
    assert note.endswith("of 2 frames)")


def test_right_numbers(doo3d):
    for name in ("crossing", "occluder"):
        code, out, err = doo3d("info", SAMPLES / name)
        assert (code, err) == (0, "")
        assert "check the" not in out
    code, out, err = doo3d("detect", SAMPLES / "crossing", "-o", "out", "--set", YELLOW)
    assert (code, err) == (0, "")
    assert "note" not in out
    assert checks(read_manifest(Path("out"))["notes"]) == []


@pytest.mark.slow
@pytest.mark.skipif(not (DATA / "device_files").is_dir(), reason="third-party data are absent")
def test_real_recordings(doo3d):
    """A script wrote millimetres into a folder that is read as 5000 units per metre; the other recordings are right."""
    _, out, _ = doo3d("info", DATA / "device_files" / "tum_unsorted", "--samples", 2)
    assert "check the depth unit: depths come in steps of 0.2 mm" in out
    assert "smaller by a factor of 5;" in out
    for name in ("device_files/realsense_sdk.bag", "rope_d435"):
        assert "check the" not in doo3d("info", DATA / name, "--samples", 2)[1]
    assert "check the" not in "".join(doo3d("detect", DATA / "rope_d435", "-o", "out")[1:])


@pytest.mark.slow
def test_color_beside_the_depth(doo3d, tmp_path):
    folder = altered(tmp_path / "shifted", lambda color: np.roll(color, -40, axis=1))
    code, out, _ = doo3d("info", folder)
    assert code == 0
    assert "check the registration: the color lies 40 px to the left" in out
    code, out, err = doo3d("detect", folder, "-o", "out")
    assert code == 0
    assert err.startswith("note: check the registration: the color lies 40 px to the left of where the depth has its edges (3.")
    assert checks(read_manifest(Path("out"))["notes"]) == [err.strip().removeprefix("note: ")]


@pytest.mark.slow
def test_red_and_blue_exchanged(doo3d, tmp_path):
    folder = altered(tmp_path / "bgr", lambda color: color[:, :, ::-1])
    code, _, err = doo3d("detect", folder, "-o", "out", "--set", YELLOW)
    assert code == 0
    assert err.startswith(
        "note: check the colors: nothing is found in segment.ranges, but with red and blue exchanged 1 chain is"
    )
    code, _, err = doo3d(
        "detect", folder, "-o", "out", "--set", "segment.ranges=[{low: [0, 250, 250], high: [2, 255, 255]}]", "--force"
    )
    assert "check the colors" not in err, "nothing is found either way"


@pytest.mark.slow
def test_notes_do_not_depend_on_workers_or_interruption(doo3d, tmp_path):
    folder = altered(tmp_path / "shifted", lambda color: np.roll(color, 40, axis=1), times=2)
    assert doo3d("detect", folder, "-o", "whole")[0] == 0
    assert doo3d("detect", folder, "-o", "workers", "--workers", 2)[0] == 0
    assert files_of(Path("whole")) == files_of(Path("workers"))
    journal = Path("workers/progress.jsonl")
    lines = journal.read_text().splitlines(keepends=True)
    values = json.loads(lines[1])
    for evidence in ({"shift": "x", "lengths": [[1]]}, 3):  # a journal that somebody edited
        journal.write_text("".join([lines[0], json.dumps(values | {"evidence": evidence}) + "\n", *lines[2:4]]))
        Path("workers/manifest.json").write_text(json.dumps(read_manifest(Path("workers")) | {"finished": False}))
        assert doo3d("detect", folder, "-o", "workers")[0] == 0
        assert read_manifest(Path("workers"))["notes"][0] == read_manifest(Path("whole"))["notes"][0]

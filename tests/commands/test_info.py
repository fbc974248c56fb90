"""`doo3d info` and the selection of frames, on the command line."""

import json
import os
from pathlib import Path

import cv2
import numpy as np
from builders.errors import code_in


def test_summary_of_a_folder(doo3d, capture):
    folder = capture(frames=3, mask=True)
    before = sorted(os.listdir())
    code, out, err = doo3d("info", folder)
    assert (code, err) == (0, "")
    rows = {line[2:16].strip(): line[18:] for line in out.splitlines()[1:]}
    assert out.splitlines()[0] == str(folder)
    assert rows == {
        "format": "folder: a folder of depth images",
        "frames": "3 frames, 000000 to 000002",
        "frames checked": "3, all can be read",
        "content": "depth, color, masks, no poses",
        "image": "320x240",
        "camera": "fx 400.00  fy 400.00  cx 160.00  cy 120.00 px",
        "depth": "0.495 to 0.560 m, median 0.560 m; 0.0% of the pixels without depth",
    }
    assert sorted(os.listdir()) == before  # nothing is drawn unless it is asked for


def test_bad_frames(doo3d, capture):
    folder = capture(frames=3)
    files = sorted((folder / "depth").iterdir())
    files[1].write_bytes(files[1].read_bytes()[:100])
    code, out, _ = doo3d("info", folder, "--contact-sheet", "sheet.png")
    assert code == 1
    assert "frames checked  3, of which 1 cannot be read" in out
    assert "unreadable      000001: " in out
    assert cv2.imread("sheet.png").shape[1] == 1600
    for file in files:
        file.write_bytes(b"")
    assert doo3d("info", folder)[0] == 2


def test_reasons_of_bad_frames_are_limited(doo3d, capture):
    folder = capture(frames=6)
    for file in (folder / "depth").iterdir():
        file.write_bytes(b"")
    code, out, _ = doo3d("info", folder)
    assert code == 2
    assert [line.split()[1] for line in out.splitlines() if "unreadable" in line] == ["000000:", "000001:", "000002:", "3"]
    assert "3 more, listed by --json" in out


def test_json(doo3d, capture):
    code, out, err = doo3d("info", capture(frames=9), "--json", "--samples", 2, "--every", 2, "--contact-sheet", "a.jpg")
    found = json.loads(out)
    assert code == 0
    assert (found["schema"], found["input"]["frames"], found["frames"], found["selection"]) == ("doo3d/info/2", 9, 5, "--every 2")
    assert [frame["index"] for frame in found["checked"]] == [0, 8]
    assert found["checked"][0]["camera"] == {"fx": 400.0, "fy": 400.0, "cx": 160.0, "cy": 120.0, "width": 320, "height": 240}
    assert "contact sheet -> a.jpg" in err


def test_a_cloud_and_a_video(doo3d):
    np.savez("scan.npz", points=np.random.default_rng(0).uniform(0, 1, (100, 3)))
    code, out, _ = doo3d("info", "scan.npz", "--contact-sheet", "scan.png")
    assert code == 0
    assert "content         points, no viewpoints" in out
    assert "cloud           100 points; x 0." in out
    video = cv2.VideoWriter("film.avi", cv2.VideoWriter_fourcc(*"MJPG"), 10, (64, 48))
    for i in range(12):
        video.write(np.full((48, 64, 3), 20 * i, np.uint8))
    video.release()
    code, out, _ = doo3d("info", "film.avi", "--start", "0.5s", "--contact-sheet", "film.png")
    assert code == 0
    assert "frames          7 frames, 000005 to 000011" in out
    assert "selection       --start 0.5s, of 12 frames" in out
    assert "time            0.600 s from 0.500 s, 10.00 per second" in out


def test_paths_refused_for_a_contact_sheet(doo3d, capture):
    folder = capture()
    for sheet, error_code in (
        (folder / "color" / "sheet.png", "out-in-input"),
        ("sheet.gif", "out-suffix"),
        ("sheet", "out-suffix"),
        (Path("nowhere") / "sheet.png", "out-unwritable"),
    ):
        code, _, err = doo3d("info", folder, "--contact-sheet", sheet)
        assert code == 2
        assert code_in(err) == error_code
        assert str(sheet) in err
        assert len(err.splitlines()) == 1
    assert sorted(os.listdir(folder / "color")) == ["000000.jpg"]


def test_contact_sheets_are_reproducible(doo3d, capture):
    folder = capture(frames=2)
    doo3d("info", folder, "--contact-sheet", "a.png")
    doo3d("info", folder, "--contact-sheet", "b.png")
    assert Path("a.png").read_bytes() == Path("b.png").read_bytes()


def test_detect_in_some_frames(doo3d, capture):
    folder = capture(frames=6)
    code, out, _ = doo3d("detect", folder, "--every", 2, "--start", 1, "--end", -1)
    assert code == 0
    assert sorted(Path("out").glob("0*.json")) == [Path(f"out/00000{i}.json") for i in (1, 3, 5)]
    assert out.splitlines()[-1] == "3 frames, 3 chains -> out"
    assert json.loads(Path("out/manifest.json").read_text())["input"]["selection"] == "--start 1 --end -1 --every 2"


def test_detect_refuses_a_selection_of_nothing(refused, capture):
    folder = capture(frames=2)
    assert "--start 2" in refused(folder, "--start", 2, code="selection-empty")
    assert " 7 " in refused(folder, "--frames", "0,7", code="frame-unknown")
    assert "--end 1s" in refused(folder, "--end", "1s", code="times-missing")


def test_manifest_names_external_masks_and_selection(doo3d, capture):
    folder = capture(frames=2, mask=True)
    doo3d("detect", folder, "--mask", folder / "mask", "--frames", 1)
    found = json.loads(Path("out/manifest.json").read_text())["input"]
    assert (found["masks"], found["selection"]) == (str(folder / "mask"), "--frames 1")


def test_compare_some_frames(doo3d, capture):
    doo3d("compare", capture(frames=3, mask=True), "--frames", "1")
    assert sorted(os.listdir("compare")) == ["000001.png", "comparison.json"]


def test_list_of_formats(doo3d):
    code, out, err = doo3d("info", "--formats")
    assert (code, err) == (0, "")
    assert {"bag", "cloud", "folder", "video"} <= {line.split()[0] for line in out.splitlines()}

"""Objects chosen in the first frame of a capture by `--points` and `--box`, and followed by their ids."""

import json

import numpy as np
import pytest
from builders.captures import save
from builders.drawn_masks import CAMERA, frame_of, line
from builders.errors import code_in, refuses
from builders.runs import break_frame, files_of, read_manifest

import doo3d as api
from doo3d.runs import methods

POINT = "200,195"  # on the upper one of two cables, which are 54 px apart
MATRIX = [CAMERA.fx, 0, 0, 0, CAMERA.fy, 0, CAMERA.cx, CAMERA.cy, 1]


@pytest.fixture
def two(tmp_path):
    """Five frames of two cables that sink, side by side, 3 cm apart; the third shows the lower one only."""
    folder = tmp_path / "two"
    for k in range(5):
        axes = [line((-0.15, y + 0.004 * k, 0.5), (0.15, y + 0.004 * k, 0.5)) for y in (-0.025, 0.005)]
        frame, mask = frame_of(*axes[k == 2 :])
        save(folder / "depth" / f"{k:06d}.png", np.rint(1000 * frame.depth).astype(np.uint16))
        save(folder / "mask" / f"{k:06d}.png", mask.astype(np.uint8) * 255)
    (folder / "camera_intrinsic.json").write_text(json.dumps({"width": 640, "height": 480, "intrinsic_matrix": MATRIX}))
    return folder


def heights(out):
    """For each frame of a run the heights of its chains, cm, and for each frame their ids."""
    chains = [json.loads(file.read_text())["chains"] for file in sorted(out.glob("0*.json"))]
    rows = [[round(100 * float(np.mean(chain["joints"], axis=0)[1]), 1) for chain in each] for each in chains]
    return rows, [[chain["id"] for chain in each] for each in chains]


def test_the_chosen_object_is_followed_and_never_exchanged_for_its_neighbor(two, doo3d, tmp_path):
    assert doo3d("detect", two, "-o", "out", "--points", POINT, "--instances")[0] == 0
    found, ids = heights(tmp_path / "out")
    assert [len(each) for each in found] == [1, 1, 0, 1, 1]
    assert [each[0] for each in found if each] == pytest.approx([-2.5, -2.1, -1.3, -0.9], abs=0.15)
    assert len({number for each in ids for number in each}) == 1
    made = read_manifest(tmp_path / "out")
    assert made["input"]["choice"] == {"points": [[200.0, 195.0, True]], "box": None}
    assert "finished already" in doo3d("detect", two, "-o", "out", "--points", POINT, "--instances")[2]
    code, _, err = doo3d("detect", two, "-o", "out", f"--points=-{POINT}", "--pictures", "none")
    assert (code, "other settings" in err) == (0, True)
    assert [len(each) for each in heights(tmp_path / "out")[0]] == [1, 1, 1, 1, 1]
    api.run(two, tmp_path / "python", points=[(200, 195, False)], pictures="none")
    assert files_of(tmp_path / "python") == files_of(tmp_path / "out")


@pytest.mark.parametrize("at", ["000001", "000002", "000003"])
def test_an_interrupted_run_ends_with_the_same_bytes(two, tmp_path, monkeypatch, at):
    given = {"points": POINT, "box": (0, 150, 639, 300), "pictures": "none"}
    api.run(two, tmp_path / "whole", **given)
    inner = methods.detect

    def interrupted(data, *arguments, **named):
        if data.name == at:
            raise KeyboardInterrupt
        return inner(data, *arguments, **named)

    monkeypatch.setattr(methods, "detect", interrupted)
    with pytest.raises(KeyboardInterrupt):
        api.run(two, tmp_path / "out", **given)
    monkeypatch.setattr(methods, "detect", inner)
    api.run(two, tmp_path / "out", **given)
    assert files_of(tmp_path / "out") == files_of(tmp_path / "whole")


def test_a_frame_that_is_tried_again(two, tmp_path):
    api.run(two, tmp_path / "whole", points=POINT, pictures="none", workers=2)
    content = (two / "depth/000001.png").read_bytes()
    break_frame(two, "000001")
    assert api.run(two, tmp_path / "out", points=POINT, pictures="none").failed == 1
    (two / "depth/000001.png").write_bytes(content)
    assert api.run(two, tmp_path / "out", points=POINT, pictures="none").failed == 0
    assert heights(tmp_path / "out") == heights(tmp_path / "whole")


def test_a_sequence(two, tmp_path):
    api.run(two, tmp_path / "all", sequence=True, pictures="none")
    api.run(two, tmp_path / "out", sequence=True, pictures="none", points=POINT)
    every, chosen = (heights(tmp_path / name) for name in ("all", "out"))
    (number,) = chosen[1][0]
    for rows, numbers, row, one in zip(*every, *chosen, strict=True):
        assert [height for height, id in zip(rows, numbers, strict=True) if id == number] == row
        assert set(one) <= {number}


def test_what_cannot_be_chosen(two, refused, capture, tmp_path):
    assert "5,5" in refused(two, "-o", "out", "--points", "5,5", code="place-missed")
    assert "0,0,20,20" in refused(two, "-o", "out", "--box", "0,0,20,20", code="place-missed")
    assert "'x'" in refused(two, "-o", "out", "--points", f"{POINT};x", code="place-invalid")
    refused(two, "-o", "out", "--fuse-views", "--box", "0,0,9,9", code="options-conflict")
    for k in range(2):
        save(tmp_path / "photos" / f"{k}.png", np.full((90, 120, 3), 90, np.uint8))
    refused(tmp_path / "photos", "-o", "out", "-c", "image", "--points", "5,5", code="options-conflict")
    with refuses("options-conflict", "points and box"):
        api.run(tmp_path / "photos", tmp_path / "out", "image", points=[(5, 5)])


def test_a_first_frame_that_fails(two, doo3d):
    break_frame(two, "000000")
    code, _, err = doo3d("detect", two, "-o", "out", "--points", POINT)
    assert (code, code_in(err.splitlines()[-1])) == (2, "place-missed")


def test_one_photograph(doo3d, tmp_path):
    _, mask = frame_of(line((-0.15, -0.025, 0.5), (0.15, -0.025, 0.5)), line((-0.15, 0.03, 0.5), (0.15, 0.03, 0.5)))
    color = np.full((*mask.shape, 3), 160, np.uint8)
    color[mask] = (40, 40, 200)
    save(tmp_path / "photo.png", color)
    save(tmp_path / "mask.png", mask.astype(np.uint8) * 255)
    assert doo3d("detect", "photo.png", "--mask", "mask.png", "-o", "out", "-c", "image", "--points", POINT)[0] == 0
    assert len(json.loads((tmp_path / "out/photo.json").read_text())["chains"]) == 1

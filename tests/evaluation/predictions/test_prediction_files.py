"""Files of predictions: what is read, and what is refused with the file's name and the reason."""

from __future__ import annotations

import json

import numpy as np
import pytest
from builders.errors import code_in, refuses
from builders.photos import cross, labelled, painted, save

from doo3d.evaluation.benchmark.cases import Case
from doo3d.evaluation.predictions.files import equal_chain, prediction_files, read_prediction

LINE = [[20, 75], [60, 75], [180, 75]]


def written(path, value):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(value if isinstance(value, str) else json.dumps(value))
    return path


@pytest.mark.parametrize(
    ("value", "code", "part"),
    [
        ("", "json-invalid", ""),
        ("{", "json-invalid", ""),
        ("[]", "prediction-invalid", "expected"),
        ({"chains": 3}, "prediction-invalid", "expected"),
        ({"chains": [4]}, "prediction-invalid", "chain 0"),
        ({"chains": [{"points": LINE}, {"radius": 1}]}, "prediction-invalid", "chain 1"),
        ({"chains": [{"points": [[1, 2]]}]}, "prediction-invalid", "(1, 2)"),
        ({"chains": [{"points": [[1, 2], [3]]}]}, "prediction-invalid", "chain 0"),
        ({"chains": [{"points": [[1, 2, 3], [3, 4, 5]]}]}, "prediction-invalid", "(P, 2)"),
        ({"chains": [{"points": [[1, 2], [1, 2]]}]}, "prediction-invalid", "the same"),
        ({"chains": [{"points": [[1, None], [1, 2]]}]}, "prediction-invalid", "finite"),
        ({"chains": [{"points": [[1, 2], [1e9, 2]]}]}, "prediction-invalid", "1e+09"),
        ({"chains": [{"points": LINE, "radius": 0}]}, "prediction-invalid", "radius"),
        ({"chains": [{"points": LINE, "radius": [1, 2]}]}, "prediction-invalid", "radius"),
        ({"chains": [{"points": LINE, "radius": "thick"}]}, "prediction-invalid", "thick"),
        ({"schema": "doo3d/detection/2"}, "results-damaged", ""),
        ({"schema": "other"}, "schema-unknown", ""),
    ],
)
def test_a_broken_file_of_chains_is_refused(tmp_path, value, code, part):
    path = written(tmp_path / "a.json", value)
    with refuses(code, "a.json", part):
        read_prediction([path], 2, (150, 200))


@pytest.mark.parametrize(
    ("image", "code", "part"),
    [
        (None, "image-unreadable", ""),
        (np.zeros((150, 200, 3), np.uint8), "prediction-invalid", "(150, 200, 3)"),
        (np.zeros((10, 20), np.uint8), "label-size", "20x10"),
    ],
)
def test_a_broken_image_is_refused(tmp_path, image, code, part):
    path = tmp_path / "a.png"
    for content in (b"", b"no image") if image is None else (b"",):
        path.write_bytes(content)
        if image is not None:
            save(path, image)
        with refuses(code, "a.png", part):
            read_prediction([path], 2, (150, 200))


def test_an_image_is_no_answer_in_space(tmp_path):
    with refuses("prediction-invalid", "a.png"):
        read_prediction([tmp_path / "a.png"], 3)


def test_an_empty_prediction_is_one(tmp_path):
    path = written(tmp_path / "a.json", {"chains": [], "ms": 7})
    read = read_prediction([path], 3)
    assert (read.detection.chains, read.ms) == ((), 7)


def test_files_are_found_in_folders_and_alone_if_that_is_clear(tmp_path):
    cases = [Case(name, family, lambda: None) for family, name in (("S1", "a"), ("S1", "b"), ("S2", "b"))]
    with refuses("file-missing", "nowhere"):
        prediction_files(tmp_path / "nowhere", cases)
    with refuses("predictions-missing", "S1/a.json"):
        prediction_files(tmp_path, cases)
    for name in ("a.json", "b.json", "S2/b.instances.png", "S2/b.json"):
        written(tmp_path / name, "")
    found = prediction_files(tmp_path, cases)
    assert found == {
        ("S1", "a"): [tmp_path / "a.json"],
        ("S1", "b"): [],
        ("S2", "b"): [tmp_path / "S2/b.json", tmp_path / "S2/b.instances.png"],
    }


def test_equal_segments_are_kept_and_others_resampled():
    chain = cross()[0]
    same = equal_chain(chain.joints, chain.radii)
    assert (same.joints == chain.joints).all()
    assert (same.radii == chain.radii).all()
    bent = equal_chain(np.array([(0.0, 0, 1), (0.1, 0, 1), (0.1, 0.3, 1)]), np.array(0.004))
    assert bent.length == pytest.approx(0.4, rel=0.01)
    assert np.abs(bent.joints[-1] - (0.1, 0.3, 1)).max() < 0.003
    assert bent.segment_length <= 0.005
    ring = equal_chain(np.array([(0.0, 0), (40, 0), (40, 30), (0, 0)]), np.array([1.0, 2, 3, 1]), closed=True)
    assert ring.joints[0] == pytest.approx(ring.joints[-1], abs=2.5)
    assert 1 <= ring.radii.min() <= ring.radii.max() <= 3


def test_the_command_says_which_file_and_why(doo3d, tmp_path):
    for name in ("img0", "img1"):
        save(tmp_path / f"set/S1/images/{name}.jpg", painted(labelled(cross())))
        save(tmp_path / f"set/S1/labels/{name}.png", labelled(cross()))
    code, out, err = doo3d("evaluate", "predictions", "none", "--data", "set")
    assert (code, out, code_in(err)) == (2, "", "file-missing")
    written(tmp_path / "mine/img1.json", {"chains": [{"points": LINE}]})
    code, out, err = doo3d("evaluate", "predictions", "mine", "--data", "set")
    assert code == 0, err
    assert "no prediction: S1/img0" in out
    assert "count wrong: S1/img1 1 of 2" in out
    save(tmp_path / "mine/img0.png", np.zeros((9, 9), np.uint8))
    code, out, err = doo3d("evaluate", "predictions", "mine", "--data", "set")
    assert (code, out, code_in(err)) == (2, "", "label-size")
    assert "img0.png" in err
    code, out, err = doo3d("evaluate", "predictions", "mine", "--data", "mine")
    assert (code, out, code_in(err)) == (2, "", "photos-missing")

"""Results read back: equal to what was written, damaged files are named."""

import json

import numpy as np
import pytest
from builders.chains import flat, helix
from builders.errors import refuses
from builders.paths import SAMPLES

import doo3d
from doo3d.inputs import open_capture
from doo3d.outputs.detection_json import dumps
from doo3d.outputs.run_reader import open_results, read_detection
from doo3d.runs.run import run as run_capture
from doo3d.types import Connection, Crossing, Detection, SegmentRef


@pytest.fixture(scope="module", params=["crossing", "photos"])
def run(request, tmp_path_factory):
    out = tmp_path_factory.mktemp("run") / "out"
    images_only = request.param == "photos"
    capture = open_capture(SAMPLES / request.param, images_only)
    run_capture(capture, out, doo3d.load_config("image" if images_only else "default"))
    return out


def connected() -> Detection:
    """A detection with everything that has a confidence: connections and crossings."""
    chains = (helix(id=0, connections=(Connection(4, 0.75), Connection(9, 0.25))), helix(12, 0.2, id=3))
    crossing = Crossing(SegmentRef(0, 3), SegmentRef(1, 5), np.array([0.1, 0.2, 0.7]), 0.5)
    return Detection(chains, frame="000000", timestamp=1.5, seconds={"fit": 0.25}, notes=("a note",), crossings=(crossing,))


@pytest.mark.slow
def test_detections_are_read_as_they_were_written(run):
    results = open_results(run)
    assert results.frames
    for name, found in zip(results.frames, results.detections(), strict=True):
        assert found.to_dict() == json.loads((run / f"{name}.json").read_text())
        for chain in found.chains:
            np.testing.assert_allclose(np.linalg.norm(np.diff(chain.joints, axis=0), axis=1), chain.segment_length, rtol=1e-9)


@pytest.mark.parametrize("detection", [connected(), flat(), Detection(())])
def test_a_detection_is_read_as_it_was_written(tmp_path, detection):
    (tmp_path / "a.json").write_text(dumps(detection.to_dict()))
    assert read_detection(tmp_path / "a.json").to_dict() == detection.to_dict()


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("{", "json-invalid"),
        ("[]", "schema-unknown"),
        ('{"schema": "doo3d/detection/1"}', "schema-unknown"),
        ('{"schema": "doo3d/detection/2"}', "results-damaged"),
        ('{"schema": "doo3d/detection/2", "mode": "4d"}', "results-damaged"),
    ],
)
def test_a_damaged_file_is_named(tmp_path, text, code):
    (tmp_path / "a.json").write_text(text)
    with refuses(code, "a.json"):
        read_detection(tmp_path / "a.json")


@pytest.mark.parametrize("text", [None, "{", "[]", '{"schema": "x"}', '{"schema": "doo3d/manifest/1", "frames": [1]}'])
def test_a_folder_without_results_is_refused(tmp_path, text):
    if text is not None:
        (tmp_path / "manifest.json").write_text(text)
    with refuses("results-missing" if text is None else "results-damaged", str(tmp_path)):
        open_results(tmp_path)

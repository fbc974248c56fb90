import json

import numpy as np
import pytest
from builders.errors import refuses

import doo3d
from doo3d.inputs import open_capture
from doo3d.outputs.run_reader import open_results, read_detection
from doo3d.runs import run as batch


@pytest.fixture(scope="module", params=["crossing", "photos"])
def run(request, tmp_path_factory):
    out = tmp_path_factory.mktemp("run") / "out"
    flat = request.param == "photos"
    capture = open_capture(f"sample_clouds/{request.param}", flat)
    batch.run(capture, out, doo3d.load_config("image" if flat else "default"))
    return out


def test_what_is_read_is_what_was_written(run):
    results = open_results(run)
    assert results.frames
    for name, found in zip(results.frames, results.detections(), strict=True):
        assert found.to_dict() == json.loads((run / f"{name}.json").read_text())
        for chain in found.chains:
            np.testing.assert_allclose(np.linalg.norm(np.diff(chain.joints, axis=0), axis=1), chain.segment_length, rtol=1e-9)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("{", "json-invalid"),
        ("[]", "schema-unknown"),
        ('{"schema": "doo3d/detection/1"}', "results-damaged"),
        ('{"schema": "doo3d/detection/1", "mode": "4d"}', "results-damaged"),
    ],
)
def test_a_damaged_file_is_named(tmp_path, text, code):
    (tmp_path / "a.json").write_text(text)
    with refuses(code, "a.json"):
        read_detection(tmp_path / "a.json")


@pytest.mark.parametrize("text", [None, "{", "[]", '{"schema": "x"}', '{"schema": "doo3d/manifest/1", "frames": [1]}'])
def test_a_folder_of_something_else_is_refused(tmp_path, text):
    if text is not None:
        (tmp_path / "manifest.json").write_text(text)
    with refuses("results-missing" if text is None else "results-damaged", str(tmp_path)):
        open_results(tmp_path)

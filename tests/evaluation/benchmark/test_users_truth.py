"""Truth that somebody wrote by hand, for a capture or for results that are there already."""

import json

import numpy as np
import pytest
from builders.errors import refuses
from builders.paths import SAMPLES
from builders.photos import save

from doo3d.evaluation.benchmark.cases import capture_cases
from doo3d.evaluation.benchmark.evaluate import result_rows
from doo3d.evaluation.truth_file import read_truth
from doo3d.kernels import lay_equal_chords
from doo3d.outputs.detection_json import dumps
from doo3d.outputs.run_reader import read_detection
from doo3d.types import Chain, Connection, Crossing, Detection, SegmentRef

CORNERS = [[-0.1, 0, 0.5], [0.0, 0.03, 0.5], [0.1, 0, 0.5]]


def write(path, frames, schema="doo3d/truth/1"):
    path.write_text(json.dumps({"schema": schema, "frames": frames}))
    return path


def test_a_few_points_and_the_radius_are_enough(tmp_path):
    (truth,) = read_truth(write(tmp_path / "t.json", {"a": [{"axis": CORNERS, "radius": 0.004}]}))["a"]
    steps = np.linalg.norm(np.diff(truth.axis, axis=0), axis=1)
    assert steps.max() < 0.00101
    assert truth.axis[[0, -1]].tolist() == [CORNERS[0], CORNERS[2]]
    assert truth.length == pytest.approx(2 * np.hypot(0.1, 0.03), rel=1e-3)
    assert np.abs(truth.axis - CORNERS[1]).max(axis=1).min() < 0.001
    assert truth.seen.all()
    assert not truth.closed


def test_what_is_hidden_and_rings_stay_so_when_laid_anew(tmp_path):
    angle = np.arange(40) * 2 * np.pi / 40
    ring = {
        "axis": np.column_stack((0.1 * np.cos(angle), 0.1 * np.sin(angle), np.full(40, 0.5))).tolist(),
        "radius": 0.004,
        "closed": True,
        "seen": [int(k >= 10) for k in range(40)],
    }
    (truth,) = read_truth(write(tmp_path / "t.json", {"a": [ring]}))["a"]
    assert truth.closed
    assert truth.length == pytest.approx(2 * np.pi * 0.1, rel=0.01)
    assert np.linalg.norm(truth.axis[0] - truth.axis[-1]) == pytest.approx(truth.spacing, rel=0.1)
    assert truth.seen.mean() == pytest.approx(0.75, abs=0.02)


def test_our_own_truth_is_left_as_it_is():
    values = json.loads((SAMPLES / "two_cables" / "truth.json").read_text())["frames"]["000000"]
    for cable, truth in zip(values, read_truth(SAMPLES / "two_cables" / "truth.json")["000000"], strict=True):
        assert truth.axis.tolist() == cable["axis"]


@pytest.mark.parametrize(
    ("cable", "parts"),
    [
        ({"axis": CORNERS}, ("frame a, cable 0",)),
        ({"axis": CORNERS, "radius": 0}, ("radius 0",)),
        ({"axis": [[0, 0], [1, 1]], "radius": 0.004}, ("axis (2, 2)",)),
        ({"axis": [[0, 0, float("nan")], [1, 1, 1]], "radius": 0.004}, ("axis (2, 3)",)),
        ({"axis": CORNERS, "radius": 0.004, "seen": [1]}, ("seen (1,)",)),
        ({"axis": [CORNERS[0]] * 2, "radius": 0.004}, ("cable 0",)),
        ([], ("cable 0",)),
    ],
)
def test_broken_cables_are_named(tmp_path, cable, parts):
    with refuses("truth-invalid", *parts):
        read_truth(write(tmp_path / "t.json", {"a": [cable]}))


@pytest.mark.parametrize("frames", [[], {"a": 3}, None])
def test_frames_that_are_none_are_refused(tmp_path, frames):
    with refuses("truth-invalid", "t.json"):
        read_truth(write(tmp_path / "t.json", frames))


def test_the_frames_that_the_truth_knows_are_scored(tmp_path):
    every = json.loads((SAMPLES / "crossing" / "truth.json").read_text())["frames"]
    some = write(tmp_path / "some.json", {name: every[name] for name in ("000000", "000002")})
    cases = capture_cases(SAMPLES / "crossing", some)
    assert [(case.name, case.family) for case in cases] == [("000000", "crossing"), ("000002", "crossing")]
    assert cases[1].load().data.depth.shape == (720, 1280)
    assert cases[1].load().mask is None
    own = np.zeros((720, 1280), np.uint8)
    own[100:200] = 255
    for name in every:
        save(tmp_path / "masks" / f"{name}.png", own)
    masked = capture_cases(SAMPLES / "crossing", some, masks=tmp_path / "masks")
    assert (masked[1].load().mask == (own > 0)).all()
    assert len(capture_cases(SAMPLES / "crossing")) == 3
    assert len(capture_cases(SAMPLES / "clouds" / "open.ply")) == 1
    with refuses("frame-unknown", "nope"):
        capture_cases(SAMPLES / "crossing", write(tmp_path / "other.json", {"nope": every["000000"]}))


TRUTH = {"a": [{"axis": CORNERS, "radius": 0.004}], "b": [{"axis": CORNERS, "radius": 0.004}]}


def detection(frame="a"):
    chain = Chain(lay_equal_chords(np.array(CORNERS), 0.01)[0], 0.01, 0.004, connections=(Connection(3, 0.7),))
    crossing = Crossing(SegmentRef(0, 2), SegmentRef(0, 9), np.array([0.0, 0.0, 0.5]), 0.9)
    return Detection((chain,), frame=frame, seconds={"fit": 0.5, "fill": 0.25}, crossings=(crossing,))


def test_what_was_written_is_read_back(tmp_path):
    (tmp_path / "a.json").write_text(dumps(detection().to_dict()))
    assert read_detection(tmp_path / "a.json").to_dict() == detection().to_dict()


def test_results_are_scored_and_a_frame_without_one_is_wrong(tmp_path):
    truth, out = write(tmp_path / "t.json", TRUTH), tmp_path / "out"
    out.mkdir()
    (out / "a.json").write_text(dumps(detection().to_dict()))
    first, second = result_rows(out, truth)
    assert first.correct, first.reasons
    assert (first.family, first.frame, first.ms, first.confidence, first.merges) == ("out", "a", 750, 0.7, 1)
    assert not second.correct
    assert (second.error, second.code) == ("no result", "results-missing")


def test_results_that_are_none_are_refused(tmp_path):
    truth = write(tmp_path / "t.json", TRUTH)
    with refuses("results-missing", "(a, b)"):
        result_rows(tmp_path, truth)
    for text, code in (
        ("{", "json-invalid"),
        ('{"schema": "x"}', "schema-unknown"),
        (dumps(detection().to_dict() | {"mode": "2d", "chains": []}), "results-2d"),
        (dumps(detection().to_dict() | {"chains": [{"joints": []}]}), "results-damaged"),
        (dumps(detection().to_dict() | {"coordinates": "mars"}), "results-damaged"),
    ):
        (tmp_path / "a.json").write_text(text)
        with refuses(code, "a.json"):
            result_rows(tmp_path, truth)
    with refuses("file-missing", "none.json"):
        read_detection(tmp_path / "none.json")

"""Rows as a summary, a CSV file and a JSON document; the worst of them, and their pictures."""

import csv
import io
import json

import cv2
import numpy as np
import pytest
from builders.chains import along

from doo3d.config import Config
from doo3d.evaluation.benchmark.cases import Case, KnownFrame
from doo3d.evaluation.benchmark.evaluate import frame_badness, frame_benchmark
from doo3d.evaluation.benchmark.pictures import frame_panels, matching_order, worst, write_pictures
from doo3d.evaluation.benchmark.tables import csv_text, format_table, json_text
from doo3d.evaluation.metrics.record import Record
from doo3d.evaluation.metrics.score import COLUMNS, score
from doo3d.evaluation.scenes.model import Truth
from doo3d.types import Camera, Cloud, Detection, Frame

CAMERA = Camera(fx=600.0, fy=600.0, cx=320.0, cy=240.0, width=640, height=480)
X = np.linspace(-0.1, 0.1, 401)
AXIS = np.column_stack((X, np.zeros(401), np.full(401, 0.5)))
TRUTH = Truth(AXIS, 0.004, seen=np.abs(X) > 0.01)


def found(axis=AXIS):
    return Detection((along(axis),))


def row(detection, family="one", name="a", seconds=0.02, data=None, seed=None):
    grey = np.full((480, 640, 3), 128, np.uint8)
    frame = Frame(grey, np.full((480, 640), 0.5, np.float32), CAMERA) if data is None else data
    case = Case(name, family, lambda: KnownFrame(frame, (TRUTH,)), seed=seed)
    end = {"confidence": 1.0, "ms": 1e3 * seconds, "error": None, "code": None}
    result = case.record(score(detection.chains, [TRUTH]) | end)
    result.detection = detection
    return result


def changed(record, **values):
    result = Record(record | values)
    result.case, result.detection = record.case, record.detection
    return result


def summary(rows):
    return {key: value for column in COLUMNS for key, value in column.summarize(rows).items()}


GOOD, NONE, SHORT = row(found()), row(Detection(()), "two", "b"), row(found(AXIS[:280]), "two", "c", 0.04)


def test_the_summary_counts_what_is_there_right_and_wrong():
    got = summary([GOOD, NONE, SHORT])
    assert (got["frames"], got["frames_correct"], got["count_correct"]) == (3, 1, 2)
    assert (got["occlusions"], got["occlusions_correct"], got["occlusions_incorrect"]) == (3, 2, 1)
    assert got["occlusions_accuracy"] == pytest.approx(2 / 3)
    assert got["connections"] == got["connections_correct"] == GOOD.connections + SHORT.connections
    assert (got["connections_incorrect"], got["connections_accuracy"]) == (0, 1)
    assert got["radius_ratio"] == 1
    assert got["ms"] == pytest.approx(20)
    assert np.isnan(got["merges_accuracy"])


def test_csv_has_a_line_per_frame():
    lines = list(csv.DictReader(io.StringIO(csv_text([GOOD, NONE]))))
    assert [line["frame"] for line in lines] == ["a", "b"]
    assert [line["correct"] for line in lines] == ["True", "False"]
    assert float(lines[0]["node_error"]) == GOOD.node_error
    assert lines[1]["node_error"] == lines[1]["error"] == lines[1]["code"] == ""
    assert "0 chains for 1 objects" in lines[1]["reasons"]


def test_json_has_the_summary_of_each_family_and_of_all_and_the_frames():
    values = json.loads(json_text([GOOD, NONE, SHORT], COLUMNS, {"seeds": 2}))
    assert values["settings"] == {"seeds": 2}
    assert list(values["summary"]) == ["one", "two", "all"]
    assert values["summary"]["two"]["frames_correct"] == 0
    assert values["summary"]["all"]["frames_accuracy"] == pytest.approx(1 / 3)
    assert values["summary"]["one"]["merges_accuracy"] is None
    assert [frame["frame"] for frame in values["frames"]] == ["a", "b", "c"]
    assert values["frames"][1]["rms_seen"] is None


def test_the_worst_come_first():
    better, poorer = (changed(GOOD, rms_hidden=error) for error in (1.0, 3.0))
    assert worst([better, NONE, poorer, SHORT], 4, frame_badness) == [NONE, SHORT, poorer, better]
    assert worst([better, poorer], 1, frame_badness) == [poorer]


def test_the_picture_shows_what_was_found_beside_the_truth():
    def blue(record):
        return [((half[:, :, 2].astype(int) - half[:, :, 0]) > 60).sum() for half in frame_panels(record)]

    both, none, short = map(blue, (GOOD, NONE, SHORT))
    assert both[0] > 0.7 * both[1] > 0
    assert none[0] == 0
    assert none[1] > 500
    assert 0.4 * short[1] < short[0] < 0.8 * short[1]
    assert frame_panels(GOOD)[0].shape[1] < 640  # only the part that the cable is in


def test_pictures_are_of_the_worst_and_a_sheet_of_all_failures(tmp_path):
    cloud = row(found(), name="cloud", data=Cloud(AXIS - np.array([0, 0, 0.004])))
    rows = [GOOD, cloud, changed(NONE, family="x/y z", error="no depth"), row(Detection(()), "x", "never seen", seed=1000)]
    paths = write_pictures(tmp_path / "new", rows, frame_benchmark(Config()), 2)
    assert [path.name for path in paths] == ["failures.png", "one_a.png", "one_cloud.png", "x_y_z_b.png"]
    sheet, *pictures = (cv2.imread(str(path)) for path in paths)
    assert sheet.shape[1] == 1600
    assert all(picture is not None for picture in pictures)
    paths = write_pictures(tmp_path / "good", [GOOD], frame_benchmark(Config()), 2)
    assert [path.name for path in paths] == ["one_a.png"]


def test_seeds_that_are_only_counted_have_a_column_of_their_own():
    looked, counted = row(found(), seed=0), row(Detection(()), name="b", seed=1000)
    assert (looked.counted, counted.counted) == (False, True)
    assert "looked at" not in format_table([looked], COLUMNS)
    titles, _, line = format_table([looked, counted], COLUMNS).splitlines()
    assert titles.split()[2:5] == ["looked", "at", "counted"]
    assert line.split()[:10] == ["one", "1/2", "50.0", "%", "1/1", "100.0", "%", "0/1", "0.0", "%"]


def test_the_truth_has_the_colors_of_the_chains_that_lie_on_it():
    cables = [found(AXIS + np.array([0, y, 0])).chains[0] for y in (0.0, 0.05, 0.1)]
    assert matching_order(cables, Detection((cables[2], cables[0]))) == (cables[2], cables[0], cables[1])
    assert matching_order(cables, Detection(())) == tuple(cables)
    assert matching_order([], Detection((cables[0],))) == ()

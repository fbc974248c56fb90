"""The table, with a detection that is known: the truth itself, nothing, or an error."""

from functools import partial

import cv2
import numpy as np
import pytest
from builders.chains import along
from builders.errors import refuses
from builders.paths import SAMPLES

from doo3d.config import Config, load_config
from doo3d.errors import ConfigError, InputError
from doo3d.evaluation.benchmark.cases import Case, folder_cases, known_frame, scene_cases
from doo3d.evaluation.benchmark.evaluate import _hsv_range, frame_benchmark
from doo3d.evaluation.benchmark.run import run_cases
from doo3d.evaluation.benchmark.tables import format_table
from doo3d.evaluation.metrics.confidence import most_confident
from doo3d.evaluation.metrics.correct import METRIC
from doo3d.evaluation.metrics.crossings import true_crossings
from doo3d.evaluation.metrics.record import Record
from doo3d.evaluation.metrics.score import COLUMNS
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.evaluation.truth_file import read_truth
from doo3d.types import Crossing, Detection, SegmentRef

SMALL = (640, 480)


def evaluate_rendered(scenes, *options):
    cases = [Case(each.frame.name, family, partial(known_frame, each)) for family, each in scenes]
    return run_cases(frame_benchmark(*options).measure, cases)


@pytest.fixture
def calls(monkeypatch):
    """What the detection was called with; `give` holds what it answers."""

    class Calls(list):
        give = ()
        given = None

    made = Calls()

    def detect(data, config, mask=None):
        made.append((data, config, mask))
        if isinstance(made.give, Exception):
            raise made.give
        return made.given or Detection(tuple(made.give))

    monkeypatch.setattr("doo3d.pipeline.detect", detect)
    return made


def test_perfect_chains_fill_the_table(calls):
    rendered = render(make_scene("crossing", 5, SMALL), "none")
    calls.give = [along(truth.axis, 0.01, truth.radius) for truth in rendered.truths]
    rows = evaluate_rendered([("crossing", rendered)], Config())
    assert rows[0].correct
    text = format_table(rows, COLUMNS)
    assert "1/1 100.0 %" in text
    assert "1.00" in text
    assert len({len(line) for line in text.splitlines()}) == 1


def test_the_table_has_the_most_confident_frames_and_the_upper_strands(calls):
    rendered = render(make_scene("crossing", 5, SMALL), "none")
    chains = tuple(along(truth.axis, 0.01, truth.radius) for truth in rendered.truths)
    (upper, lower), *_ = (true_crossings(rendered.truths).arc / 0.01).astype(int).tolist()
    for right in (True, False):
        places = SegmentRef(0, upper), SegmentRef(0, lower)
        calls.given = Detection(chains, crossings=(Crossing(*places[:: 1 if right else -1], np.zeros(3), 0.9),))
        (row,) = evaluate_rendered([("crossing", rendered)], Config())
        assert (row.crossings, row.crossings_correct, row.confidence) == (1, int(right), 1.0)
        assert ("1/1 100.0 %" if right else "0/1 0.0 %") in format_table([row], COLUMNS).splitlines()[-1].partition(" 0 ")[2]
    doubtful = [Record(row | {"confidence": k / 30, "correct": k > 2}) for k in range(20)]
    assert [row.confidence for row in most_confident(doubtful)] == [k / 30 for k in range(2, 20)]
    assert "17/20 85.0 %  100.0 %    94.4 %" in format_table(doubtful, COLUMNS)
    assert most_confident([]) == []
    assert len(most_confident(doubtful[:3])) == 2


def test_method_and_wanted_chains_are_passed_on(calls):
    scenes = [("several", render(make_scene("several", 6, SMALL), "none"))]
    evaluate_rendered(scenes, Config(), True, "mask")
    assert calls[-1][1].merge.chains == len(scenes[0][1].truths)
    assert calls[-1][2] is scenes[0][1].mask
    evaluate_rendered(scenes, Config(), False, "hsv")
    assert calls[-1][1].merge.chains is None
    assert calls[-1][1].segment.method == "hsv"
    assert calls[-1][2] is None
    evaluate_rendered(scenes, Config(), False, "auto")
    assert calls[-1][1].segment == Config().segment
    assert calls[-1][2] is None


def test_a_frame_that_fails_counts_as_wrong(calls):
    calls.give = InputError("no depth anywhere", code="depth-none")
    rows = run_cases(frame_benchmark(Config()).measure, scene_cases(["straight"], [0, 1], "none", SMALL))
    assert [(row.error, row.code) for row in rows] == [("no depth anywhere", "depth-none")] * 2
    assert rows[0]["code"] == "depth-none"
    assert "0/2 0.0 %" in format_table(rows, COLUMNS)


def test_the_number_of_chains_is_counted(calls):
    rendered = render(make_scene("several", 6, SMALL), "none")
    calls.give = [along(rendered.truths[0].axis, 0.01, rendered.truths[0].radius)]
    (one,) = evaluate_rendered([("several", rendered)], Config(), False)
    calls.give = [along(truth.axis, 0.01, truth.radius) for truth in rendered.truths]
    (all_,) = evaluate_rendered([("several", rendered)], Config(), False)
    values = {key: value for column in METRIC.columns for key, value in column.summarize([one, all_]).items()}
    assert (values["count_correct"], values["frames_correct"]) == (1, 1)
    assert "1/2 50.0 %   50.0 %" in format_table([one, all_], COLUMNS)


def test_a_config_for_two_dimensions_is_refused():
    with refuses("config-mode", kind=ConfigError):
        run_cases(frame_benchmark(load_config("image")).measure, scene_cases(["straight"], [0]))


def test_captures_are_scored_against_the_truth_beside_them(calls):
    truth = read_truth(SAMPLES / "straight" / "truth.json")["000000"]
    calls.give = [along(truth[0].axis, 0.01, truth[0].radius)]
    rows = run_cases(frame_benchmark(Config()).measure, folder_cases(SAMPLES))
    right = {row.family for row in rows if row.correct}
    assert right == {"straight"}
    assert [row.family for row in rows].count("crossing") == 3
    assert sum(row.family.startswith("clouds/") for row in rows) == 5


def test_no_captures_is_an_error(tmp_path):
    with refuses("truth-missing", "truth.json"):
        folder_cases(tmp_path)


@pytest.mark.slow
def test_color_boxes_hold_the_cable_and_nothing_else():
    for family, seed in (("crossing", 1), ("crossing", 3), ("open", 2), ("several", 6), ("straight", 0)):
        rendered = render(make_scene(family, seed, SMALL))
        box = _hsv_range(rendered.truths[0].color)
        low, high = np.array(box.low), np.array(box.high)
        hsv = cv2.cvtColor(np.asarray(rendered.frame.color), cv2.COLOR_RGB2HSV).astype(int)
        inside = ((hsv >= low) & (hsv <= high)).all(axis=-1)
        if low[0] > high[0]:
            inside = ((hsv[..., 0] >= low[0]) | (hsv[..., 0] <= high[0])) & ((hsv >= low) & (hsv <= high))[..., 1:].all(axis=-1)
        assert inside[rendered.mask].mean() > 0.85
        assert inside[~rendered.mask].mean() < 0.005

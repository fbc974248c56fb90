"""Scores of branched objects: sums, tables, the worst rows and their pictures."""

import json
from dataclasses import replace

import numpy as np
import pytest

from doo3d import load_config
from doo3d.errors import InputError
from doo3d.evaluation.benchmark.run import run_cases
from doo3d.evaluation.benchmark.tables import format_table, json_text
from doo3d.evaluation.benchmark.trees import tree_benchmark, tree_caption, tree_cases, true_trees
from doo3d.evaluation.metrics.record import Record
from doo3d.evaluation.metrics.trees import COLUMNS, score_trees, true_crossings
from doo3d.evaluation.scenes.registry import TREES, make_scene
from doo3d.types import Crossing, SegmentRef

NONE = dict.fromkeys(("objects", "right", "spurious", "junctions", "found", "false", "crossings", "taken", "crossed"), 0)


def row(family, ms=float("nan"), **counts):
    return Record({"family": family, "counted": False, "ms": ms} | NONE | counts)


CORRECT = {"objects": 1, "right": 1, "junctions": 2, "found": 2, "crossings": 1, "crossed": 1}
WRONG = {"objects": 2, "right": 1, "spurious": 2, "junctions": 4, "found": 3, "false": 1, "crossings": 1, "taken": 1}


def trees_of(families, config="harness", sensor="none", size=(320, 180)):
    benchmark = tree_benchmark(load_config(config))
    return benchmark, run_cases(benchmark.measure, tree_cases(families, [0], sensor, size))


def test_records_are_summed_by_family():
    rows = [row("a", **CORRECT), row("a", **WRONG), row("b", 50.0, **CORRECT)]
    table = format_table(rows, COLUMNS).splitlines()
    assert table[2].split() == ["a", "2/3", "67", "%", "2", "5/6", "83", "%", "1", "1/2", "1", "75.0", "%", "-"]
    assert table[3].split()[-1] == "50"
    assert json.loads(json_text(rows, COLUMNS, {}))["summary"]["all"]["objects"] == 4


@pytest.mark.parametrize("family", TREES)
def test_the_true_trees_are_right(family):
    for seed in range(2):
        scene = make_scene(family, seed)
        score = score_trees(true_trees(scene), scene)
        assert (score.right, score.found, score.faults) == (score.objects, score.junctions, 0)


def test_a_detection_that_fails_is_scored_without_chains(monkeypatch):
    def fail(*_, **__):
        raise InputError("there is no depth", code="depth-missing")

    monkeypatch.setattr("doo3d.pipeline.detect", fail)
    _, (record,) = trees_of(["tree"])
    assert (record.code, record.right, record.objects, record.correct) == ("depth-missing", 0, 1, False)
    assert "there is no depth" in tree_caption(record)
    assert record.error == "there is no depth"


def test_a_picture_shows_both_trees():
    benchmark, (record,) = trees_of(["tree_hidden"], size=(640, 360))
    for image in benchmark.panels(record):
        assert image.dtype == np.uint8
        assert image.shape[2] == 3


def test_a_crossing_counts_as_told_apart_only_where_it_is_detected():
    scene = make_scene("tree_two", 0)
    (point, *_) = true_crossings(scene)
    blind = true_trees(scene)
    seen = replace(blind, crossings=(Crossing(SegmentRef(0, 0), SegmentRef(1, 0), point + 0.002),))
    none, one = score_trees(blind, scene), score_trees(seen, scene)
    assert (none.crossed, one.crossed) == (0, 1)
    assert none.found == one.found

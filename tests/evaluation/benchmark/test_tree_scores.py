"""Scores of branched objects: sums, tables, the worst rows and their pictures."""

from dataclasses import replace

import numpy as np
import pytest

from doo3d import load_config
from doo3d.errors import InputError
from doo3d.evaluation.benchmark import trees
from doo3d.evaluation.benchmark.tree_pictures import tree_caption, tree_picture, true_trees
from doo3d.evaluation.benchmark.trees import TreeRow, evaluate_trees, tree_document, tree_table, worst_trees
from doo3d.evaluation.metrics.trees import TreeScore, score_trees, true_crossings
from doo3d.evaluation.scenes.registry import TREES, make_scene
from doo3d.types import Crossing, SegmentRef

CORRECT = TreeScore(objects=1, right=1, junctions=2, found=2, crossings=1, crossed=1)
WRONG = TreeScore(objects=2, right=1, spurious=2, junctions=4, found=3, false=1, crossings=1, taken=1)


def test_rows_are_summed_by_family_and_ordered_by_their_faults():
    rows = [TreeRow("a", "a_0", CORRECT), TreeRow("a", "a_1", WRONG), TreeRow("b", "b_0", CORRECT, 0.05)]
    assert (CORRECT.faults, CORRECT.correct) == (0, True)
    assert (WRONG.faults, WRONG.correct) == (6, False)
    assert [row.name for row in worst_trees(rows, 1)] == ["a_1", "b_0"]
    table = tree_table(rows).splitlines()
    assert table[1].split() == ["a", "2/3", "67", "%", "2", "5/6", "83", "%", "1", "1/2", "1", "75.0", "%"]
    assert table[2].split()[-1] == "50"
    assert tree_document(rows)["all"]["objects"] == 4
    assert tree_document([])["all"]["scenes"] == 0


@pytest.mark.parametrize("family", TREES)
def test_the_true_trees_are_right(family):
    for seed in range(3):
        scene = make_scene(family, seed)
        score = score_trees(true_trees(scene), scene)
        assert (score.right, score.found, score.faults) == (score.objects, score.junctions, 0)


def test_a_detection_that_fails_is_scored_without_chains(monkeypatch):
    def fail(*_):
        raise InputError("there is no depth", code="depth-missing")

    monkeypatch.setattr(trees, "detect", fail)
    (row,) = evaluate_trees(["tree"], [0], load_config("harness"), "none", (320, 180))
    assert (row.code, row.score.right, row.score.objects) == ("depth-missing", 0, 1)
    assert "1 of 1 scenes failed" in tree_table([row])
    assert "there is no depth" in tree_caption(row)
    assert tree_document([row])["frames"][0]["error"] == "there is no depth"


def test_a_picture_shows_both_trees_and_needs_the_scene():
    (row,) = evaluate_trees(["tree_hidden"], [0], load_config("harness"), "none", (640, 360))
    image = tree_picture(row)
    assert image.dtype == np.uint8
    assert image.shape[2] == 3
    with pytest.raises(ValueError, match="unknown"):
        tree_picture(TreeRow("a", "a_0", CORRECT))


def test_a_crossing_counts_as_told_apart_only_where_it_is_detected():
    scene = make_scene("tree_two", 0)
    (point, *_) = true_crossings(scene)
    blind = true_trees(scene)
    seen = replace(blind, crossings=(Crossing(SegmentRef(0, 0), SegmentRef(1, 0), point + 0.002),))
    none, one = score_trees(blind, scene), score_trees(seen, scene)
    assert (none.crossed, one.crossed) == (0, 1)
    assert none.told_apart < one.told_apart <= 1

"""The scores of predictions: equal to those of the detection itself, and right where the answer is known."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders.photos import COLORS, cross, labelled, painted, save, strand

from doo3d.evaluation.metrics import point_sets, run_length
from doo3d.evaluation.metrics.observed import Observed
from doo3d.evaluation.predictions.files import Prediction, equal_chain
from doo3d.evaluation.predictions.photos import label_crossings, photo_cases, score_prediction
from doo3d.evaluation.scenes.model import Truth
from doo3d.kernels import lay_equal_chords
from doo3d.types import Chain, Detection

APART = [strand((20, 30), (180, 30)), strand((20, 90), (180, 90))]
KEYS = ("drawn", "instances", "cables", "chains", "correct")


def of(labels, detection=None):
    return Prediction(detection, labels, float("nan"))


@pytest.fixture
def photographs(tmp_path):
    """Two photographs in mBEST's layout."""
    for stem, chains in (("img0", APART), ("img1", cross())):
        save(tmp_path / "set/S1/images" / f"{stem}.png", painted(labelled(chains)))
        save(tmp_path / "set/S1/labels" / f"{stem}.png", labelled(chains))
        save(tmp_path / "set/S1/given" / f"{stem}.png", 255 * (labelled(chains) > 0).astype(np.uint8))
    return tmp_path / "set"


def neutral(folder, to):
    """Rewrite results of doo3d as neutral files, with the labels in 8 bit."""
    to.mkdir()
    for path in sorted(folder.glob("img*.json")):
        chains = [{"points": c["joints"], "radius": c["radii"]} for c in json.loads(path.read_text())["chains"]]
        (to / path.name).write_text(json.dumps({"chains": chains}))
        labels = cv2.imread(str(path.with_suffix(".instances.png")), cv2.IMREAD_UNCHANGED)
        save(to / f"{path.stem}.png", labels.astype(np.uint8))


def test_the_own_output_has_the_scores_of_evaluate_dataset(doo3d, photographs, tmp_path):
    images = photographs / "S1"
    code, _, err = doo3d("evaluate", "dataset", "mbest", photographs, "--json", "known.json")
    assert code == 0, err
    options = ("-c", "image", "--mask", images / "given", "--instances", "--pictures", "none", "-o", "out")
    code, _, err = doo3d("detect", images / "images", *options)
    assert code == 0, err
    neutral(Path("out"), Path("neutral"))
    known = json.loads(Path("known.json").read_text())["frames"]
    assert known[1]["drawn"] > 0.9
    for folder in ("out", "neutral"):
        code, out, err = doo3d("evaluate", "predictions", folder, "--data", photographs, "--json", "mine.json")
        assert code == 0, err
        mine = json.loads(Path("mine.json").read_text())["frames"]
        assert [[row[key] for key in KEYS] for row in mine] == [[row[key] for key in KEYS] for row in known]
        assert "1/1 100.0 %" in out  # the upper strand


def test_instances_alone_are_scored():
    labels = labelled(cross())
    row = score_prediction(of(np.where(labels == 1, 900, labels).astype(int)), labels)
    assert (row.instances, row.chains, row.correct, row.crossings, row.crossings_correct) == (1, 2, True, 1, 1)
    assert np.isnan(row.drawn)
    assert row.run_squares == row.cable_squares > 0


def test_the_wrong_strand_on_top_is_seen():
    row = score_prediction(of(labelled(cross()[::-1]).astype(int)), labelled(cross()))
    assert (row.crossings, row.crossings_correct) == (1, 0)
    assert label_crossings(labelled(APART)) == []


def test_chains_alone_are_drawn_in_their_order():
    labels = labelled(cross())
    for order, right in ((1, 1), (-1, 0)):
        row = score_prediction(of(None, Detection(tuple(cross()[::order]), "2d", "image")), labels)
        assert row.drawn > 0.98
        assert (row.instances > 0.999) == (order == 1)
        assert row.crossings_correct == right


def test_splits_merges_and_swaps_end_a_run_in_the_image():
    labels = labelled(APART).astype(int)

    def length(numbers):
        row = score_prediction(of(numbers), labels)
        return row.run_squares / row.cable_squares

    right = np.arange(labels.shape[1])[None] >= 100
    assert length(np.where(right & (labels == 2), 3, labels)) == pytest.approx(0.75, abs=0.01)
    assert length((labels > 0).astype(int)) == pytest.approx(0.5, abs=0.01)
    assert length(np.where(right & (labels > 0), 3 - labels, labels)) == pytest.approx(0.25, abs=0.02)
    assert length(np.zeros_like(labels)) == 0


def test_an_image_without_cables_or_instances():
    empty = np.zeros((20, 30), np.uint8)
    row = score_prediction(of(empty.astype(int)), empty)
    assert (row.instances, row.correct, row.crossings, row.cable_squares) == (1, True, 0, 0)
    row = score_prediction(of(None, Detection((), "2d", "image")), labelled(APART))
    assert (row.drawn, row.instances, row.correct) == (0, 0, False)


def test_colored_labels_are_read_as_cset(tmp_path):
    for folder, image in (("images", painted(labelled(cross()))), ("labels", painted(labelled(cross())))):
        save(tmp_path / folder / "c1_0.png", cv2.resize(image, (640, 360), interpolation=cv2.INTER_NEAREST))
    (case,) = photo_cases(tmp_path)
    assert (case.family, case.load().cables, len(COLORS)) == ("C1", 2, 3)


def straight(y, length=0.6, seen=None):
    axis = np.column_stack((np.linspace(0, length, 1201), np.full(1201, y), np.ones(1201)))
    return Truth(axis, 0.005, seen=seen)


STEP = 0.00999  # so that 60 segments end just before 0.6 m


def along(*points):
    line = np.array([(*point, 1.0) for point in points])
    return equal_chain(np.array(lay_equal_chords(line, STEP)[0]), np.array(0.005))


TRUTHS = (straight(0.0), straight(0.2))
BOTH = (along((0, 0), (0.6, 0)), along((0, 0.2), (0.6, 0.2)))


def run_share(*chains, truths=TRUTHS):
    values = run_length.measure(Observed(chains, truths))
    return values["run_squares"] / values["cable_squares"]


def test_splits_and_merges_end_a_run_in_space():
    assert run_share(*BOTH) == pytest.approx(1, abs=0.01)
    assert run_share(*BOTH[::-1], BOTH[0]) == pytest.approx(1, abs=0.01)  # once is enough
    halves = along((0, 0), (0.3, 0)), along((0.3, 0), (0.6, 0))
    assert run_share(*halves, BOTH[1]) == pytest.approx(0.75, abs=0.02)
    merged = along((0, 0), (0.6, 0), (0.6, 0.2), (0.02, 0.2))
    assert run_share(merged) == pytest.approx(0.5, abs=0.03)
    assert run_share() == 0
    ring = Truth(0.1 * np.array([(np.cos(a), np.sin(a), 10) for a in np.linspace(0, 2 * np.pi, 1257)[:-1]]), 0.005, closed=True)
    around = Chain(lay_equal_chords(ring.line, 0.01)[0], 0.01, 0.005)
    assert run_share(around, truths=(ring,)) == pytest.approx(1, abs=0.05)


def test_sets_of_points_and_nodes_have_known_distances():
    seen = np.arange(1201) < 600
    truth, moved = straight(0.0, seen=seen), along((0, 0.004), (0.6, 0.004))
    values = point_sets.measure(Observed((moved,), (truth,)))
    for name in ("to_truth", "to_chains", "position_rms", "nodes_seen", "nodes_hidden"):
        assert values[name] == pytest.approx(4, abs=0.05), name
    assert (values["f_2"], values["f_5"], values["f_10"]) == (0, 1, 1)
    assert values["edge_error"] == pytest.approx(0, abs=1e-3)
    short = point_sets.measure(Observed((along((0, 0), (0.54, 0)),), (truth,)))
    assert short["edge_error"] == pytest.approx(0.1, abs=0.01)
    assert short["f_2"] == pytest.approx(2 * 0.903 / 1.903, abs=0.01)
    empty = point_sets.measure(Observed((), (truth,)))
    assert empty["f_10"] == 0
    assert np.isnan([empty[name] for name in ("to_truth", "to_chains", "position_rms", "edge_error")]).all()


def test_an_empty_and_a_right_prediction_in_space(doo3d, tmp_path):
    truth = {"schema": "doo3d/truth/1", "frames": {"a": [{"axis": [[0, 0, 1], [0.3, 0, 1]], "radius": 0.005}]}}
    points = np.column_stack((np.linspace(0, 0.3, 40), np.zeros(40), np.ones(40)))
    for name in ("one_1", "one_2"):
        (tmp_path / "set").mkdir(exist_ok=True)
        np.savez(tmp_path / "set" / f"{name}.npz", points=points)
        cable = {**truth, "frames": {name: truth["frames"]["a"]}}
        (tmp_path / "set" / f"{name}.truth.json").write_text(json.dumps(cable))
    write = partial(lambda name, chains: (tmp_path / name).write_text(json.dumps({"chains": chains, "ms": 8})))
    (tmp_path / "mine").mkdir()
    write("mine/one_1.json", [])
    write("mine/one_2.json", [{"points": points.tolist(), "radius": 0.005}])
    code, out, err = doo3d("evaluate", "predictions", "mine", "--data", "set", "--json", "rows.json")
    assert code == 0, err
    assert "1/2 50.0 %" in out
    rows = json.loads((tmp_path / "rows.json").read_text())["frames"]
    assert [(row["correct"], row["ms"]) for row in rows] == [(False, 8), (True, 8)]
    assert rows[1]["f_2"] == pytest.approx(1)

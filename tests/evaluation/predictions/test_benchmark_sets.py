"""The benchmark's own data: written the same every time, with a card, and read as captures with truth."""

from __future__ import annotations

import json

import pytest
from builders.errors import code_in

from doo3d.evaluation.predictions import sets
from doo3d.evaluation.predictions.frames import frame_cases


@pytest.fixture
def small(monkeypatch):
    """Sets of a family each, and sequences of three frames."""
    for name, family in (("frames", "straight"), ("sequences", "dragged"), ("harness", "tree"), ("bundles", "bundle")):
        monkeypatch.setitem(sets.SETS, name, sets.SETS[name]._replace(families=(family,), seeds=1))
    monkeypatch.setattr(sets, "SEQUENCE_FRAMES", 3)


def test_sets_are_written_and_scored(doo3d, small, tmp_path):
    code, out, err = doo3d("evaluate", "sets", "data", "--size", "320x240")
    assert code == 0, err
    assert len(out.splitlines()) == 12
    for name in sets.SETS:
        card = (tmp_path / "data" / name / "README.md").read_text()
        assert "MIT" in card
        assert sets.SETS[name].content in card
        cases = frame_cases(tmp_path / "data" / name / "test")
        assert len(cases) == (3 if name == "sequences" else 1)
        assert {case.family for case in cases} == set(sets.SETS[name].families)
        assert cases[0].load().mask.any()
    trees = json.loads((tmp_path / "data/harness/test/tree_6000/trees.json").read_text())
    assert trees[0]["edges"]
    code, _, err = doo3d("evaluate", "sets", "again", "--size", "320x240", "--sets", "bundles")
    assert code == 0, err
    for path in (tmp_path / "again").rglob("*.*g"):
        assert path.read_bytes() == (tmp_path / "data" / path.relative_to(tmp_path / "again")).read_bytes()
    (tmp_path / "none").mkdir()
    code, out, err = doo3d("evaluate", "predictions", "none", "--data", "data/bundles/test")
    assert (code, out, code_in(err)) == (2, "", "predictions-missing")
    assert "bundle_6000/000000.json" in err


def test_an_unknown_set_is_named(doo3d):
    code, out, err = doo3d("evaluate", "sets", "data", "--sets", "ropes")
    assert (code, out, code_in(err)) == (2, "", "choice-unknown")

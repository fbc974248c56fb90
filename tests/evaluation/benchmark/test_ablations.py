"""Ablations: each turns off what it names, by settings or constants, and leaves nothing changed behind."""

from __future__ import annotations

import importlib
from functools import lru_cache

import numpy as np
import pytest

from doo3d.config import load_config
from doo3d.config.loading import known_keys
from doo3d.evaluation.benchmark.ablations import ABLATIONS, DEFAULT, Ablation, ablated_config, constants_set, run_ablations
from doo3d.evaluation.benchmark.cases import Case, KnownFrame, known_frame
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.pipeline import run_stages

MODULE = "doo3d.stages.refine.axis_and_radius"
WEIGHT, SMOOTHING = f"{MODULE}:DEPTH_WEIGHT", f"{MODULE}:SMOOTHING_RADII"
PARTS_OFF = [name for name in ABLATIONS if name != DEFAULT]


def value_of(key: str) -> object:
    module, _, name = key.partition(":")
    return getattr(importlib.import_module(module), name)


@lru_cache
def known(family: str = "hairpin", seed: int = 2) -> KnownFrame:
    return known_frame(render(make_scene(family, seed, (640, 480))))


@lru_cache
def products(name: str) -> list[np.ndarray]:
    """The points of a frame's paths and chains."""
    ablation = ABLATIONS[name]
    frame = known("crossings", 4)
    with constants_set(ablation.constants):
        stages = run_stages(frame.data, ablated_config("default", {}, ablation), frame.mask)
    return [*(path.points for path in stages.paths), *(chain.joints for chain in stages.chains)]


@pytest.mark.parametrize("name", PARTS_OFF)
def test_every_setting_and_constant_exists_and_is_changed(name):
    ablation, default = ABLATIONS[name], load_config("default")
    assert ablation.settings or ablation.constants
    for key, value in ablation.settings.items():
        section, _, field = key.partition(".")
        assert key in known_keys()
        assert getattr(getattr(default, section), field) != value
    for key, value in ablation.constants.items():
        assert value_of(key) != value


def test_constants_are_set_and_restored_even_after_an_error():
    before = value_of(WEIGHT)

    def fail() -> None:
        with constants_set({WEIGHT: 1.0}):
            assert value_of(WEIGHT) == 1.0
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert value_of(WEIGHT) == before


def test_an_unknown_constant_is_refused_and_nothing_is_set():
    before = value_of(WEIGHT)
    with pytest.raises(AttributeError, match="NO_SUCH_WEIGHT"), constants_set({WEIGHT: 1.0, f"{MODULE}:NO_SUCH_WEIGHT": 1.0}):
        pass
    assert value_of(WEIGHT) == before


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in PARTS_OFF if ABLATIONS[name].constants])
def test_every_constant_has_an_effect(name):
    """A constant that is copied into another module by name would be set without one."""
    changed, default = products(name), products(DEFAULT)
    assert len(changed) != len(default) or not all(map(np.array_equal, changed, default))


def test_rows_are_those_of_each_ablation(monkeypatch):
    ablations = {
        DEFAULT: Ablation(),
        "one axis": Ablation({"refine.iterations": 0}, {SMOOTHING: 1.0}),
    }
    monkeypatch.setattr("doo3d.evaluation.benchmark.ablations.ABLATIONS", ablations)
    seen, reported = [], []

    def detect_case(case, frame, config):
        seen.append((config.refine.iterations, value_of(SMOOTHING), config.merge.max_gap))
        return case.name

    monkeypatch.setattr("doo3d.evaluation.benchmark.ablations.detect_case", detect_case)
    loads = []
    cases = [Case(name, "f", lambda: loads.append(1)) for name in "ab"]
    rows = run_ablations(cases, "default", {"merge.max_gap": 0.1}, reported.append)
    assert rows == {DEFAULT: ["a", "b"], "one axis": ["a", "b"]}
    assert (reported, len(loads)) == (["a", "b"], 2)
    iterations, smoothing = load_config("default").refine.iterations, value_of(SMOOTHING)
    assert seen == [(iterations, smoothing, 0.1), (0, 1.0, 0.1)] * 2

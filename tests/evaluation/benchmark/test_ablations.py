"""The bill of the method: each step can be taken out, is put back, and its row counts the frames that it changes."""

from __future__ import annotations

import importlib
import inspect
import pickle

import numpy as np
import pytest
from builders.blue_cable import DEPTH, SEEN, frame

from doo3d.config import SegmentConfig, load_config
from doo3d.config.loading import known_keys
from doo3d.evaluation.benchmark.ablations import (
    bill_of,
    format_ablations,
    replaced,
    rows_of,
    run_ablations,
    sign_test,
)
from doo3d.evaluation.benchmark.source_size import size_of
from doo3d.evaluation.benchmark.steps import ABLATIONS, Ablation
from doo3d.evaluation.benchmark.trials import KINDS, Outcome, Trial, make_trials
from doo3d.segment import segment, strand_filter

MODULE = "doo3d.scene.axis"
WEIGHT = f"{MODULE}:DEPTH_WEIGHT"
OUTCOME = Outcome(True, True, 2, 2, 0.9, 10.0)


def value_of(place: str) -> object:
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)


@pytest.mark.parametrize("name", ABLATIONS)
def test_every_setting_and_place_exists_and_is_changed(name):
    ablation = ABLATIONS[name]
    assert ablation.settings or ablation.places
    assert set(ablation.made_for) <= set(KINDS)
    assert not ablation.modules or size_of(ablation.modules).lines > 10
    for key, value in ablation.settings.items():
        section, _, field = key.partition(".")
        assert key in known_keys()
        presets = [load_config(preset) for preset in ("default", "image", "tubes")]
        assert any(getattr(getattr(preset, section), field) != value for preset in presets)
    for place, value in ablation.places.items():
        assert value_of(place) is not value


PLACES = {f"{name}, {place}": (place, value) for name, each in ABLATIONS.items() for place, value in each.places.items()}


@pytest.mark.parametrize("name", PLACES)
def test_what_is_put_in_the_place_of_a_function_takes_its_arguments(name):
    place, value = PLACES[name]
    if inspect.isfunction(former := value_of(place)):
        signature = inspect.signature(value)
        given = [each for each in inspect.signature(former).parameters.values() if each.kind is each.POSITIONAL_OR_KEYWORD]
        signature.bind(*(each.name for each in given))
        signature.bind(*(each.name for each in given if each.default is each.empty))


def torn_cable():
    """A frame whose cable reads the depth of what lies behind it over most of its length, and has holes."""
    depth = np.where(SEEN, DEPTH, 0.9)
    columns = np.flatnonzero(SEEN.any(axis=0))
    for start in range(columns[0] + 14, columns[-1], 60):
        depth[:, start : start + 40] = 0.9
    depth[SEEN & (np.random.default_rng(0).random(SEEN.shape) < 0.3)] = 0
    return frame(depth)


@pytest.mark.parametrize(
    "name",
    [
        "strand filter",
        "strand filter: runs of readings",
        "strand filter: all pixels of a smoothed strand",
    ],
)
def test_a_torn_frame_is_another_without_a_step_of_the_strand_filter(name):
    complete = segment(torn_cable(), SegmentConfig(), SEEN).scene
    with replaced(ABLATIONS[name].places):
        without = segment(torn_cable(), SegmentConfig(), SEEN).scene
    assert not np.array_equal(complete.points, without.points)


def test_without_what_is_beside_a_strand_its_depth_is_as_where_that_is_not_known():
    strand = 1.0 + 0.12 * np.sin(np.arange(500) / 90)
    depth = np.repeat(1.65 + np.random.default_rng(0).normal(scale=0.08, size=50), 10)
    for first, length in ((40, 14), (120, 14), (235, 14), (320, 40), (460, 14)):
        depth[first : first + length] = strand[first : first + length]
    limits = {"deviations": 3, "noise_radii": 0.15, "max_in_front": 0.1, "max_slope": 8}

    def smooth(surface):
        return strand_filter.smooth_strand_depth(1 / depth, np.ones(500, bool), surface, 0.004, 600.0, 1.7, **limits)[0]

    beside = np.full(500, 1 / 1.65)
    unknown = smooth(np.zeros(0))
    assert np.abs(smooth(beside) - unknown).max() > 0.1
    with replaced(ABLATIONS["strand filter: the background is recognized beside the strand"].places):
        np.testing.assert_array_equal(smooth(beside), unknown)


def test_constants_are_set_and_restored_even_after_an_error():
    before = value_of(WEIGHT)

    def fail() -> None:
        with replaced({WEIGHT: 1.0}):
            assert value_of(WEIGHT) == 1.0
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert value_of(WEIGHT) == before


def test_an_unknown_constant_is_refused_and_nothing_is_set():
    before = value_of(WEIGHT)
    with pytest.raises(AttributeError, match="NO_SUCH_WEIGHT"), replaced({WEIGHT: 1.0, f"{MODULE}:NO_SUCH_WEIGHT": 1.0}):
        pass
    assert value_of(WEIGHT) == before


def test_a_frame_is_not_run_again_without_a_function_that_it_does_not_call(monkeypatch):
    module = "doo3d.evaluation.benchmark.ablations"
    called = f"{module}:sign_test"
    steps = {
        "called": Ablation(places={called: lambda *_: 0.0}),
        "not called": Ablation(places={f"{module}:bill_of": lambda *_: None}),
        "constant": Ablation(places={WEIGHT: 1.0}),
        "setting": Ablation({"refine.iterations": 1}),
    }
    monkeypatch.setattr(f"{module}.ABLATIONS", steps)
    runs = []

    def run(settings):
        runs.append((settings, value_of(called)(1, 0), value_of(WEIGHT)))
        return OUTCOME

    run_ablations(Trial("frames", "a", lambda: run), list(steps))
    weight = value_of(WEIGHT)
    assert runs[2:] == [({}, 0.0, weight), ({}, 1.0, 1.0), ({"refine.iterations": 1}, 1.0, weight)]


def test_a_row_counts_what_a_step_makes_right_and_wrong(monkeypatch):
    monkeypatch.setattr(
        "doo3d.evaluation.benchmark.ablations.ABLATIONS", {"step": Ablation(modules=("skeleton.thin",), made_for=("images",))}
    )
    wrong = OUTCOME._replace(right=False, crossings_right=1, ms=4.0)
    results = [
        (Trial("images", "gained", lambda: None), OUTCOME, {"step": wrong}),
        (Trial("frames", "lost", lambda: None), wrong, {"step": OUTCOME}),
        (Trial("frames", "same", lambda: None), OUTCOME, {"step": OUTCOME}),
    ]
    own, all_ = bill_of(results, "step", ("images",)), bill_of(results, "step")
    assert (own.frames, own.gained, own.lost, own.crossings_gained) == (1, 1, 0, 1)
    assert own.ms == pytest.approx(6)
    assert (all_.frames, all_.gained, all_.lost, all_.crossings_gained) == (3, 1, 1, 0)
    lines = format_ablations(rows_of(results, ["step"])).splitlines()
    assert lines[1].split()[:4] == ["step", "own", "1", "+1"]
    assert lines[2].split()[:4] == ["all", "3", "+1", "-1"]


def test_the_sign_test_is_that_of_a_fair_coin():
    assert sign_test(0, 0) == 1
    assert sign_test(3, 3) == 1
    assert sign_test(5, 0) == pytest.approx(2 / 2**5)
    assert sign_test(0, 5) == sign_test(5, 0)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_data_is_detected_and_scored(kind):
    run = next(make_trials([kind], ["straight"], [0], (320, 240))).load()
    outcome = run({})
    assert outcome.ms > 0
    assert 0 <= outcome.confidence <= 1
    assert run({})._replace(ms=0) == outcome._replace(ms=0)


def test_a_trial_can_be_sent_to_a_worker():
    trial = next(make_trials(["frames"], ["straight"], [0], (320, 240)))
    sent = pickle.loads(pickle.dumps(trial))
    assert (sent.kind, sent.name, sent.load.args) == (trial.kind, trial.name, trial.load.args)

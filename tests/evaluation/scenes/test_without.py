"""The families without a cable: what they show, that they render with every sensor, and that nothing to find is right."""

from dataclasses import replace

import numpy as np
import pytest
from builders.chains import straight

from doo3d.config import load_config
from doo3d.evaluation.benchmark.cases import known_frame, scene_cases
from doo3d.evaluation.benchmark.evaluate import detect_case, frame_benchmark
from doo3d.evaluation.benchmark.run import run_cases
from doo3d.evaluation.benchmark.tables import format_table
from doo3d.evaluation.metrics.score import COLUMNS
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.model import Grain
from doo3d.evaluation.scenes.registry import WITHOUT, make_scene
from doo3d.types import Detection, Frame

SMALL = (320, 180)


@pytest.mark.parametrize("family", WITHOUT)
@pytest.mark.parametrize("sensor", ["d435", "stereo", "none"])
def test_they_render_with_every_sensor_and_hold_nothing(family, sensor):
    rendered = render(make_scene(family, 0, SMALL), sensor)
    known = known_frame(rendered)
    assert known.truths == ()
    assert not rendered.mask.any()
    assert rendered.frame.color.std() > 2
    assert np.mean(rendered.frame.depth > 0) > 0.5


def test_a_bar_that_throws_a_shadow_is_out_of_sight():
    scene = make_scene("shadows", 2, (640, 360))
    bars = [solid for solid in scene.occluders if (solid.vertices[:, 2] < 0).all()]
    assert bars
    with_shadow, without = (
        render(replace(scene, occluders=tuple(kept)), "none")
        for kept in (scene.occluders, [solid for solid in scene.occluders if not any(solid is bar for bar in bars)])
    )
    assert np.array_equal(with_shadow.exact, without.exact)
    darker = without.frame.color.astype(int).mean(axis=2) - with_shadow.frame.color.astype(int).mean(axis=2) > 12
    assert 0.002 < darker.mean() < 0.3


def test_the_rings_of_wood_are_a_pitch_apart():
    grain = Grain(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.01, 0.4, 0.0)
    points = np.column_stack((np.linspace(0, 0.04, 4001), np.zeros((4001, 2))))
    brightness = grain.brightness(points)
    assert brightness.min() == pytest.approx(0.6, abs=2e-3)
    assert brightness.max() == 1
    jumps = np.flatnonzero(np.diff(brightness) > 0.3)
    assert np.diff(points[jumps, 0]) == pytest.approx(0.01, abs=2e-5)


def test_the_slope_of_a_wide_wall_is_no_edge():
    frame = render(make_scene("office", 1, SMALL), "d435").frame
    assert np.mean(frame.depth == 0) < 0.1


@pytest.mark.parametrize("mode", ["default", "image"])
def test_right_is_no_chain_with_nothing_given(monkeypatch, mode):
    (case,) = scene_cases(["boxes"], [0], "none", SMALL)
    seen = []

    def detect(data, config, mask=None):
        seen.append((type(data), config.merge.chains, mask))
        return answer

    monkeypatch.setattr("doo3d.pipeline.detect", detect)
    answer = Detection(())
    assert detect_case(case, case.load(), load_config(mode), True, "mask").correct
    answer = Detection((straight(0, 1.0),))
    row = detect_case(case, case.load(), load_config(mode), True, "mask")
    assert not row.correct
    assert row.reasons == ("1 chains for 0 objects", "100% off")
    assert seen == [(Frame, None, None)] * 2


def test_the_table_says_how_many_frames_show_no_chain(monkeypatch):
    monkeypatch.setattr("doo3d.pipeline.detect", lambda data, config, mask=None: Detection(()))
    cases = scene_cases(["boxes"], [0, 1], "none", SMALL)
    assert format_table(run_cases(frame_benchmark(load_config("default")).measure, cases), COLUMNS).splitlines()[-1] == (
        "no chain in 2/2 100.0 % of the frames without a cable"
    )
    with_cable = scene_cases(["straight"], [0], "none", SMALL)
    assert "without a cable" not in format_table(run_cases(frame_benchmark(load_config("default")).measure, with_cable), COLUMNS)

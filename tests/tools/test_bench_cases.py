"""The frames that are timed without an input. No test asserts a duration."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.config import load_config
from doo3d.tools.bench_cases import CASES, LARGE_CASE, BenchCase, cloud, photo, scene, stereo_scene, time_cases
from doo3d.tools.benchmark import table


def named(text: str) -> list[BenchCase]:
    return [case for case in CASES if text in case.name]


def test_every_kind_of_data_is_timed():
    names = [case.name for case in (*CASES, LARGE_CASE)]
    assert len(set(names)) == len(names)
    for kind in ("crossing, mask given", "tangle", "several", "ragged mask", "image", "paper_2d", "9,000 points", "1,000,000"):
        assert any(kind in name for name in names)


def test_images_are_timed_with_their_presets_and_shown_in_one_table():
    wanted = named("1 cable")
    timings = list(time_cases(load_config("default"), 2, wanted))
    assert [timing.name for timing in timings] == [case.name for case in wanted]
    assert all(timing.size == "640x480" and timing.chains == 1 for timing in timings)
    lines = table(timings)
    assert lines[0].split() == ["ms", "chains", "median", "95", "%", "yardsticks"]
    assert [line.split()[-4] for line in lines[1:3]] == ["1", "1"]
    assert len({len(line) for line in lines[:3]}) == 1
    assert "2 runs of each frame" in lines[4]


def test_a_2d_configuration_times_each_image_once_with_itself():
    timings = list(time_cases(load_config("paper_2d"), 1, named("5 cables")))
    assert [timing.name for timing in timings] == ["photograph, 5 cables"]


def test_the_process_that_renders_reports_its_errors():
    with pytest.raises(ZeroDivisionError):
        list(time_cases(load_config("default"), 1, [BenchCase("none", _broken)]))


def _broken():
    raise ZeroDivisionError


def test_a_cloud_has_as_many_points_as_wanted_and_a_photograph_a_mask():
    assert len(cloud(500).data.points) == 500
    assert len(cloud(9_000).data.points) == 9_000
    made = photo(3, 4)
    assert made.mask.shape == made.data.color.shape[:2] == (480, 640)


@pytest.mark.slow
def test_a_ragged_mask_is_not_the_true_one_and_no_mask_is_none():
    rough = stereo_scene("coil")
    assert rough.data.depth.shape == rough.mask.shape == (720, 1280)
    assert scene("crossing", False).mask is None
    assert np.array_equal(stereo_scene("coil").mask, rough.mask)

"""Medians of parts of an array, and percentiles, against NumPy."""

import numpy as np
import pytest

from doo3d.kernels import middle_medians, part_medians, percentiles, upper_of_groups


def test_medians_are_those_of_numpy_without_values_that_are_not_finite():
    rng = np.random.default_rng(0)
    values = np.where(rng.random(200) < 0.2, np.nan, rng.normal(size=200))
    values[40:44], values[3] = np.nan, np.inf
    first = np.array([0, 40, 41, 100, 150, 150, 7])
    last = np.array([10, 44, 42, 160, 200, 150, 8])
    medians, deviations, counts = part_medians(values, first, last)
    for k, (start, stop) in enumerate(zip(first, last, strict=True)):
        part = values[start:stop]
        part = part[np.isfinite(part)]
        assert counts[k] == len(part)
        middle = np.median(part) if len(part) else np.nan
        np.testing.assert_array_equal(medians[k], middle)
        np.testing.assert_array_equal(deviations[k], np.median(np.abs(part - middle)) if len(part) else np.nan)
    assert np.isnan(medians).any()


@pytest.mark.parametrize("size", [1, 2, 5, 20, 99])
def test_percentiles_are_those_of_numpy_without_values_that_are_not_finite(size):
    values = np.random.default_rng(size).normal(size=size)
    percents = np.array([0.0, 15, 33.3, 50, 85, 90, 100])
    np.testing.assert_array_equal(percentiles(np.append(values, (np.nan, np.inf)), percents), np.percentile(values, percents))
    assert np.isnan(percentiles(np.array([np.nan]), percents)).all()


@pytest.mark.parametrize("size", [1023, 1024, 2001, 5000])
def test_medians_of_many_values_are_those_of_numpy(size):
    rng = np.random.default_rng(size)
    rare = np.zeros(size)
    rare[:: size // 65] = rng.normal(size=len(rare[:: size // 65]))  # no value that is drawn is near the median
    for values in (rng.normal(size=size), rng.integers(0, 4, size).astype(float), np.arange(size) * 1.0, np.ones(size), rare + 9):
        medians, deviations, _ = part_medians(values, np.zeros(1, int), np.array([size]))
        assert medians[0] == np.median(values)
        assert deviations[0] == np.median(np.abs(values - medians[0]))


@pytest.mark.parametrize("seed", range(5))
def test_values_below_the_uppermost_share_of_each_group(seed):
    rng = np.random.default_rng(seed)
    group, values = rng.integers(0, 40, 200), np.round(rng.normal(size=200), 1)
    found, count = upper_of_groups(values, group, 45, 0.35)
    for k in range(45):
        own = np.sort(values[group == k])
        assert count[k] == len(own)
        assert found[k] == (own[len(own) - 1 - int(0.35 * (len(own) - 1))] if len(own) else 0.0)


@pytest.mark.parametrize("count", [1, 2, 7, 1500])
def test_medians_over_the_second_axis_are_those_of_numpy(count):
    values = np.random.default_rng(count).normal(size=(4, count, 3))
    np.testing.assert_array_equal(middle_medians(values), np.median(values, axis=1))


def test_an_empty_second_axis_has_no_medians():
    with pytest.raises(ValueError, match="second axis"):
        middle_medians(np.zeros((2, 0, 3)))

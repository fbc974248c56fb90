"""Medians and percentiles without values that are not finite."""

import numpy as np
import pytest

from doo3d.geometry.order_statistics import finite_median, finite_percentiles

PERCENTS = np.array([0.0, 15, 50, 100])


@pytest.mark.parametrize("size", [0, 1, 2, 5])
def test_values_that_are_not_finite_do_not_count(size):
    values = np.random.default_rng(size).normal(size=size)
    some = np.append(values, (np.nan, np.inf))
    np.testing.assert_array_equal(finite_median(some), np.median(values) if size else np.nan)
    expected = np.percentile(values, PERCENTS) if size else [np.nan] * 4
    np.testing.assert_allclose(finite_percentiles(some, PERCENTS), expected, rtol=1e-12)

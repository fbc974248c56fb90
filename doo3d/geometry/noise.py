"""The noise of measurements, in numbers that outliers do not move."""

MAD_TO_DEVIATION = 1.4826
"""Standard deviations per median absolute deviation of normally distributed errors: 1 / 0.6745, the upper quartile."""

"""The noise of measurements, and how many of them tell a value."""

MAD_TO_DEVIATION = 1.4826
"""Standard deviations per median absolute deviation of normally distributed errors: 1 / 0.6745, the upper quartile."""

DEVIATIONS = 3.0
"""Standard deviations beyond which a measurement is an outlier: 0.3 % of normally distributed errors are."""

COLOR_NOISE = 6.0
"""Difference of 8-bit colors, in RGB or CIELAB, that noise and shading along one strand explain."""

ENOUGH_SAMPLES = 10_000
"""Samples from which a median is taken where there are more: that of normal errors is then off by 1.25 / sqrt(10,000) of their
deviation, about 1 %."""

"""Define the noise of measurements: outliers, depth, color, sample counts."""

MAD_TO_DEVIATION = 1.4826
"""Standard deviations per median absolute deviation of normally distributed errors: 1 / 0.6745, the upper quartile."""

DEVIATIONS = 3.0
"""Number of standard deviations beyond which a measurement is an outlier: 0.3 % of normally distributed errors are."""

OUTLIER_DEVIATIONS = 2.0
"""Number of standard deviations at which a residual has a weight of 0.25 in a robust fit (Geman-McClure weight)."""

NOISE_RADII = 0.15
"""Largest noise of depth, in radii, at which a strand is measured well: with more noise, depth is smoothed over more, and
weighs less."""

COLOR_NOISE = 6.0
"""Difference of 8-bit colors, in RGB or CIELAB, that noise and shading along one strand explain."""

LAB_NOISE = COLOR_NOISE / 2
"""The same in CIELAB, where lightness has 100 levels and not 256: standard deviation of a strand's color along its length."""

SURFACE_SAMPLES = 20_000
"""Largest number of pixels or points of the object for measuring its axis, and of pixels around it for learning the colors of
its surround; more are thinned evenly. An axis of 200 samples has 100 for each, whose mean is off by a tenth of their noise."""

SAMPLES = 2000
"""Number of values for estimating medians, percentiles and planes, drawn evenly from more. The standard error of the median of
N values with standard deviation s is 1.25 s / sqrt(N): 2.8 % of s."""

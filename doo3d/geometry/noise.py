"""The noise of measurements, and how many of them tell a value."""

MAD_TO_DEVIATION = 1.4826
"""Standard deviations per median absolute deviation of normally distributed errors: 1 / 0.6745, the upper quartile."""

DEVIATIONS = 3.0
"""Standard deviations beyond which a measurement is an outlier: 0.3 % of normally distributed errors are."""

OUTLIER_DEVIATIONS = 2.0
"""Standard deviations at which a residual weighs a quarter in a robust fit (Geman-McClure)."""

NOISE_RADII = 0.15
"""Radii; noise of depth up to which a strand is measured well: louder noise is smoothed over more, and weighs less."""

COLOR_NOISE = 6.0
"""Difference of 8-bit colors, in RGB or CIELAB, that noise and shading along one strand explain."""

LAB_NOISE = COLOR_NOISE / 2
"""The same in CIELAB, where lightness has 100 levels and not 256: the deviation of a strand's color along its length."""

SURFACE_SAMPLES = 20_000
"""Pixels or points of the object that its axis is measured on, and pixels around it that the colors of its surround are learned
from; more are thinned evenly. An axis of 200 samples has 100 for each, whose mean is off by a tenth of their noise."""

SAMPLES = 2000
"""Values that medians, percentiles and planes are estimated from, drawn evenly from more. The standard error of the median of N
values with standard deviation s is 1.25 s / sqrt(N): 2.8 % of s."""

"""The noise of measurements, in numbers that outliers do not move."""

MAD_TO_DEVIATION = 1.4826
"""Standard deviations per median absolute deviation of normally distributed errors: 1 / 0.6745, the upper quartile."""

SAMPLES = 2000
"""Values that medians, percentiles and planes are estimated from, drawn evenly from more. The standard error of the median of N
values with standard deviation s is 1.25 s / sqrt(N): 2.8 % of s."""

"""The smooth curve through the depth along a strand, against NumPy and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import median_filter, uniform_filter1d

from doo3d.geometry.polyline import unit, whittaker_smooth
from doo3d.kernels import smooth_depth_beside, smooth_strand_depth, visits

MEDIAN_RADII, TORN_RADII, SMOOTHINGS, FIRST_WEIGHT, MAD = 12.0, 2.5, 4, 1e-3, 1.4826  # as in the kernel
BEHIND, UNUSUAL, STRETCH = 0.3, 0.8, 5.0
DEVIATIONS, SMOOTHING_RADII, NOISE_RADII, MAX_IN_FRONT, MAX_SLOPE = 3.0, 1.7, 0.15, 0.1, 8.0
LIMITS = {"deviations": DEVIATIONS, "noise_radii": NOISE_RADII, "max_in_front": MAX_IN_FRONT, "max_slope": MAX_SLOPE}
FOCAL = 600.0
UNKNOWN = np.zeros(0)


def deviation(values):
    return MAD * np.median(np.abs(values))


def slow_running_median(values, half):
    third = max(1, half // 3)
    padded = []
    for end in (values[:half], values[::-1][:half]):
        near, far = np.median(end[:third]), np.median(end[-third:])
        slope = (far - near) / max(1, len(end) - third)
        padded.append(near - slope * (np.arange(1, half + 1) + (third - 1) / 2))
    whole = np.concatenate((padded[0][::-1], values, padded[1]))
    return median_filter(whole, 2 * half + 1)[half : half + len(values)]


def slow_strand_samples(value, at, surface, radius, radius_px):
    """Return the samples of the chain of runs that costs least, by trying all runs before each."""
    per_radius = radius * np.median(value[at]) ** 2
    height, far = value[at] / per_radius, (surface[at] if len(surface) else np.full(len(at), np.inf)) / per_radius
    slopes = np.abs(np.diff(height)) * radius_px / np.diff(at)
    runs = np.split(np.arange(len(at)), np.flatnonzero(slopes > MAX_SLOPE) + 1)

    def off_line(readings, line, is_inside):
        off = height[readings] - line
        explained = (off < -TORN_RADII) & (2 * height[readings] < line + far[readings])
        unusual = (np.abs(off) > TORN_RADII) & ~explained
        stretches = int(explained.any()) + int((unusual & ((off < 0) | is_inside)).any())
        return explained.sum() * BEHIND + unusual.sum() * UNUSUAL + stretches * STRETCH

    chains = []
    for first in (run[0] for run in runs):
        found = [(off_line(np.arange(first), height[first], False), [len(chains)])]
        for cost, chain in chains[::-1]:
            last = runs[chain[-1]][-1]
            slope = abs(height[first] - height[last]) * radius_px / (at[first] - at[last])
            between = np.arange(last + 1, first)
            line = np.interp(at[between], [at[last], at[first]], [height[last], height[first]])
            found.append((cost + slope**2 + off_line(between, line, True), [*chain, len(chains)]))
        chains.append(min(found, key=lambda each: each[0]))
    whole = []
    for (cost, chain), run in zip(chains, runs, strict=True):
        rest = np.arange(run[-1] + 1, len(at))
        whole.append((cost + off_line(rest, height[run[-1]], False), chain))
    return at[np.concatenate([runs[k] for k in min(whole, key=lambda each: each[0])[1]])]


def slow_curve_from(first, filled, measured, counted, radius, radius_px):
    per_meter = np.median(first) ** 2
    smooth, least = first, np.inf
    for _ in range(SMOOTHINGS):
        residual = filled - smooth
        least = min(least, deviation(residual[counted]))
        cut = np.maximum(DEVIATIONS * least, TORN_RADII * radius * smooth**2)
        inlier = np.maximum(0.0, 1 - (residual / cut) ** 2) ** 2 * counted
        noise = max(least / per_meter / radius, NOISE_RADII)
        length = SMOOTHING_RADII * radius_px * np.sqrt(noise / NOISE_RADII)
        weight = inlier + FIRST_WEIGHT
        target = (inlier * filled + FIRST_WEIGHT * first) / weight
        smooth = whittaker_smooth(target[:, None], weight[:, None, None], length**4)[:, 0]
    depth = 1 / smooth
    behind = np.where(counted, 1 / filled - depth, 0.0)
    waves = deviation(uniform_filter1d(behind, 2 * max(1, round(radius_px)) + 1, mode="nearest")[counted])
    torn = measured & (1 / filled - depth > TORN_RADII * radius)
    return depth, waves, np.mean((filled - smooth > cut) & counted), np.mean(torn)


def slow_curve(value, measured, surface, radius):
    at = np.flatnonzero(measured)
    filled = np.interp(np.arange(len(value)), at, value[at])
    radius_px = radius * FOCAL * np.median(value[at])
    first = slow_running_median(filled, min(max(2, round(MEDIAN_RADII * radius_px)), len(value) // 4))
    curve = slow_curve_from(first, filled, measured, measured, radius, radius_px)
    if curve[2] <= MAX_IN_FRONT and curve[1] <= TORN_RADII * radius:
        return curve
    samples = slow_strand_samples(filled, at, surface, radius, radius_px)
    first = np.interp(np.arange(len(value)), samples, filled[samples])
    counted = measured & (np.abs(filled - first) < TORN_RADII * radius * np.median(first) ** 2)
    return slow_curve_from(first, filled, measured, counted, radius, radius_px)


@pytest.mark.parametrize("samples", [4, 13, 60, 400])
@pytest.mark.parametrize("seed", range(4))
def test_against_numpy(seed, samples):
    random = np.random.default_rng(seed)
    inverse = 1 / (0.6 + 0.1 * np.sin(np.arange(samples) / 50)) + random.normal(scale=0.01, size=samples)
    torn = np.convolve(random.normal(size=samples), np.ones(15))[:samples] > 6
    inverse[torn] = 1 / 0.9
    measured = random.random(samples) < 0.8
    measured[random.integers(samples)] = True
    found = smooth_strand_depth(inverse, measured, UNKNOWN, 0.004, FOCAL, SMOOTHING_RADII, **LIMITS)
    for value, expected in zip(found, slow_curve(inverse, measured, UNKNOWN, 0.004), strict=True):
        np.testing.assert_allclose(value, expected, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("beside", [None, 0.9, 1.25])
@pytest.mark.parametrize("seed", range(12))
def test_where_most_of_a_strand_is_torn_its_own_runs_are_as_with_numpy(seed, beside):
    random = np.random.default_rng(seed)
    samples = int(random.integers(40, 300))
    strand = 1 / (0.8 + 0.1 * np.sin(np.arange(samples) / 60))
    behind = np.repeat(random.random(samples // 10 + 1) < random.uniform(0.4, 0.8), 10)[:samples]
    inverse = np.where(behind, 1 / 1.2, strand) + random.normal(scale=0.004, size=samples)
    if seed % 2:
        inverse[-6:] = 1 / 0.6  # the rim of an occluder
    measured = random.random(samples) < 0.9
    measured[0] = True
    surface = UNKNOWN if beside is None else np.full(samples, 1 / beside)
    found = smooth_strand_depth(inverse, measured, surface, 0.004, FOCAL, SMOOTHING_RADII, **LIMITS)
    for value, expected in zip(found, slow_curve(inverse, measured, surface, 0.004), strict=True):
        np.testing.assert_allclose(value, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("rim", [0, 12])
def test_a_strand_that_is_torn_over_most_of_its_length_is_where_its_own_readings_are(rim):
    strand = np.linspace(0.80, 0.90, 200)
    depth = np.full(200, 1.2)
    for first in (0, 60, 110, 170):
        depth[first : first + 18] = strand[first : first + 18]
    if rim:
        depth[-rim:] = 0.6
    found, _, in_front, torn = smooth_strand_depth(
        1 / depth, np.ones(200, bool), UNKNOWN, 0.004, FOCAL, SMOOTHING_RADII, **LIMITS
    )
    np.testing.assert_allclose(found, strand, atol=0.002)
    assert in_front == 0
    assert torn > 0.5


def test_a_strand_far_before_the_surface_is_where_nothing_but_a_strand_can_be():
    """Its patches of readings lie at different depths: a level line through one of them leaves the others between it and the
    surface beside the strand, where only the strand can be."""
    strand = 1.0 + 0.12 * np.sin(np.arange(500) / 90)
    depth = np.repeat(1.65 + np.random.default_rng(0).normal(scale=0.08, size=50), 10)
    patches = [slice(first, first + 14) for first in (40, 120, 235, 460)] + [slice(320, 360)]
    for patch in patches:
        depth[patch] = strand[patch]
    errors = []
    for surface in (np.full(500, 1 / 1.65), UNKNOWN):
        found, *_ = smooth_strand_depth(1 / depth, np.ones(500, bool), surface, 0.004, FOCAL, SMOOTHING_RADII, **LIMITS)
        errors.append(max(np.abs(found - strand)[patch].max() for patch in patches))
    assert errors[0] < 0.002
    assert errors[1] > 0.1


@pytest.mark.parametrize("length", [20, 30])
def test_a_curve_between_a_strand_and_what_lies_behind_is_not_believed(length):
    """Where about half of the readings are those of what lies behind, the noise of a curve hides that it is wrong."""
    depth = np.full(320, 0.95)
    for first in range(60, 320, 2 * length):
        depth[first : first + length] = 1.7
    found, waves, *_ = smooth_strand_depth(1 / depth, np.ones(320, bool), UNKNOWN, 0.004, FOCAL, SMOOTHING_RADII, **LIMITS)
    np.testing.assert_allclose(found, 0.95, atol=1e-6)
    assert waves < 1e-6


def test_the_work_on_noise_grows_with_the_square_of_the_length_at_most():
    """Each reading is a run of its own."""

    def work(count):
        value = 1 / np.random.default_rng(0).uniform(0.3, 2.0, count)
        before = visits()
        smooth_strand_depth(value, np.ones(count, bool), np.full(count, 0.5), 0.003, 600.0, SMOOTHING_RADII, **LIMITS)
        return visits() - before

    assert work(2000) < 4 * work(1000) < 20_000_000


def test_a_curve_through_a_straight_line_is_the_line():
    straight = np.linspace(2.0, 0.8, 200)
    depth, waves, in_front, torn = smooth_strand_depth(
        straight, np.ones(200, bool), UNKNOWN, 0.004, FOCAL, SMOOTHING_RADII, **LIMITS
    )
    np.testing.assert_allclose(depth, 1 / straight, rtol=1e-9)
    assert waves < 1e-9
    assert in_front == torn == 0


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({1: np.zeros(9, bool)}, "nothing is measured"),
        ({1: np.ones(8, bool)}, "lengths"),
        ({2: np.ones(8)}, "surface has another length"),
        ({3: 0.0}, "positive"),
    ],
)
def test_bad_arguments_are_refused(change, match):
    arguments = [np.ones(9), np.ones(9, bool), UNKNOWN, 0.004, FOCAL, SMOOTHING_RADII]
    for position, value in change.items():
        arguments[position] = value
    with pytest.raises(ValueError, match=match):
        smooth_strand_depth(*arguments, **LIMITS)


def slow_depth_beside(line, reach, beyond, mask, depth, strength):
    along = uniform_filter1d(np.gradient(line.astype(float), axis=0), 9, axis=0, mode="nearest")
    lateral = unit(along)[:, ::-1] * (-1, 1)
    offset = reach[:, None] + beyond
    places = line[:, None] + np.concatenate((-offset, offset), axis=1)[..., None] * lateral[:, None]
    u, v = np.rint(places).astype(int).transpose(2, 0, 1)
    inside = (u >= 0) & (v >= 0) & (u < mask.shape[1]) & (v < mask.shape[0])
    u, v = np.where(inside, u, 0), np.where(inside, v, 0)
    readings = np.where(inside & ~mask[v, u] & (depth[v, u] > 0), depth[v, u], np.float32(np.nan))
    known = np.flatnonzero(np.isfinite(readings).any(axis=1))
    if 2 * len(known) < len(line):
        return np.zeros(0)
    surface = np.interp(np.arange(len(line)), known, np.nanmedian(readings[known], axis=1))
    weight = np.ones(len(line))
    for _ in range(SMOOTHINGS):
        smooth = whittaker_smooth(surface[:, None], weight[:, None, None], strength)[:, 0]
        residual = surface - smooth
        weight = 1 / (1 + (residual / max(2 * deviation(residual), 1e-6)) ** 2)
    return smooth


@pytest.mark.parametrize("seed", range(20))
def test_the_depth_beside_a_strand_is_as_with_numpy(seed):
    rng = np.random.default_rng(seed)
    steps = rng.integers(-1, 2, (rng.integers(12, 150), 2))
    line = np.clip(np.cumsum(steps, axis=0) + np.array([40, 30]), 0, np.array([79, 59]))
    mask = rng.random((60, 80)) < rng.uniform(0, 0.9)
    depth = np.where(rng.random(mask.shape) < rng.uniform(0.05, 1), rng.uniform(0.5, 0.7, mask.shape), 0).astype(np.float32)
    reach, beyond = rng.uniform(2, 5, len(line)), np.linspace(2, 6, 4)
    found = smooth_depth_beside(line, reach, beyond, mask, depth, 1e4)
    np.testing.assert_array_equal(found, slow_depth_beside(line, reach, beyond, mask, depth, 1e4))


def test_nothing_is_said_where_little_is_seen_beside_a_strand():
    line, depth = np.column_stack((np.arange(5, 25), np.full(20, 30))), np.zeros((60, 80), np.float32)
    depth[:, :14] = 1.0
    arguments = line, np.ones(20), np.ones(1), np.zeros((60, 80), bool)
    assert not len(smooth_depth_beside(*arguments, depth, 1.0))
    depth[:, :15] = 1.0
    np.testing.assert_allclose(smooth_depth_beside(*arguments, depth, 1.0), 1.0)

"""The upper of two strands that cross in the view, against the same in plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.geometry.curves import Curves
from doo3d.geometry.intersections import find_intersections
from doo3d.kernels import CrossingStrands

DISTANCES, MARGIN, MIN_ANGLE = np.linspace(0.0, 5.0, 16), 1.2, 0.3
CORE, PROFILE = np.array((-0.4, 0.0, 0.4)), np.linspace(-0.75, 0.75, 7)
DEVIATIONS, COLOR_NOISE = 3.0, 6.0
RED, BLUE = np.array((200.0, 40, 30)), np.array((20.0, 60, 200))


def normals(vectors):
    size = np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
    return np.stack((-vectors[..., 1], vectors[..., 0]), axis=-1) / size


class Plain:
    """Samples (C, 2, S) along the strands, and what follows from them."""

    def __init__(self, crossings, curves, radius, half_width):
        self.crossings, self.radius, self.half_width = crossings, radius, half_width

        def vectors(chain, segment):
            return (curves.interpolate(chain, segment + 1.0) - curves.interpolate(chain, segment + 0.0))[..., :2]

        step, joint = vectors(crossings.chain, crossings.segment), crossings.segment + crossings.t
        overlap = MARGIN * half_width[:, ::-1] / np.sin(np.maximum(crossings.angle, MIN_ANGLE))[:, None]
        beyond = overlap[..., None] + DISTANCES * half_width[..., None]
        along = np.concatenate((-beyond[..., ::-1], beyond), axis=-1)
        chain = np.broadcast_to(crossings.chain[..., None], along.shape)
        at = joint[..., None] + along / np.maximum(np.linalg.norm(step, axis=-1), 1e-12)[..., None]
        samples = curves.interpolate(chain, at)
        self.middle, self.height = samples[..., :2], samples[..., 2]
        self.side, self.normal = normals(vectors(chain, np.floor(at))), normals(step)
        self.along, self.depth = along / half_width[..., None], curves.interpolate(crossings.chain, joint)[..., 2]

    def positions(self, offsets):
        lateral = (offsets * self.half_width[..., None])[:, :, None, :, None]
        return self.middle[..., None, :] + lateral * self.side[..., None, :]

    def inside(self, offsets):
        n = self.normal
        sine = n[:, 0, 0] * n[:, 1, 1] - n[:, 0, 1] * n[:, 1, 0]
        sine = np.where(np.abs(sine) < np.sin(MIN_ANGLE), np.copysign(np.sin(MIN_ANGLE), sine), sine)[:, None, None]
        a, b = (offsets * self.half_width[:, :1])[:, :, None], (offsets * self.half_width[:, 1:])[:, None, :]
        x = (a * n[:, 1, 1, None, None] - b * n[:, 0, 1, None, None]) / sine
        y = (b * n[:, 0, 0, None, None] - a * n[:, 1, 0, None, None]) / sine
        return self.crossings.point[:, None, None] + np.stack((x, y), axis=-1)

    def depth_log_odds(self, surface):
        measured = medians(surface.reshape(*self.along.shape, -1))
        height = self.height - measured
        own = np.abs(height - medians(height)[..., None]) < 2 * self.radius[..., None]
        ahead = parabola_at_crossing(self.along, np.where(own, measured, np.nan))
        thickness = self.radius.sum(axis=1)
        in_front, difference = (ahead[:, 1] - ahead[:, 0]) / thickness, (self.depth[:, 1] - self.depth[:, 0]) / thickness
        both = np.where(np.isfinite(in_front), 0.75 * in_front + 0.25 * difference, difference)
        return 2 * np.clip(both, -1.5, 1.5) / np.where(np.isfinite(in_front), 0.5, 1.0) ** 2

    def color_log_odds(self, image):
        colors = bilinear(image, self.positions(PROFILE)).reshape(len(self.depth), 2, 2, 16, 7, 3)
        measured = np.isfinite(colors).all(axis=(-1, -2)).sum(axis=-1)
        profile = medians(np.moveaxis(colors, 3, -1)).mean(axis=2)
        seen = bilinear(image, self.inside(PROFILE))
        expected = profile[:, 0][:, :, None], profile[:, 1][:, None]
        own, other = (((each - seen) ** 2).mean(axis=(1, 2, 3)) + 36 for each in expected)
        ratio = np.log(other / own)
        log_odds = 3 * np.where(np.abs(ratio) >= 0.35, np.clip(ratio, -2, 2), 0.0)
        return np.where((measured >= 2).all(axis=(1, 2)), log_odds, 0.0)


def medians(values):
    known = np.isfinite(values).any(axis=-1)
    return np.where(known, np.nanmedian(np.where(known[..., None], values, 0), axis=-1), np.nan)


def parabola_at_crossing(along, values):
    result = np.full(along.shape[:-1], np.nan)
    for index in np.ndindex(*result.shape):
        good, at = np.isfinite(values[index]), along[index] / np.abs(along[index]).max()
        powers = np.stack((np.ones_like(at), at, at**2), axis=-1)
        for _ in range(2):
            square = powers[good].T @ powers[good] + 1e-6 * np.eye(3)
            fit = np.linalg.solve(square, powers[good].T @ values[index][good])
            residual = np.where(good, np.abs(powers @ fit - values[index]), np.nan)
            good &= residual <= 3 * max(np.nanmedian(residual), 1e-9) if good.any() else good
        if good.sum() >= 4 and (good & (at < 0)).any() and (good & (at > 0)).any():
            result[index] = fit[0]
    return result


def bilinear(image, positions):
    height, width = image.shape[:2]
    u, v = np.floor(positions[..., 0]), np.floor(positions[..., 1])
    inside = (u >= 0) & (v >= 0) & (u + 1 < width) & (v + 1 < height)
    i, j = np.where(inside, v, 0).astype(int), np.where(inside, u, 0).astype(int)
    x, y = (positions[..., 0] - u)[..., None], (positions[..., 1] - v)[..., None]
    upper, lower = (image[k, j] * (1 - x) + image[k, j + 1] * x for k in (i, i + 1))
    return np.where(inside[..., None], upper * (1 - y) + lower * y, np.nan)


def crossing(seed=0, straight=False):
    """Return native and plain samples of five curves, one a ring, that cross each other many times in an image (80, 120)."""
    rng = np.random.default_rng(seed)
    angle = np.linspace(0, 2 * np.pi, 30)
    lines = [np.column_stack((60 + 30 * np.cos(angle), 40 + 25 * np.sin(angle), 0.5 + 0.01 * np.sin(3 * angle)))]
    lines[0][-1] = lines[0][0]
    for _ in range(4):
        u = np.linspace(20, 125, 40)
        slope = rng.uniform(-0.5, 0.5)
        wave = 0 if straight else 15 * np.sin(u / rng.uniform(8, 20))
        lines.append(np.column_stack((u, 40 + slope * (u - 60) + wave, 0.5 + 0.02 * np.sin(u / 30 + rng.uniform(0, 6)))))
    curves = Curves.of(lines, [True, False, False, False, False])
    found = find_intersections(curves)
    half_width = rng.uniform(1.5, 3, 5)[found.chain]
    radius = half_width / 600
    where = (found.chain, found.segment, found.t, found.angle, found.point, radius, half_width)
    native = CrossingStrands(curves.points, curves.bounds, curves.closed, *where, DISTANCES, MARGIN, MIN_ANGLE)
    return native, Plain(found, curves, radius, half_width), rng


@pytest.mark.parametrize("seed", range(4))
def test_positions_across_the_strands_are_those_of_plain_numpy(seed):
    native, plain, _ = crossing(seed)
    assert len(plain.depth) > 5
    assert np.isnan(plain.middle).any()
    np.testing.assert_allclose(native.positions(CORE), plain.positions(CORE).reshape(-1, 2), rtol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_the_upper_strand_by_depth_is_that_of_plain_numpy(seed):
    native, plain, rng = crossing(seed)
    depth = (0.5 + rng.normal(0, 0.003, (80, 120))).astype(np.float32) * (rng.random((80, 120)) < 0.9)
    mask = rng.random((80, 120)) < 0.9
    surface = native.readings(CORE, depth, mask)
    u, v = np.rint(np.nan_to_num(plain.positions(CORE).reshape(-1, 2), nan=-1)).astype(int).T
    inside = (u >= 0) & (v >= 0) & (u < 120) & (v < 80)
    pixels = np.where(inside, v, 0), np.where(inside, u, 0)
    np.testing.assert_array_equal(surface, np.where(inside & mask[pixels] & (depth[pixels] > 0), depth[pixels], np.nan))
    found = native.depth_log_odds(surface, DEVIATIONS)
    np.testing.assert_allclose(found, plain.depth_log_odds(surface), atol=1e-8)
    assert len(np.unique(found)) > 2


def test_without_readings_the_depth_of_the_chains_tells_with_twice_the_deviation():
    native, plain, _ = crossing()
    nothing = np.full(plain.along.size * len(CORE), np.nan)
    difference = np.diff(plain.depth, axis=1)[:, 0] / plain.radius.sum(axis=1)
    np.testing.assert_allclose(native.depth_log_odds(nothing, DEVIATIONS), 2 * np.clip(difference, -1.5, 1.5))


@pytest.mark.parametrize("seed", range(4))
def test_the_upper_strand_by_color_is_that_of_plain_numpy(seed):
    native, plain, rng = crossing(seed, straight=seed % 2 == 1)
    image = rng.integers(0, 256, (80, 120, 3), dtype=np.uint8)
    image[:, 50:80] = (90, 120, 30)
    np.testing.assert_allclose(native.color_log_odds(image, PROFILE, COLOR_NOISE), plain.color_log_odds(image), atol=1e-8)


@pytest.mark.parametrize(("shown", "sign"), [(RED, 1), (BLUE, -1), ((RED + BLUE) / 2, 0)])
def test_two_strands_of_two_colors_are_told_apart_and_colors_of_neither_tell_nothing(shown, sign):
    image = np.zeros((60, 60, 3), np.uint8)
    image[26:35] = RED
    image[:, 26:35] = BLUE
    image[26:35, 26:35] = shown
    curves = Curves.of([np.array([(0.0, 30, 1), (60, 30, 1)]), np.array([(30.0, 0, 1), (30, 60, 1)])])
    found = find_intersections(curves)
    wide = np.full((1, 2), 4.0)
    where = (found.chain, found.segment, found.t, found.angle, found.point, wide, wide)
    strands = CrossingStrands(curves.points, curves.bounds, curves.closed, *where, DISTANCES, MARGIN, MIN_ANGLE)
    assert strands.color_log_odds(image, PROFILE, COLOR_NOISE).tolist() == [6.0 * sign]
    image[20:26] = 255  # a highlight beside the overlap is on few samples
    assert strands.color_log_odds(image, PROFILE, COLOR_NOISE).tolist() == [6.0 * sign]


def test_strands_out_of_the_image_tell_nothing_by_color():
    native, _, _ = crossing()
    assert not native.color_log_odds(np.full((4, 4, 3), 9, np.uint8), PROFILE, COLOR_NOISE).any()


def test_surfaces_that_are_not_one_per_sample_are_refused():
    native, plain, _ = crossing()
    with pytest.raises(ValueError, match="surface"):
        native.depth_log_odds(np.ones(plain.along.size + 1), DEVIATIONS)

"""The surface beside chains, against a plain computation in NumPy."""

import numpy as np
import pytest

from doo3d.kernels import surface_beside, surface_log_odds
from doo3d.types import Camera

CAMERA = Camera(fx=60.0, fy=65.0, cx=29.5, cy=19.5, width=60, height=40)
INTRINSICS = np.array((60.0, 65.0, 29.5, 19.5))
LATERAL = np.array([-4.0, -3.0, 3.0, 4.0])
MAX_RISE, WINDOW, MIN_READINGS, MIN_RATIO, TO_DEVIATION = 0.08, 0.2, 6, 2.0, 1.4826  # of a radius of 1 cm


def slow_pixels(at, mask):
    u, v = np.rint(at).T
    inside = (u >= 0) & (v >= 0) & (u < mask.shape[1]) & (v < mask.shape[0])
    return np.where(inside, v * mask.shape[1] + u, -1).astype(int)


def slow_rise(behind):
    behind = behind[np.isfinite(behind)]
    if not len(behind):
        return np.nan, np.nan
    rise = np.median(behind)
    noise = TO_DEVIATION * np.median(np.abs(behind - rise))
    return rise if len(behind) >= MIN_READINGS and rise > MIN_RATIO * noise else np.nan, noise


def slow_surface(chains, radius, mask, depth):
    inside, around, rises = [], [], []
    for joints in chains:
        at = CAMERA.project(joints)
        tangents = np.gradient(at, axis=0)
        tangents /= np.linalg.norm(tangents, axis=1)[:, None]
        middle, behind = slow_pixels(at, mask), np.full((len(joints), 4), np.nan)
        inside += [pixel for pixel in middle if pixel >= 0 and mask.ravel()[pixel]]
        for i, (joint, place, tangent) in enumerate(zip(joints, at, tangents, strict=True)):
            offset = CAMERA.fx * radius / joint[2] * LATERAL
            for k, pixel in enumerate(slow_pixels(place + offset[:, None] * (-tangent[1], tangent[0]), mask)):
                if pixel < 0 or mask.ravel()[pixel]:
                    continue
                around.append(pixel)
                back = depth.ravel()[pixel] - joint[2]
                if depth.ravel()[pixel] > 0 and abs(back) <= MAX_RISE:
                    behind[i, k] = back
        count = max(2, int(WINDOW / np.linalg.norm(joints[1] - joints[0])))
        rises += [slow_rise(behind[:count]), slow_rise(behind[-count:])]
    return inside, around, *np.transpose(rises)


@pytest.mark.parametrize("seed", range(8))
def test_pixels_and_rises_are_those_of_a_plain_computation(seed):
    rng = np.random.default_rng(seed)
    mask = rng.random((40, 60)) < 0.2
    depth = np.where(rng.random((40, 60)) < 0.7, rng.normal(0.64, 0.01 * seed, (40, 60)), 0).astype(np.float32)
    chains = [np.linspace(*(rng.normal(0, 0.15, (2, 3)) + np.array((0, 0, 0.6))), rng.integers(2, 20)) for _ in range(5)]
    bounds = np.cumsum([0, *map(len, chains)])
    found = surface_beside(np.concatenate(chains), bounds, INTRINSICS, 0.01, LATERAL, mask, depth, MIN_READINGS)
    for values, expected in zip(found, slow_surface(chains, 0.01, mask, depth), strict=True):
        np.testing.assert_allclose(values, expected, rtol=1e-9)
    assert len(found[0])
    assert len(found[1])


def slow_log_odds(points, pixels, readings, noise, ends, rise, rise_noise, plane):
    end = np.linalg.norm(points[:, None] - ends, axis=2).argmin(axis=1)
    deviation = np.hypot(noise * readings * points[:, 2], rise_noise[end])
    by_depth = (readings - points[:, 2] - rise[end] / 2) / deviation
    if len(plane):
        height = CAMERA.unproject(pixels, readings) @ plane[:3] - plane[3]
        by_depth = np.where(np.isnan(by_depth), (plane[4] - height) / deviation, by_depth)
    return np.nan_to_num(by_depth)


@pytest.mark.parametrize("plane", [np.zeros(0), np.array((0.0, 0.6, -0.8, -0.5, 0.01))])
def test_log_odds_are_those_of_a_plain_computation(plane):
    rng = np.random.default_rng(0)
    points, ends = rng.normal(0, 0.1, (300, 3)) + np.array((0, 0, 0.6)), rng.normal(0, 0.1, (8, 3)) + np.array((0, 0, 0.6))
    pixels, readings = rng.integers(0, 40, (300, 2)), rng.normal(0.65, 0.05, 300)
    rise = np.where(rng.random(8) < 0.5, np.nan, 0.02)
    rise_noise = np.where(rng.random(8) < 0.2, np.nan, 0.003)
    found = surface_log_odds(points, pixels, readings, 0.01, ends, rise, rise_noise, INTRINSICS, plane)
    np.testing.assert_allclose(found, slow_log_odds(points, pixels, readings, 0.01, ends, rise, rise_noise, plane), rtol=1e-9)


def test_without_noise_the_log_odds_stay_finite():
    points, readings = np.array([(0.0, 0, 0.6)]), np.array([0.7])
    found = surface_log_odds(points, np.zeros((1, 2), int), readings, 0.0, points, np.zeros(1), np.zeros(1), *np.zeros((2, 0)))
    assert found.tolist() == [np.finfo(float).max]

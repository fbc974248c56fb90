"""The color of the surface around strands, against OpenCV and NumPy."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from doo3d.kernels import surface_color

BLUR = (0.02192, 0.22851, 0.49915, 0.22851, 0.02192)
STEP, PER_MEDIAN, MIN_DEVIATION, SEED = 3, 1.4826, 1.0, 3.5


def scene(shape, seed):
    """A noisy table in uneven light with two bands, and what is raised: one of them, and specks."""
    random = np.random.default_rng(seed)
    height, width = shape
    image = np.full((*shape, 3), (150, 140, 120), np.float32) + np.linspace(-40, 60, width)[None, :, None]
    x = np.linspace(0, width, 90)
    raised = np.zeros(shape, np.uint8)
    for line, color in ((height / 2 + 20 * np.sin(x / 30), (190, 60, 50)), (height / 4 + x / 9, (30, 60, 150))):
        points = np.rint(np.column_stack((x, line)) * 8).astype(np.int32)[:, None]
        cv2.polylines(image, [points], False, color, 9, cv2.LINE_AA, 3)
    cv2.polylines(raised, [points], False, 1, 11, cv2.LINE_8, 3)
    raised[random.uniform(size=shape) < 0.002] = 1
    return np.clip(image + random.normal(0, 2, image.shape), 0, 255).astype(np.uint8), raised > 0


def halved(image):
    return cv2.resize(image, (max(1, image.shape[1] // 2), max(1, image.shape[0] // 2)), interpolation=cv2.INTER_AREA)


def bare(small, raised, window):
    wide = cv2.dilate(raised.view(np.uint8), np.ones((5, 5), np.uint8)) * np.uint8(255)
    covered = cv2.resize(halved(halved(wide)), small.shape[1::-1], interpolation=cv2.INTER_AREA)
    seen = (covered < 128).astype(np.float32)
    share = cv2.blur(seen, (window, window))
    mean = cv2.blur(small * seen[..., None], (window, window)) / np.maximum(share, 1e-3)[..., None]
    known = (seen > 0) | (share * window**2 < 1)
    return np.where(known[..., None], small, np.rint(mean)).astype(np.uint8)


def plain(color, raised, window):
    lab = cv2.cvtColor(halved(halved(color)), cv2.COLOR_RGB2LAB)
    around = cv2.medianBlur(bare(halved(lab), raised, window), window).astype(np.float32)
    surface = cv2.resize(around, lab.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    blurred = cv2.sepFilter2D(cv2.cvtColor(color, cv2.COLOR_RGB2LAB).astype(np.float32), -1, np.array(BLUR), np.array(BLUR))
    height, width = color.shape[:2]
    v, u = np.arange(2, height - 2, 4 * STEP)[:, None], np.arange(2, width - 2, STEP)
    away = np.abs(blurred[v, u] - surface[v * lab.shape[0] // height, u * lab.shape[1] // width])
    deviation = np.maximum(PER_MEDIAN * np.median(away.reshape(-1, 3), axis=0), MIN_DEVIATION)
    return around, deviation, (((lab - surface) / deviation) ** 2).sum(axis=2) > SEED**2


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("shape", "window"), [((160, 240), 15), ((64, 200), 5), ((24, 16), 15)])
def test_as_opencv_and_numpy(shape, window, seed):
    color, raised = scene(shape, seed)
    found = surface_color(color, raised, window, STEP, PER_MEDIAN, MIN_DEVIATION, SEED)
    around, deviation, seeds = plain(color, raised, window)
    np.testing.assert_array_equal(found[0], around)
    np.testing.assert_allclose(found[1], deviation, rtol=1e-5)
    np.testing.assert_array_equal(found[2], seeds)
    assert shape[0] < 160 or 0 < seeds.mean() < 0.5


@settings(max_examples=60, deadline=None)
@given(st.integers(16, 90), st.integers(16, 90), st.integers(0, 1000))
def test_where_all_is_raised_the_colors_are_those_of_the_image_scaled_down(height, width, seed):
    color = np.random.default_rng(seed).integers(0, 256, (height, width, 3), np.uint8)
    around, _, _ = surface_color(color, np.ones((height, width), bool), 1, STEP, PER_MEDIAN, MIN_DEVIATION, SEED)
    np.testing.assert_array_equal(around, halved(cv2.cvtColor(halved(halved(color)), cv2.COLOR_RGB2LAB)))


@pytest.mark.parametrize(("window", "step"), [(4, 1), (17, 1), (3, 0)])
def test_what_does_not_fit_is_refused(window, step):
    color = np.zeros((16, 16, 3), np.uint8)
    with pytest.raises(ValueError, match="window"):
        surface_color(color, np.zeros((16, 16), bool), window, step, PER_MEDIAN, MIN_DEVIATION, SEED)

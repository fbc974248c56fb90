"""Valleys by line detectors, where they are asked for, against filters over the whole image."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from doo3d.kernels import valley_depth
from doo3d.segment.valleys import valley_bottoms

ORIENTATIONS = 8


def responses(image, across, along):
    half = int(np.ceil(2 * max(across, along)))
    y, x = np.mgrid[-half : half + 1, -half : half + 1].astype(float)
    filtered = []
    for angle in np.arange(ORIENTATIONS) * np.pi / ORIENTATIONS:
        axial, lateral = x * np.cos(angle) + y * np.sin(angle), -x * np.sin(angle) + y * np.cos(angle)
        kernel = ((lateral / across) ** 2 - 1) * np.exp(-((lateral / across) ** 2) / 2 - (axial / along) ** 2 / 2)
        kernel -= kernel.mean()
        filtered.append(cv2.filter2D(image.astype(float), -1, 2 * kernel / np.abs(kernel).sum(), borderType=cv2.BORDER_REPLICATE))
    return np.stack(filtered)


def scene(seed, shape):
    random = np.random.default_rng(seed)
    image = cv2.GaussianBlur(random.normal(size=shape).astype(np.float32), (0, 0), 2) * 5
    return image, random.random(shape) < random.random()


@given(st.integers(0, 2**32 - 1), st.floats(0.5, 2), st.floats(0.5, 6), st.sampled_from([(40, 57), (1, 30), (30, 1), (7, 5)]))
def test_depth_as_by_filters_of_the_whole_image(seed, across, along, shape):
    image, wanted = scene(seed, shape)
    depth, orientation = valley_depth(image, wanted, across, along, ORIENTATIONS)
    filtered = responses(image, across, along)
    expected = filtered.max(axis=0) + np.minimum(0, filtered.min(axis=0))
    np.testing.assert_allclose(depth, np.where(wanted, expected, 0), atol=2e-5)
    chosen = np.take_along_axis(filtered, orientation[None].astype(int), axis=0)[0]
    np.testing.assert_allclose(chosen[wanted], filtered.max(axis=0)[wanted], atol=2e-5)
    assert not orientation[~wanted].any()


@given(st.integers(0, 2**32 - 1))
def test_bottoms_are_no_less_deep_than_the_pixels_on_either_side(seed):
    random = np.random.default_rng(seed)
    depth, wanted = random.integers(0, 4, (9, 11)).astype(np.float32), random.random((9, 11)) < 0.7
    orientation = random.integers(0, ORIENTATIONS, (9, 11)).astype(np.uint8)
    bottom = valley_bottoms(depth, orientation, wanted)
    padded = np.pad(depth, 1, constant_values=-np.inf)
    for y, x in np.ndindex(depth.shape):
        dy, dx = ((1, 0), (1, -1), (0, 1), (1, 1))[(orientation[y, x] + 1) // 2 % 4]
        sides = padded[1 + y + dy, 1 + x + dx], padded[1 + y - dy, 1 + x - dx]
        assert bottom[y, x] == (wanted[y, x] and depth[y, x] >= max(sides))


def test_a_dark_line_is_a_valley_across_its_direction():
    image = np.ones((41, 41), np.float32)
    image[20] = -1
    depth, orientation = valley_depth(image, np.ones_like(image, bool), 1.0, 3.0, ORIENTATIONS)
    assert orientation[20, 20] == 0
    assert depth[20, 20] > 0.5
    assert depth[10, 20] < 0.01
    bottom = valley_bottoms(depth, orientation, np.ones_like(image, bool))
    assert bottom[20].all()
    assert not bottom[19, 1:-1].any()


def test_what_does_not_fit_is_refused():
    image, wanted = scene(0, (5, 5))
    with pytest.raises(ValueError, match="shape"):
        valley_depth(image, wanted[:4].copy(), 1.0, 1.0, 8)
    with pytest.raises(ValueError, match="deviation"):
        valley_depth(image, wanted, 0.0, 1.0, 8)
    with pytest.raises(ValueError, match="even"):
        valley_depth(image, wanted, 1.0, 1.0, 7)

"""Bands told by color, and parts of masks, against plain references over the whole image."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from doo3d.kernels import color_bands, mask_parts

SHAPE = (90, 131)
LIMITS = np.array([3.5, 7.0, 0.2, 0.3, 0.5])
NOTHING = np.zeros(SHAPE, bool)


def scene(seed=0):
    """A noisy table with a red band, a dark shadow, a faint patch and a blue patch at the border."""
    random = np.random.default_rng(seed)
    image = np.full((*SHAPE, 3), (150, 140, 120), np.float32)
    line = np.column_stack((np.linspace(-5, 140, 60), 45 + 25 * np.sin(np.linspace(0, 6, 60))))
    cv2.polylines(image, [np.rint(line * 8).astype(np.int32)[:, None]], False, (180, 60, 50), 5, cv2.LINE_AA, 3)
    image[5:15, 20:60] *= 0.8
    image[70:85, 10:30] += 3
    image[80:, 120:] = (40, 60, 180)
    return np.clip(image + random.normal(0, 1.5, image.shape), 0, 255).astype(np.uint8)


def surface(image):
    lab = cv2.cvtColor(image, cv2.COLOR_RGB2LAB)
    return np.full((3, 4, 3), np.median(lab.reshape(-1, 3), axis=0), np.float32)


def plain(image, around, deviation):
    lab = cv2.cvtColor(image.astype(np.float32) / 255, cv2.COLOR_RGB2LAB) * np.float32((2.55, 1, 1)) + np.float32((0, 128, 128))
    lab = cv2.GaussianBlur(lab, (5, 5), 0.8, borderType=cv2.BORDER_REPLICATE)
    difference = (lab - around[0, 0]) / deviation
    contrast, hue = np.linalg.norm(difference, axis=2), (difference[..., 1:] ** 2).sum(axis=2)
    shadow = (difference[..., 0] < 0) & (hue < 3.5**2) & (lab[..., 0] > 0.3 * around[0, 0, 0])
    differs = (contrast > 3.5) & ~shadow
    window = np.ones((5, 5), np.uint8)
    edge = cv2.erode(differs.astype(np.uint8), window) == 0
    band = differs & (~edge | (contrast > 0.5 * cv2.dilate(contrast, window)))
    count, labels = cv2.connectedComponents(band.astype(np.uint8), connectivity=8)
    for label in range(1, count):
        if (contrast[labels == label] > 7).mean() < 0.2:
            band[labels == label] = False
    return band, differs


@pytest.mark.parametrize("seed", range(3))
def test_bands_as_over_the_whole_image(seed):
    image = scene(seed)
    around, deviation = surface(image), np.array((2.0, 1.0, 1.0))
    band, differs = color_bands(image, around, deviation, np.ones((9, 13), bool), NOTHING, LIMITS)
    expected = plain(image, around, deviation)
    assert (differs != expected[1]).mean() < 2e-3
    assert (band != expected[0]).mean() < 2e-3
    assert 300 < band.sum() < 2000
    assert not band[6:14, 22:58].any()
    assert not band[76:83, 12:24].any()


def test_a_band_is_followed_from_one_seed():
    image = scene()
    around, seeds = surface(image), np.zeros((9, 13), bool)
    row = int(np.flatnonzero(color_bands(image, around, np.ones(3), ~seeds, NOTHING, LIMITS)[0][:, 60]).mean())
    seeds[row // 10, 6] = True
    band, differs = color_bands(image, around, np.ones(3), seeds, NOTHING, LIMITS)
    assert band[:, 2].any()
    assert band[:, -3].any()
    assert not band[82:, 122:].any()
    assert not differs[82:, 122:].any()


def test_nothing_is_evaluated_without_seeds():
    band, differs = color_bands(scene(), surface(scene()), np.ones(3), np.zeros((2, 2), bool), ~NOTHING, LIMITS)
    assert not band.any()
    assert not differs.any()


def test_tiles_beside_a_band_are_evaluated_on_demand():
    image = np.full((*SHAPE, 3), 150, np.uint8)
    image[40:44], image[51:53, 40:60] = (200, 50, 50), (50, 50, 200)
    around, beside = surface(image), NOTHING.copy()
    seeds = np.zeros(SHAPE, bool)
    seeds[41, 60] = True
    assert not color_bands(image, around, np.ones(3), seeds, beside, LIMITS)[1][51, 45:55].any()
    beside[51, 50] = True
    assert color_bands(image, around, np.ones(3), seeds, beside, LIMITS)[1][51, 50]


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_parts_as_opencv_labels_them(share):
    mask = cv2.blur(np.random.default_rng(0).uniform(size=SHAPE), (5, 5)) < 0.5 + (share - 0.5) / 5
    pixels, starts, widths = mask_parts(mask, 20)
    count, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)
    inside = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 3)
    middle = (inside >= cv2.dilate(inside, np.ones((3, 3), np.uint8)) - 1e-3) & mask
    np.testing.assert_array_equal(np.sort(pixels), np.flatnonzero(mask))
    assert len(starts) == count
    for first, last, width in zip(starts[:-1], starts[1:], widths, strict=True):
        label = labels.ravel()[pixels[first]]
        np.testing.assert_array_equal(np.sort(pixels[first:last]), np.flatnonzero(labels == label))
        expected = np.percentile(inside[middle & (labels == label)] - 0.5, (50, 85)) if last - first >= 20 else (0, 0)
        np.testing.assert_allclose(width, expected, atol=1e-3)


def test_an_empty_mask_has_no_parts():
    pixels, starts, widths = mask_parts(NOTHING, 1)
    assert (len(pixels), starts.tolist(), widths.shape) == (0, [0], (0, 2))

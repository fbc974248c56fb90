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


def surface_of(image):
    lab = cv2.cvtColor(image, cv2.COLOR_RGB2LAB)
    return np.full((3, 4, 3), np.median(lab.reshape(-1, 3), axis=0), np.float32)


def bands_of(image, deviation, seeds, beside=NOTHING, reach=10):
    """The bands as a mask, and the pixels beside them that do not differ as another."""
    pixels, *_, surface = color_bands(image, surface_of(image), deviation, seeds, beside, reach, 20, LIMITS)
    return drawn(pixels), drawn(surface)


def drawn(pixels):
    mask = NOTHING.copy()
    mask.ravel()[pixels] = True
    return mask


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
    image, deviation = scene(seed), np.array((2.0, 1.0, 1.0))
    band, surface = bands_of(image, deviation, np.ones((9, 13), bool), ~NOTHING, 200)
    expected = plain(image, surface_of(image), deviation)
    assert (surface == expected[1]).mean() < 2e-3
    assert (band != expected[0]).mean() < 2e-3
    assert 300 < band.sum() < 2000
    assert not band[6:14, 22:58].any()
    assert not band[76:83, 12:24].any()


def test_bands_are_parts():
    image = scene()
    *parts, _ = color_bands(image, surface_of(image), np.ones(3), np.ones((9, 13), bool), NOTHING, 10, 20, LIMITS)
    for found, expected in zip(parts, mask_parts(drawn(parts[0]), 20, np.zeros(0, int)), strict=True):
        np.testing.assert_array_equal(found, expected)


def test_a_band_is_followed_from_one_seed():
    image, seeds = scene(), np.zeros((9, 13), bool)
    row = int(np.flatnonzero(bands_of(image, np.ones(3), ~seeds)[0][:, 60]).mean())
    seeds[row // 10, 6] = True
    band, surface = bands_of(image, np.ones(3), seeds, ~NOTHING, 200)
    assert band[:, 2].any()
    assert band[:, -3].any()
    assert not band[82:, 122:].any()
    assert surface[82:, 122:].all()


def test_nothing_is_evaluated_without_seeds():
    band, surface = bands_of(scene(), np.ones(3), np.zeros((2, 2), bool), ~NOTHING)
    assert not band.any()
    assert not surface.any()


def test_pixels_beside_a_band_are_evaluated_and_those_farther_away_count_as_surface():
    image, seeds = np.full((*SHAPE, 3), 150, np.uint8), np.zeros(SHAPE, bool)
    image[40:44], image[49:53, 40:60], image[60:64, 40:60] = (200, 50, 50), (50, 50, 200), (50, 50, 200)
    seeds[41, 60] = True
    beside = NOTHING.copy()
    beside[[50, 55, 62, 80], 50] = True
    band, surface = bands_of(image, np.ones(3), seeds, beside, 16)
    assert not band[44:].any()
    assert [*zip(*np.nonzero(surface), strict=True)] == [(55, 50), (62, 50)]


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_parts_as_opencv_labels_them(share):
    mask = cv2.blur(np.random.default_rng(0).uniform(size=SHAPE), (5, 5)) < 0.5 + (share - 0.5) / 5
    pixels, starts, widths, holds = mask_parts(mask, 20, np.zeros(0, int))
    count, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)
    inside = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 3)
    middle = (inside >= cv2.dilate(inside, np.ones((3, 3), np.uint8)) - 1e-3) & mask
    np.testing.assert_array_equal(np.sort(pixels), np.flatnonzero(mask))
    assert len(starts) == count
    assert not holds.any()
    for first, last, width in zip(starts[:-1], starts[1:], widths, strict=True):
        label = labels.ravel()[pixels[first]]
        np.testing.assert_array_equal(pixels[first:last], np.flatnonzero(labels == label))
        expected = np.percentile(inside[middle & (labels == label)] - 0.5, (50, 85)) if last - first >= 20 else (0, 0)
        np.testing.assert_allclose(width, expected, atol=1e-3)


def test_parts_with_pixels_that_are_asked_for_are_not_measured():
    mask = NOTHING.copy()
    mask[2:8, 3:60], mask[30:35, 4:90], mask[50:52] = True, True, True
    asked = np.ravel_multi_index(((33, 34, 70), (5, 6, 7)), SHAPE)
    *_, widths, holds = mask_parts(mask, 20, asked)
    assert holds.tolist() == [False, True, False]
    assert (widths[:, 0] > 0).tolist() == [True, False, True]


def test_an_empty_mask_has_no_parts():
    pixels, starts, widths, holds = mask_parts(NOTHING, 1, np.zeros(0, int))
    assert (len(pixels), starts.tolist(), widths.shape, holds.shape) == (0, [0], (0, 2), (0,))

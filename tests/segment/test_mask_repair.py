"""Ragged masks move to where the colors of the image change; others stay as they are."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders.blue_cable import DEPTH, SEEN, frame
from scipy.ndimage import binary_dilation, binary_erosion, gaussian_filter

from doo3d.config import SegmentConfig
from doo3d.segment import segment
from doo3d.segment.mask_repair import off_edge_share, repair_mask


def photographed(cable=SEEN, color=(20, 60, 200), table=(150, 150, 145), seed=0):
    """A noisy, slightly blurred image of the cable, which casts a shadow below it."""
    rng = np.random.default_rng(seed)
    image = np.empty((*cable.shape, 3))
    image[:] = table
    image[np.roll(binary_dilation(cable, iterations=2), 3, axis=0)] *= 0.7
    image[cable] = color
    image = gaussian_filter(image, (0.6, 0.6, 0)) + rng.normal(0, 4, image.shape)
    return np.clip(image, 0, 255).astype(np.uint8)


def ragged(mask=SEEN, seed=0):
    """A mask whose edge is off by 2 to 3 px to either side, with a false blob and a piece missing."""
    field = gaussian_filter(np.random.default_rng(seed).normal(size=mask.shape), 12)
    wide, narrow = binary_dilation(mask, iterations=3), binary_erosion(mask, iterations=2)
    spoiled = np.where(field > 0, wide, narrow)
    spoiled[300:312, 300:312] = True
    return spoiled


def overlap(one, other):
    return (one & other).sum() / (one | other).sum()


def test_a_ragged_mask_is_repaired():
    spoiled = ragged()
    found = repair_mask(spoiled, photographed())
    assert overlap(spoiled, SEEN) < 0.8
    assert overlap(found, SEEN) > 0.97
    assert not found[300:312, 300:312].any()


def test_a_mask_that_fits_stays_as_it_is():
    assert repair_mask(SEEN, photographed()) is SEEN


def test_a_mask_one_pixel_off_stays_as_it_is():
    wide = binary_dilation(SEEN)
    assert repair_mask(wide, photographed()) is wide


def by_depth(mask=SEEN):
    """A mask without most of the pixels at its edge, and with holes of 3 x 3 px, where depth is lost."""
    rng = np.random.default_rng(0)
    holes = binary_dilation(mask & (rng.random(mask.shape) < 0.004), np.ones((3, 3)))
    return mask & ~holes & (binary_erosion(mask) | (rng.random(mask.shape) < 0.3))


def test_what_depth_lost_at_the_edge_and_within_is_found_by_color():
    spoiled, image = by_depth(), photographed()
    assert repair_mask(spoiled, image) is spoiled
    found = repair_mask(spoiled, image, is_by_depth=True)
    assert overlap(spoiled, SEEN) < 0.9
    assert overlap(found, SEEN) > 0.97


def test_a_strand_too_thin_for_its_color_stays_as_depth_shows_it():
    wire = np.zeros_like(SEEN)
    wire[200:202, 100:540] = True
    assert repair_mask(wire, photographed(wire), is_by_depth=True) is wire


@pytest.mark.parametrize("color", [(150, 150, 145), (148, 152, 143)])
def test_colors_of_the_background_change_nothing(color):
    spoiled = ragged()
    assert repair_mask(spoiled, photographed(color=color)) is spoiled


def test_nothing_to_repair():
    empty = np.zeros_like(SEEN)
    assert repair_mask(empty, photographed()) is empty


def test_a_second_cable_in_the_colors_of_the_table_is_not_dropped():
    second = np.zeros_like(SEEN)
    second[400:412, 100:540] = True
    image = photographed()
    image[second] = image[430:442, 100:540].reshape(-1, 3)
    both = ragged() | second
    found = repair_mask(both, image)
    assert found is not both
    assert (found & second).sum() > 0.9 * second.sum()


def test_the_record_says_how_many_pixels_changed():
    spoiled = ragged()
    record = segment(frame(np.where(DEPTH > 0, DEPTH, 0.6), photographed()), SegmentConfig(), spoiled)
    assert record.repaired == (repair_mask(spoiled, photographed()) != spoiled).sum() > 1000
    without_color = segment(frame(np.where(DEPTH > 0, DEPTH, 0.6)), SegmentConfig(), spoiled)
    assert without_color.repaired == 0


@pytest.mark.parametrize(("off_px", "share"), [(0, 0.0), (1, 0.0), (2, 1.0), (3, 1.0)])
def test_the_share_of_the_edge_that_is_off_the_step_of_color(off_px, share):
    strand = cv2.line(np.zeros((120, 160), np.uint8), (30, 20), (130, 100), 1, 15)
    color = np.where(strand[..., None], (180, 60, 40), (90, 90, 90)).astype(np.uint8)
    mask = cv2.dilate(strand, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * off_px + 1,) * 2)).astype(bool)
    assert off_edge_share(mask, color) == pytest.approx(share, abs=0.15)
    assert off_edge_share(mask | True, color) == off_edge_share(mask & False, color) == 0

"""The record of a segmentation: its counts add up, and it tells whose mask it is."""

from __future__ import annotations

import numpy as np
from builders.blue_cable import BLUE, DEPTH, RADIUS, SEEN, frame, painted
from builders.drawn_masks import surface, wave

from doo3d.config import SegmentConfig
from doo3d.segment import segment, segment_extended
from doo3d.types import Cloud, Image

CONFIG = SegmentConfig()


def check_sums(record):
    """The counts of a record add up to the pixels of the mask and to the points."""
    scene = record.scene
    if scene.mask.size:
        pixels = record.selected - record.removed_small + record.closed_holes - record.removed_wide
        assert scene.mask.sum() == pixels
        assert len(scene.points) == pixels - record.without_depth - record.outliers + record.inpainted
    else:
        assert len(scene.points) == record.selected - record.outliers


def test_the_record_of_a_frame():
    """Holes in the mask, a gripper, specks, patches without depth and flying points, each counted."""
    random = np.random.default_rng(0)
    gripper, specks = np.zeros_like(SEEN), np.zeros_like(SEEN)
    gripper[300:420, 200:360] = True
    specks[100:104, 100:104] = specks[20:23, 500:503] = True
    depth = np.where(gripper & ~SEEN, 0.45, np.where(specks, 0.5, DEPTH))
    depth[:, 300:320] = 0
    depth[SEEN & (random.random(SEEN.shape) < 0.02) & (np.arange(640) > 350)] = 0.9
    depth[SEEN & (random.random(SEEN.shape) < 0.02) & (np.arange(640) < 250)] = 0.01
    shown = SEEN | gripper | specks
    holes = SEEN & (random.random(SEEN.shape) < 0.02)
    record = segment(frame(depth, painted(shown & ~holes)), BLUE)
    assert (record.method, record.base) == ("hsv", None)
    assert record.selected == (shown & ~holes).sum()
    assert specks.sum() <= record.removed_small < specks.sum() + 50
    assert 0.9 * gripper.sum() < record.removed_wide < 1.1 * gripper.sum()
    assert 0 < record.closed_holes <= holes.sum()
    mask = record.scene.mask
    assert record.without_depth == (mask & (depth < CONFIG.min_depth)).sum()
    assert 0.9 < record.inpainted / (mask & (depth <= 0)).sum() <= 1
    assert record.outliers >= 0.95 * (mask & (depth == 0.9)).sum() > 50
    check_sums(record)


def test_the_record_of_a_given_mask_an_image_and_a_cloud():
    record = segment(frame(), CONFIG, SEEN)
    assert (record.method, record.selected, record.removed_wide) == ("mask", SEEN.sum(), 0)
    check_sums(record)
    record = segment(Image(painted(SEEN)), BLUE)
    assert (record.method, record.without_depth, record.inpainted, record.outliers) == ("hsv", 0, 0, 0)
    check_sums(record)
    points = np.concatenate((surface(wave(), RADIUS), [[30.0, 0, 0], [0, -25.0, 8]]))
    record = segment(Cloud(points), CONFIG)
    assert (record.method, record.selected) == ("everything", len(points))
    assert 2 <= record.outliers < 0.1 * len(points)
    check_sums(record)
    assert segment(Cloud(points, segmented=True), SegmentConfig(method="mask")).method == "everything"


def test_an_extended_mask_is_not_the_callers():
    """It gives the points that a given mask would, and keeps the segmentation that it was extended from."""
    image, half = Image(painted(SEEN)), SEEN.copy()
    half[:, 320:] = False
    base = segment(Image(painted(half)), BLUE)
    once = segment_extended(image, BLUE, SEEN, base)
    twice = segment_extended(image, BLUE, SEEN, once)
    assert once.method == twice.method == "extended"
    assert once.base is twice.base is base
    assert base.method == "hsv"
    np.testing.assert_array_equal(once.scene.points, segment(image, BLUE, SEEN).scene.points)
    check_sums(once)

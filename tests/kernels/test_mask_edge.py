"""The edge of a mask that moves to where colors change, against a plain reference over the whole image with OpenCV."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from doo3d.kernels import MaskEdge

BAND, RING = 4, 24
SQUARE = np.ones((3, 3), np.uint8)
KERNEL = cv2.getGaussianKernel(7, 0.8, cv2.CV_32F).ravel()
SEEDS = st.integers(0, 2**32 - 1)


def scene(seed, shape=(90, 131)):
    """A ragged mask, which may lie at the border or in several parts, and a noisy image."""
    random = np.random.default_rng(seed)
    field = cv2.GaussianBlur(random.normal(size=shape).astype(np.float32), (0, 0), 5)
    mask = np.zeros(shape, bool)
    top, left = random.integers(0, 40, 2)
    mask[top:, left : left + 60] = (field > np.quantile(field, 0.8))[top:, left : left + 60]
    image = cv2.GaussianBlur(random.integers(0, 256, (*shape, 3), np.uint8), (0, 0), 2)
    image[mask] //= 2
    return mask, image, random.normal(size=4096).astype(np.float32)


def distance(mask):
    return cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 3)


def edge_of(mask):
    return mask & ~cv2.erode(mask.astype(np.uint8), SQUARE).astype(bool)


def ring_of(mask):
    """The pixels up to 24 px from a mask and within its box widened by as much, and those of them up to 4 px from it."""
    v, u = np.nonzero(mask)
    box = np.zeros_like(mask)
    box[max(0, v.min() - RING) : v.max() + RING + 1, max(0, u.min() - RING) : u.max() + RING + 1] = True
    outside = distance(~mask)
    return (outside <= RING) & box, outside <= BAND


def read(image, table):
    cell = (image >> 4).astype(int)
    return table[256 * cell[..., 0] + 16 * cell[..., 1] + cell[..., 2]]


@given(SEEDS)
def test_samples_and_moves_as_over_the_whole_image(seed):
    mask, image, table = scene(seed)
    if not mask.any():
        return
    edge, (ring, band) = MaskEdge(mask, BAND, RING), ring_of(mask)
    core = cv2.erode(mask.astype(np.uint8), SQUARE).astype(bool)
    np.testing.assert_array_equal(edge.inside(), np.flatnonzero(core if core.any() else mask))
    around = np.flatnonzero(ring & ~band)
    np.testing.assert_array_equal(edge.around(100), around[:: max(1, len(around) // 100)])
    smooth = cv2.GaussianBlur(read(image, table), (0, 0), 0.8)
    found, sure = band & (smooth > 0), np.abs(smooth) > 1e-5
    edge.move(image, table, KERNEL)
    assert (edge.mask() == found)[sure].all()
    found = edge.mask()
    np.testing.assert_array_equal(
        edge.around(10**6), np.flatnonzero(ring & ~cv2.dilate(found.astype(np.uint8), SQUARE).astype(bool))
    )
    off = (found & (distance(~mask) > 1)) | (~found & (distance(mask) > 1))
    assert edge.raggedness() == off.sum() / edge_of(mask).sum()


@given(SEEDS)
def test_dropped_parts_that_are_thick_and_long_are_restored(seed):
    mask, image, table = scene(seed)
    edge = MaskEdge(mask, BAND, RING)
    edge.move(image, table - np.float32(0.5), KERNEL)
    found = edge.mask()
    dropped = mask & ~found
    edge.restore_parts(1.5, 4.0)
    _, label, stats, _ = cv2.connectedComponentsWithStats(dropped.astype(np.uint8), connectivity=8)
    thickest = np.zeros(len(stats))
    np.maximum.at(thickest, label[dropped], distance(dropped)[dropped])
    long = (thickest > 1.5) & (stats[:, cv2.CC_STAT_AREA] > 4 * thickest**2)
    long[0] = False
    np.testing.assert_array_equal(edge.mask(), found | long[label])


def test_an_empty_mask_has_no_edge():
    mask, image, table = scene(0)
    mask[:] = False
    edge = MaskEdge(mask, BAND, RING)
    edge.move(image, table, KERNEL)
    edge.restore_parts(1.0, 1.0)
    assert (len(edge.inside()), len(edge.around(10)), edge.raggedness(), edge.mask().any()) == (0, 0, 0, False)


def test_a_full_mask_has_no_edge_and_no_surround():
    _, image, table = scene(0)
    mask = np.ones(image.shape[:2], bool)
    edge = MaskEdge(mask, BAND, RING)
    assert (len(edge.inside()), len(edge.around(10)), edge.raggedness()) == (mask.size, 0, 0)
    edge.move(image, np.full_like(table, -1), KERNEL)
    edge.restore_parts(1.0, 1.0)
    assert not edge.mask().any()


@pytest.mark.parametrize("shape", [(1, 200), (200, 1), (2, 2), (5, 64)])
def test_small_images(shape):
    mask, image, table = np.zeros(shape, bool), np.zeros((*shape, 3), np.uint8), np.ones(4096, np.float32)
    mask[0, 0] = True
    edge = MaskEdge(mask, BAND, RING)
    edge.move(image, table, KERNEL)
    np.testing.assert_array_equal(edge.mask(), ring_of(mask)[1])


def test_shapes_that_do_not_fit_are_refused():
    mask, image, table = scene(0)
    edge = MaskEdge(mask, BAND, RING)
    with pytest.raises(ValueError, match="color"):
        edge.move(image[:10].copy(), table, KERNEL)
    with pytest.raises(ValueError, match="log_odds"):
        edge.move(image, table[:10], KERNEL)
    with pytest.raises(ValueError, match="kernel"):
        edge.move(image, table, KERNEL[:6])
    with pytest.raises(ValueError, match="band"):
        MaskEdge(mask, RING, BAND)

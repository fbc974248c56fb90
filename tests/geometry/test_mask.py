"""What a mask says: where it is and how thick."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from doo3d.geometry.mask import bounding_box, ridge_radius
from doo3d.scene.frame_facts import FrameFacts


def of_facts(mask, depth=None, focal=1.0):
    return (FrameFacts(mask) if depth is None else FrameFacts(mask, depth.astype(np.float32))).radius(focal)


@pytest.mark.parametrize("pixels", [[(0, 0)], [(29, 39)], [(3, 7), (10, 5)], [(0, 39), (29, 0)]])
def test_the_box_holds_the_mask_and_no_more(pixels):
    mask = np.zeros((30, 40), bool)
    mask[tuple(np.array(pixels).T)] = True
    part = mask[bounding_box(mask)]
    assert part.sum() == len(pixels)
    assert part[0].any()
    assert part[-1].any()
    assert part[:, 0].any()
    assert part[:, -1].any()


def from_distances(mask, depth=None, focal=1.0):
    inside = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    return ridge_radius(inside, np.ones(mask.shape) if depth is None else depth / focal)


both = pytest.mark.parametrize("radius", [of_facts, from_distances])


@both
@pytest.mark.parametrize("width", [1, 2, 3, 6, 11, 24])
@pytest.mark.parametrize("slanted", [False, True])
def test_half_the_width_of_a_strip(radius, width, slanted):
    v, u = np.mgrid[0:200, 0:200]
    across = (u - v) / np.sqrt(2) if slanted else u - 100 + (width + 1) % 2 / 2
    mask = np.abs(across) < width / 2
    assert radius(mask) == pytest.approx(width / 2, abs=0.6)
    assert radius(mask, np.full(mask.shape, 0.5), 500.0) == pytest.approx(0.0005 * width, abs=0.0006)


@both
def test_the_usual_width_counts_and_not_specks(radius):
    mask = np.zeros((200, 300), bool)
    mask[90:101, 10:290] = True
    mask[::20, ::7] = True
    assert radius(mask) == pytest.approx(5.5, abs=0.8)


@both
def test_width_in_metres_where_the_depth_is_known(radius):
    mask = np.zeros((100, 200), bool)
    mask[45:56, 10:190] = True
    depth = np.where(np.arange(200)[None] < 150, 1.0, 0.0) * np.ones((100, 1))
    assert radius(mask, depth, 500.0) == pytest.approx(0.011, rel=0.1)
    assert radius(mask, 0 * depth, 500.0) == 0
    assert radius(np.zeros((5, 5), bool), np.ones((5, 5))) == 0


@pytest.mark.parametrize("seed", range(5))
def test_both_ways_to_the_radius_agree(seed):
    mask = cv2.GaussianBlur(np.random.default_rng(seed).random((80, 90)), (0, 0), 1 + seed) > 0.5
    assert of_facts(mask) == pytest.approx(from_distances(mask), abs=1e-3)

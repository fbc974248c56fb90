"""The hues of strands: how many there are, which shows at each pixel, and what they say about ends."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

import doo3d
from doo3d.scene.frame_facts import FrameFacts
from doo3d.scene.strand_hues import StrandHues, unlike_ends
from doo3d.segment.split_strands import split_strands

RED, BLUE, BLACK, CLOTH = (190, 40, 50), (40, 90, 190), (20, 20, 20), (60, 90, 70)
SIZE = (300, 640)
RADIUS = 7


def touching(apart=2 * RADIUS - 1):
    """Return two lines (P, 2) px that come together, touch over 300 px, and part again."""
    x = np.arange(0.0, 640.0)
    away = np.clip(np.abs(x - 320) - 150, 0, None) ** 2 / 220
    return [np.column_stack((x, 150 + side * (apart / 2 + away))) for side in (-1, 1)]


def crossing():
    """Return two lines (P, 2) px that cross at right angles."""
    return [
        np.column_stack((np.arange(120.0, 520.0), np.full(400, 150.0))),
        np.column_stack((np.full(300, 320.0), np.arange(0.0, 300.0))),
    ]


def picture(lines, colors, tie=False):
    """Return the image and the mask of shaded cables with a highlight, and the pixels that show each."""
    image, which = np.full((*SIZE, 3), CLOTH, np.uint8), np.zeros(SIZE, np.uint8)
    for k, (line, color) in enumerate(zip(lines, colors, strict=True), start=1):
        points = [np.rint(line * 16).astype(np.int32)]
        cv2.polylines(which, points, False, k, 2 * RADIUS, cv2.LINE_8, 4)
        for light, width in ((0.6, 2 * RADIUS), (1.0, RADIUS), (1.35, 2)):
            shade = tuple(int(min(255, light * value)) for value in color)
            cv2.polylines(image, points, False, shade, width, cv2.LINE_8, 4)
    mask = which > 0
    if tie:
        image[150 - 2 * RADIUS : 150 + 2 * RADIUS, 300:308][mask[150 - 2 * RADIUS : 150 + 2 * RADIUS, 300:308]] = BLACK
    noise = np.random.default_rng(0).normal(0, 3, image.shape)
    return np.clip(image + noise, 0, 255).astype(np.uint8), mask, which


def split(image, mask):
    return split_strands(FrameFacts(mask), None, image, None, by_hue=True)


def purity(detection, which):
    """Return for each chain the largest share of its joints that shows one cable."""
    shares = []
    for chain in detection.chains:
        u, v = np.clip(np.rint(chain.joints).astype(int), 0, (SIZE[1] - 1, SIZE[0] - 1)).T
        shares.append(np.bincount(which[v, u], minlength=3)[1:].max() / len(chain.joints))
    return shares


@pytest.mark.parametrize("tie", [False, True])
def test_touching_cables_of_two_colors_are_two_chains_of_one_color_each(tie):
    image, mask, which = picture(touching(), (RED, BLUE), tie)
    detection = doo3d.detect(image, doo3d.load_config("image"), mask=mask)
    assert len(detection.chains) == 2
    assert min(purity(detection, which)) > 0.95
    assert min(chain.length for chain in detection.chains) > 600


def test_cables_that_swap_sides_in_a_bundle_keep_their_colors():
    first, second = touching()
    swap = np.clip((first[:, 0] - 300) / 40, 0, 1)[:, None]
    lines = [first + swap * (second - first), second + swap * (first - second)]
    image, mask, which = picture(lines, (RED, BLUE))
    detection = doo3d.detect(image, doo3d.load_config("image"), mask=mask)
    assert len(detection.chains) == 2
    assert min(purity(detection, which)) > 0.9


def test_a_crossing_of_two_colors_is_not_split():
    image, mask, _ = picture(crossing(), (RED, BLUE))
    found = split(image, mask)
    assert found.removed == 0
    assert not found.colors.size


def test_cables_of_one_color_are_left_to_their_valleys():
    image, mask, _ = picture(touching(), (RED, RED))
    assert StrandHues.learn(image, FrameFacts(mask).pixels).count == 1
    assert not split(image, mask).colors.size


def test_a_stripe_along_a_cable_is_no_strand():
    line = touching()[0]
    image, mask, _ = picture([line], (RED,))
    cv2.polylines(image, [np.rint((line + np.array((0, 3))) * 16).astype(np.int32)], False, BLUE, 5, cv2.LINE_8, 4)
    assert StrandHues.learn(image, FrameFacts(mask).pixels).count == 2
    assert not split(image, mask).colors.size


def test_an_object_without_hue_has_no_colors():
    image, mask, _ = picture(touching(), ((150, 150, 150), (90, 90, 90)))
    gray = np.repeat(image[:, :, :1], 3, axis=2)
    assert StrandHues.learn(gray, FrameFacts(mask).pixels).count == 0
    assert not split(gray, mask).colors.size


def test_a_hue_on_both_sides_of_zero_is_one_color():
    # the hue of (Cr, Cb) is 0 where Cr is that of gray: light blue
    image, mask, _ = picture([touching()[0]], ((88, 108, 190),))
    image[:, ::2, 0] += 12
    assert StrandHues.learn(image, FrameFacts(mask).pixels).count == 1


def test_ends_of_one_color_are_likely_and_of_two_are_not():
    labels = np.ones((40, 100), np.uint8)
    labels[20:] = 2
    x = np.arange(10.0, 90.0, 5)
    lines = [np.column_stack((x, np.full(len(x), height))) for height in (10.0, 12.0, 30.0)]
    unlike = unlike_ends(labels, lines, 8)
    assert unlike.shape == (6, 6)
    assert (unlike == unlike.T).all()
    assert unlike[:4, :4].max() < 0.1
    assert unlike[:4, 4:].min() > 3
    assert unlike_ends(labels, [line + np.array((0, 500)) for line in lines], 8).max() < 0.1

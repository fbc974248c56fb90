"""Layers by color: where cables of several colors lie side by side, each is found by itself, also beneath the others."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

import doo3d
from doo3d.pipeline import detect_with_stages
from doo3d.scene.frame_facts import FrameFacts
from doo3d.segment.color_layers import color_layers

RED, BLUE, BLACK, CLOTH = (190, 40, 50), (40, 90, 190), (20, 20, 20), (60, 90, 70)
YELLOW, GREEN, WHITE = (230, 190, 40), (30, 150, 90), (225, 225, 220)
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


def layers(image, mask):
    return color_layers(FrameFacts(mask), image, RADIUS)


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


@pytest.mark.parametrize("colors", [(RED, BLUE), (YELLOW, GREEN), (RED, WHITE)])
def test_each_pixel_has_the_layer_of_its_cable(colors):
    image, mask, which = picture(touching(), colors, tie=True)
    found = layers(image, mask)
    assert found.max() == 2
    assert ((found > 0) == mask).all()
    same = [(found == k)[which == 1].mean() for k in (1, 2)]
    first = 1 + int(np.argmax(same))
    assert (found == first)[which == 1].mean() > 0.95
    assert (found == 3 - first)[which == 2].mean() > 0.95


def test_a_frame_with_depth_has_layers_too():
    image, mask, which = picture(touching(), (RED, BLUE))
    camera = doo3d.Camera(fx=600.0, fy=600.0, cx=320.0, cy=150.0, width=640, height=300)
    depth = np.where(mask, 0.59, 0.6).astype(np.float32)
    detection, stages = detect_with_stages(doo3d.Frame(image, depth, camera), doo3d.load_config("default"), mask)
    assert len(stages.scene.each_layer) == 2
    assert len(detection.chains) == 2
    for chain in detection.chains:
        u, v = np.clip(np.rint(camera.project(chain.joints)).astype(int), 0, (SIZE[1] - 1, SIZE[0] - 1)).T
        assert np.bincount(which[v, u], minlength=3)[1:].max() > 0.95 * len(chain.joints)


def beneath(last):
    """Return the image and the mask of a blue cable that dives under a red one at column 320 and comes out again at `last`."""
    first, second = touching()
    x = first[:, 0]
    share = np.clip(np.minimum(x - 310, last + 20 - x) / 20, 0, 1)[:, None]
    image, mask, _ = picture([second + share * (first - second), first], (BLUE, RED))
    return image, mask


def test_a_cable_that_dives_under_another_goes_on_where_its_color_does():
    image, mask = beneath(400)
    detection = doo3d.detect(image, doo3d.load_config("image"), mask=mask)
    assert len(detection.chains) == 2
    assert min(chain.length for chain in detection.chains) > 600
    lower = min(detection.chains, key=lambda chain: -chain.occluded.sum())
    hidden = lower.joints[:-1][lower.occluded][:, 0]
    assert 290 < hidden.min() < 350
    assert 370 < hidden.max() < 430


def test_a_cable_beneath_others_leaves_the_view_with_them():
    image, mask = beneath(700)
    detection = doo3d.detect(image, doo3d.load_config("image"), mask=mask)
    assert len(detection.chains) == 2
    assert min(chain.joints[:, 0].max() for chain in detection.chains) > 600
    assert max(chain.occluded[-10:].sum() for chain in detection.chains) >= 9


def test_a_cable_that_ends_beside_another_does_not_leave_the_view():
    first, second = touching()
    image, mask, _ = picture([first, second[second[:, 0] < 400]], (RED, BLUE))
    detection = doo3d.detect(image, doo3d.load_config("image"), mask=mask)
    assert len(detection.chains) == 2
    assert detection.chains[1].joints[:, 0].max() < 420


def test_a_crossing_of_two_colors_is_not_split():
    image, mask, _ = picture(crossing(), (RED, BLUE))
    assert not layers(image, mask).size


def test_cables_of_one_color_are_left_to_their_valleys():
    image, mask, _ = picture(touching(), (RED, RED))
    assert not layers(image, mask).size


def test_an_earth_wire_is_one_cable():
    line = np.column_stack((np.arange(0.0, 640.0), 150 + 20 * np.sin(np.arange(640) / 90)))
    image, mask, _ = picture([line, line + np.array((0, 4 * RADIUS))], (YELLOW, YELLOW))
    for k, shade in enumerate((GREEN, YELLOW)):
        half = [np.rint((line + np.array((0, 2 * RADIUS * k))) * 16).astype(np.int32)]
        cv2.polylines(image, half, False, shade, 2 * RADIUS, cv2.LINE_8, 4)
    assert not layers(image, mask).size


def test_a_stripe_along_a_cable_is_no_strand():
    line = touching()[0]
    image, mask, _ = picture([line], (RED,))
    cv2.polylines(image, [np.rint((line + np.array((0, 3))) * 16).astype(np.int32)], False, BLUE, 5, cv2.LINE_8, 4)
    assert not layers(image, mask).size


def test_an_object_without_hue_has_no_layers():
    image, mask, _ = picture(touching(), ((150, 150, 150), (130, 130, 130)))
    gray = np.repeat(image[:, :, :1], 3, axis=2)
    assert not layers(gray, mask).size

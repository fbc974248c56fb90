"""Plugs at the ends of strands are removed from a mask; knots, sleeves, neighbors and whatever the caller's mask holds stay."""

import cv2
import numpy as np
import pytest

from doo3d.config import SegmentConfig
from doo3d.scene.frame_facts import FrameFacts
from doo3d.segment import segment
from doo3d.segment.mask_cleanup import remove_plugs
from doo3d.types import Camera, Frame

BLUE, WHITE = (30, 60, 160), (225, 225, 220)
START, END, RADIUS = 90, 310, 5
"""px; columns between which the cable lies, and half its width."""


def scene(*boxes):
    """Return an image of a wavy blue cable, and its mask with boxes (left, right, top, bottom, color) drawn over both."""
    u = np.arange(START, END + 1)
    axis = np.column_stack((u, 100 + 20 * np.sin((u - START) * np.pi / 110))).astype(np.int32)
    color, mask = np.full((200, 400, 3), 120, np.uint8), np.zeros((200, 400), np.uint8)
    for image, shade in ((color, BLUE), (mask, 1)):
        cv2.polylines(image, [axis], False, shade, 2 * RADIUS + 1)
    for left, right, top, bottom, shade in boxes:
        color[top:bottom, left:right], mask[top:bottom, left:right] = shade, 1
    noise = np.random.default_rng(0).normal(0, 2, color.shape)
    return (cv2.GaussianBlur(color, (0, 0), 0.7) + noise).clip(0, 255).astype(np.uint8), mask.astype(bool)


def plug(ratio, length=30, shade=WHITE):
    half = round(ratio * RADIUS)
    return END, END + length, 100 - half, 100 + half + 1, shade


def removed(*boxes):
    """Return the columns of the pixels that are removed from the mask of a scene."""
    color, mask = scene(*boxes)
    return np.nonzero(mask & ~remove_plugs(FrameFacts(mask), color).mask)[1]


@pytest.mark.parametrize("ratio", [1.8, 2.0, 3.0, 4.0])
def test_a_strand_ends_at_its_plug(ratio):
    color, mask = scene(plug(ratio))
    left = remove_plugs(FrameFacts(mask), color).mask
    assert abs(np.nonzero(left)[1].max() - END) <= RADIUS
    assert left[:, : END - RADIUS].sum() == mask[:, : END - RADIUS].sum()


def test_a_plug_at_each_end():
    columns = removed(plug(2.0), (START - 25, START, 92, 109, WHITE))
    assert (columns > END - RADIUS).any()
    assert (columns < START + RADIUS).any()
    assert not ((columns > START + RADIUS) & (columns < END - RADIUS)).any()


@pytest.mark.parametrize(
    "box",
    [
        pytest.param(plug(2.0, 16, BLUE), id="knot or plug of the cable's color"),
        pytest.param(plug(1.0), id="no wider, as tape"),
        pytest.param((190, 215, 90, 112, WHITE), id="sleeve along the cable"),
        pytest.param((END - 40, END, 104, 113, WHITE), id="end of another cable beside this one"),
    ],
)
def test_what_is_no_plug_stays(box):
    assert not len(removed(box))


def test_the_mask_of_the_caller_keeps_its_plug():
    color, mask = scene(plug(2.0))
    depth = np.where(mask, 0.48, 0.5).astype(np.float32)
    frame = Frame(color, depth, Camera(fx=400, fy=400, cx=200, cy=100, width=400, height=200))
    by_shape, given = (segment(frame, SegmentConfig(method="plane"), each).scene.mask for each in (None, mask))
    assert by_shape[:, END + RADIUS :].sum() == 0
    assert given[:, END + RADIUS :].sum() > 0.9 * mask[:, END + RADIUS :].sum()


def test_a_wide_loop_at_the_end_stays():
    color, mask = scene()
    for image, shade in ((color, BLUE), (painted := mask.astype(np.uint8), 1)):
        cv2.circle(image, (END + 16, 100), 16, shade, 2 * RADIUS + 1)
    facts = FrameFacts(painted.astype(bool))
    assert remove_plugs(facts, color) is facts


def test_a_speck_with_a_patch_of_color_stays():
    color, mask = scene()
    color[30:36, 40:60], mask[30:36, 40:60] = BLUE, True
    color[25:41, 60:72], mask[25:41, 60:72] = WHITE, True
    facts = FrameFacts(mask)
    assert remove_plugs(facts, color) is facts


def test_a_mask_without_strands_is_left():
    facts = FrameFacts(np.zeros((20, 30), dtype=bool))
    assert remove_plugs(facts, np.zeros((20, 30, 3), np.uint8)) is facts

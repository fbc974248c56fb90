"""What the rules select in a frame, judged by a network."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from doo3d import load_config
from doo3d.segment.judged_parts import BESIDE_PX, judged_mask, set_apart
from doo3d.segment.methods import network, strands
from doo3d.segment.methods.result import MethodResult
from doo3d.types import Camera, Frame

SHAPE = (240, 320)
SURFACE = (200, 190, 170)


def band(row: int, half: int = 3, start: int = 20, end: int = 300) -> np.ndarray:
    mask = np.zeros(SHAPE, dtype=bool)
    mask[row - half : row + half + 1, start:end] = True
    return mask


def picture(*bands: tuple[np.ndarray, tuple[int, int, int]]) -> np.ndarray:
    """Return an image of a surface with some noise, and with bands of other colors."""
    color = np.random.default_rng(0).normal(SURFACE, 1.5, (*SHAPE, 3))
    for mask, paint in bands:
        color[mask] = paint
    return np.clip(color, 0, 255).astype(np.uint8)


CABLE, NOISE = band(60), band(150, 3, 100, 130)


@pytest.mark.parametrize(("share", "is_kept"), [(0.1, False), (0.3, True)])
def test_a_part_needs_color_or_a_share_that_the_network_finds(share, is_kept):
    found = NOISE & (np.arange(320) < 100 + 30 * share)
    kept = judged_mask(MethodResult(CABLE | NOISE, by_color=np.flatnonzero(CABLE)), found, picture((CABLE, (30, 60, 200))))
    np.testing.assert_array_equal(kept, CABLE | NOISE if is_kept else CABLE)


def test_what_nobody_knows_better_is_kept():
    kept = judged_mask(MethodResult(CABLE | NOISE), np.zeros(SHAPE, dtype=bool), picture())
    np.testing.assert_array_equal(kept, CABLE | NOISE)


def test_what_only_the_network_finds_is_added_away_from_the_rest():
    rules = MethodResult(CABLE, by_color=np.flatnonzero(CABLE))
    lost = band(120)
    color = picture((CABLE, (30, 60, 200)), (lost, (20, 150, 40)))
    np.testing.assert_array_equal(judged_mask(rules, CABLE | lost, color), CABLE | lost)
    wide = band(60, 3 + BESIDE_PX)
    np.testing.assert_array_equal(judged_mask(rules, wide, color), CABLE)
    flat = rules._replace(rejected=(np.flatnonzero(lost),))
    np.testing.assert_array_equal(judged_mask(flat, CABLE | lost, color), CABLE)


@pytest.mark.parametrize("shape", [(1, 9), (4, 4), (5, 5), (9, 7)])
def test_images_of_a_few_pixels(shape):
    found, color = np.ones(shape, dtype=bool), np.full((*shape, 3), 90, np.uint8)
    assert not judged_mask(MethodResult(~found), found, color).any()


def test_a_part_of_a_larger_image():
    cable, lost = (np.ascontiguousarray(mask[:, ::2]) for mask in (CABLE, band(120)))
    rules = MethodResult(cable, by_color=np.flatnonzero(cable))
    color = picture((CABLE, (30, 60, 200)), (band(120), (20, 150, 40)))[:, ::2]
    np.testing.assert_array_equal(judged_mask(rules, lost, color), cable | lost)


def test_shadows_are_not_added():
    rules, shadow = MethodResult(CABLE, by_color=np.flatnonzero(CABLE)), band(120, 5)
    shade = 1 - 0.4 * cv2.GaussianBlur(shadow.astype(np.float32), (0, 0), 1.5)[..., None]
    color = (picture((CABLE, (30, 60, 200))) * shade).astype(np.uint8)
    np.testing.assert_array_equal(judged_mask(rules, CABLE | shadow, color), CABLE)
    np.testing.assert_array_equal(judged_mask(rules, shadow, picture((shadow, (0, 0, 0)))), CABLE | shadow)


def hanging_cable(off: float) -> tuple[Frame, np.ndarray]:
    """Return a frame of a red cable between two grippers, `off` m in front of a wall, and the cable's pixels."""
    cable, grippers = band(160, 2, 80, 240), band(160, 60, 20, 80) | band(160, 60, 240, 300)
    color = picture((cable, (190, 40, 40)), (grippers, (40, 50, 120)))
    depth = np.random.default_rng(1).normal(0.8, 0.001, SHAPE).astype(np.float32)
    depth[cable | grippers] -= off
    camera = Camera(fx=300.0, fy=300.0, cx=160.0, cy=120.0, width=320, height=240)
    return Frame(color=color, depth=depth, camera=camera), cable


@pytest.mark.parametrize(("off", "hangs"), [(0.3, True), (0.01, False)])
def test_only_what_is_several_diameters_off_the_plane_is_set_apart(off, hangs):
    frame, cable = hanging_cable(off)
    apart = set_apart(strands.mask(frame, load_config("default").segment, 0), frame, 6.0)
    assert apart[cable].mean() > 0.95 if hangs else not apart.any()
    assert (apart & ~band(160, 4, 70, 250)).sum() < 20  # no gripper


def test_a_cable_that_hangs_far_off_the_wall_is_not_lost_to_the_network(monkeypatch):
    frame, cable = hanging_cable(0.3)
    middle = cable & (np.arange(SHAPE[1]) > 130) & (np.arange(SHAPE[1]) < 190)
    monkeypatch.setattr(network, "object_probability", lambda color, model: middle.astype(np.float32))
    assert network.mask(frame, load_config("default").segment, 0).mask[cable].mean() > 0.95

"""Depth of holes in a mask, from the readings round them."""

from __future__ import annotations

import numpy as np
from builders.blue_cable import DEPTH, RADIUS, SEEN, frame, scene_of
from builders.drawn_masks import wave
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from doo3d.config import SegmentConfig
from doo3d.scene.frame_facts import FrameFacts
from doo3d.segment import depth_inpainting
from doo3d.segment.depth_filter import Readings
from doo3d.segment.depth_inpainting import inpaint_readings


def strip(width: int = 9, length: int = 200):
    """A strand along the rows that goes away from the camera, 1 mm per pixel, and its exact depth."""
    mask = np.zeros((40, length + 20), dtype=bool)
    mask[15 : 15 + width, 10 : 10 + length] = True
    return mask, np.where(mask, 0.5 + 0.001 * np.arange(length + 20), 0.0)


def inpainted(mask, depth):
    """The pixels that are inpainted, and their depth."""
    v, u = np.nonzero(mask & (depth > 0))
    measured = Readings(np.column_stack((u, v)), depth[v, u], depth[v, u])
    found = inpaint_readings(measured, FrameFacts(mask, depth.astype(np.float32)), 0.003)
    assert found.pixels.tolist() == sorted(found.pixels.tolist(), key=lambda pixel: pixel[::-1])
    new = depth[found.pixels[:, 1], found.pixels[:, 0]] == 0
    return found.pixels[new], found.filtered[new]


def test_a_hole_is_inpainted_in_a_line():
    mask, exact = strip()
    depth = exact.copy()
    depth[:, 80:140] = 0
    pixels, found = inpainted(mask, depth)
    assert len(pixels) == (mask & (depth == 0)).sum()
    np.testing.assert_allclose(found, exact[pixels[:, 1], pixels[:, 0]], atol=1e-9)


def test_beyond_the_last_reading_it_is_level():
    mask, exact = strip()
    depth = exact.copy()
    depth[:, 180:] = 0
    pixels, found = inpainted(mask, depth)
    assert len(pixels) == 9 * 30
    np.testing.assert_allclose(found, 0.5 + 0.179, atol=1e-9)


def test_between_strands_of_different_depth_there_is_nothing():
    mask, depth = strip()
    depth[mask] = 0.5
    depth[:, 110:] += 0.1 * mask[:, 110:]
    depth[:, 105:115] = 0
    assert len(inpainted(mask, depth)[0]) == 0


def test_single_pixels_are_no_holes_and_pieces_without_readings_stay_empty():
    mask, depth = strip()
    depth[mask & (np.random.default_rng(0).random(mask.shape) < 0.2)] = 0
    mask[30:38, 20:80] = True
    assert len(inpainted(mask, depth)[0]) == 0
    assert len(inpainted(mask, np.zeros_like(depth))[0]) == 0
    full, exact = strip()
    assert len(inpainted(full, exact)[0]) == 0


def test_holes_get_the_depth_of_the_readings_around_them(monkeypatch):
    """Of a cable that is read in patches only, each pixel has a point near its surface; not so without inpainting."""
    blotches = gaussian_filter(np.random.default_rng(0).normal(size=SEEN.shape), 4)
    patchy = frame(np.where(blotches > 0, DEPTH, 0))
    found = scene_of(patchy, SegmentConfig(), SEEN)
    assert len(found.points) > 0.95 * SEEN.sum()
    assert cKDTree(wave()).query(found.points)[0].max() < 2 * RADIUS
    monkeypatch.setattr(depth_inpainting, "INPAINT_MIN_HOLE_PX", 1000)
    assert len(scene_of(patchy, SegmentConfig(), SEEN).points) < 0.6 * SEEN.sum()

"""The method that fits the data, and everything."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders.drawn_masks import CAMERA, frame_of, helix, line, surface, wave

from doo3d.config import HsvRange, SegmentConfig
from doo3d.segment.methods import SEGMENTERS, resolve_method
from doo3d.segment.methods.auto import is_broad
from doo3d.types import Cloud, Frame

RADIUS = 0.005
FLOOR = np.column_stack((np.random.default_rng(0).uniform(-0.3, 0.3, (20000, 2)), np.full(20000, 0.52)))
CABLE = surface(wave(), RADIUS, np.zeros(3))


def mask(data, config, seed):
    found = SEGMENTERS[resolve_method(data, config)](data, config, seed)
    return getattr(found, "mask", found)


def test_everything():
    frame, seen = frame_of(wave(), radius=RADIUS)
    np.testing.assert_array_equal(SEGMENTERS["everything"](frame, SegmentConfig(), 0), seen)
    assert SEGMENTERS["everything"](Cloud(CABLE), SegmentConfig(), 0).all()


def test_a_cable_alone_is_all_of_it():
    frame, seen = frame_of(wave(), radius=RADIUS)
    np.testing.assert_array_equal(mask(frame, SegmentConfig(), 0), seen)
    assert mask(Cloud(CABLE), SegmentConfig(), 0).all()
    assert mask(Cloud(surface(line([0, 0, 0], [0.5, 0.1, 0.3]), RADIUS)), SegmentConfig(), 0).all()


def test_a_cable_on_a_table_stands_off_it():
    frame, seen = frame_of(wave(), radius=RADIUS, table=0.52)
    found = mask(frame, SegmentConfig(), 0)
    assert (found & seen).sum() > 0.9 * seen.sum()
    assert not (found & ~seen).any()
    found = mask(Cloud(np.concatenate((FLOOR, CABLE)), viewpoint=np.zeros(3)), SegmentConfig(), 0)
    assert not found[: len(FLOOR)].any()
    assert found[len(FLOOR) :].mean() > 0.9


def test_a_table_with_holes_in_its_depth_is_still_a_table():
    frame, seen = frame_of(wave(), radius=RADIUS, table=0.52)
    depth = frame.depth.copy()
    depth[np.random.default_rng(0).random(depth.shape) < 0.3] = 0
    found = mask(Frame(None, depth, CAMERA), SegmentConfig(), 0)
    assert not (found & ~seen).any()
    assert found.any()


@pytest.mark.parametrize(("turns", "pitch"), [(3, 0.05), (3, 0.03), (4, 0.018)])
def test_turns_of_a_coil_are_no_surface(turns, pitch):
    assert mask(Cloud(surface(helix(turns, 0.06, pitch), 0.004)), SegmentConfig(), 0).all()
    t = np.linspace(0, 2 * np.pi * turns, 1500)
    spiral = np.column_stack(((0.02 + pitch * t / 6.3) * np.cos(t), (0.02 + pitch * t / 6.3) * np.sin(t), 0.5 + 0 * t))
    assert mask(Cloud(surface(spiral, 0.004, np.zeros(3))), SegmentConfig(), 0).all()


@pytest.mark.parametrize("count", [2000, 100_000])
@pytest.mark.parametrize("size", [0.2, 1.0])
@pytest.mark.parametrize("seed", range(2))
def test_a_noisy_board_anywhere_is_a_surface(count, size, seed):
    random = np.random.default_rng(seed)
    points = np.column_stack((random.uniform(-size / 2, size / 2, (count, 2)), 0.001 * random.normal(size=count)))
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    assert is_broad(Cloud(points @ turn + random.normal(size=3)), SegmentConfig())


def test_ranges_and_a_reference_go_before(tmp_path):
    frame, seen = frame_of(wave(), radius=RADIUS, table=0.52)
    color = np.full((480, 640, 3), 120, np.uint8)
    color[seen] = (0, 0, 250)
    frame = Frame(color, frame.depth, CAMERA)
    blue = (HsvRange(low=(110, 100, 100), high=(130, 255, 255)),)
    np.testing.assert_array_equal(mask(frame, SegmentConfig(ranges=blue), 0), seen)
    assert cv2.imwrite(str(tmp_path / "empty.png"), np.full((480, 640, 3), 120, np.uint8))
    np.testing.assert_array_equal(mask(frame, SegmentConfig(reference=str(tmp_path / "empty.png")), 0), seen)


@pytest.mark.parametrize("name", SEGMENTERS)
def test_every_one_is_a_choice(name):
    assert name in SegmentConfig.model_fields["method"].annotation.__args__

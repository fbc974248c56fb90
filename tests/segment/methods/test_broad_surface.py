"""Wide surfaces, such as a table."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.config import SegmentConfig
from doo3d.segment.methods.auto import is_broad
from doo3d.types import Camera, Cloud, Frame

TABLE = np.random.default_rng(0).uniform((-0.3, -0.3, 0.6), (0.3, 0.3, 0.601), (5000, 3))
CAMERA = Camera(300.0, 300.0, 160.0, 120.0, 320, 240)
FRAME = Frame(None, np.full((240, 320), 0.6, dtype=np.float32), CAMERA)


@pytest.mark.parametrize("data", [Cloud(TABLE), FRAME], ids=["cloud", "frame"])
def test_a_table_is_broad_unless_objects_may_be_of_any_width(data):
    assert is_broad(data, SegmentConfig())
    assert not is_broad(data, SegmentConfig(max_width=np.inf))


def knotted_rope(pitch: float, scatter: float) -> Cloud:
    """A rope of about 3.5 m in a figure of three loops, as three points each `pitch` of its parameter that scatter across it."""
    turn = np.tile(np.linspace(0, 2 * np.pi, int(2.5 / pitch)), 3)
    axis = np.column_stack((0.25 * np.cos(turn), 0.2 * np.sin(3 * turn), 0.02 * np.sin(5 * turn)))
    return Cloud(axis + np.random.default_rng(1).normal(0, scatter, axis.shape))


@pytest.mark.parametrize("pitch", [0.003, 0.01, 0.02, 0.03])
@pytest.mark.parametrize("scatter", [0.002, 0.004, 0.006])
def test_a_rope_of_few_points_is_no_table(pitch, scatter):
    assert not is_broad(knotted_rope(pitch, scatter), SegmentConfig())


@pytest.mark.parametrize("pitch", [0.005, 0.01, 0.02, 0.04, 0.08])
def test_a_table_of_few_points_is_broad(pitch):
    grid = np.stack(np.meshgrid(np.arange(0, 1, pitch), np.arange(0, 1, pitch)), -1).reshape(-1, 2)
    noise = np.random.default_rng(2).normal(0, 0.003, (len(grid), 3))
    assert is_broad(Cloud(np.pad(grid, ((0, 0), (0, 1))) + noise), SegmentConfig())

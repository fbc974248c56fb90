"""Wide surfaces, such as a table."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.config import SegmentConfig
from doo3d.stages.segment.broad_surface import is_broad
from doo3d.types import Camera, Cloud, Frame

TABLE = np.random.default_rng(0).uniform((-0.3, -0.3, 0.6), (0.3, 0.3, 0.601), (5000, 3))
CAMERA = Camera(300.0, 300.0, 160.0, 120.0, 320, 240)
FRAME = Frame(None, np.full((240, 320), 0.6, dtype=np.float32), CAMERA)


@pytest.mark.parametrize("data", [Cloud(TABLE), FRAME], ids=["cloud", "frame"])
def test_a_table_is_broad_unless_objects_may_be_of_any_width(data):
    assert is_broad(data, SegmentConfig())
    assert not is_broad(data, SegmentConfig(max_width=np.inf))

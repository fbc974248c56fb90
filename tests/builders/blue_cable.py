"""A blue cable in a gentle wave, seen from half a metre away: what tests of segmentation start from."""

from __future__ import annotations

import numpy as np

from builders.drawn_masks import CAMERA, depth_of, wave
from doo3d.config import HsvRange, SegmentConfig
from doo3d.scene.scene import Scene
from doo3d.segment import segment
from doo3d.types import Array, Bools, Cloud, Frame, Image

RADIUS = 0.005
DEPTH, _CABLE = depth_of([wave()], [RADIUS])
SEEN: Bools = _CABLE >= 0
BLUE = SegmentConfig(method="hsv", ranges=(HsvRange(low=(110, 100, 100), high=(130, 255, 255)),))


def frame(depth: Array = DEPTH, color: Array | None = None) -> Frame:
    """Return a frame with a depth image (480, 640) m and a color image, or none."""
    return Frame(color, np.asarray(depth, dtype=np.float32), CAMERA)


def painted(mask: Bools) -> Array:
    """Return a grey image (480, 640, 3) uint8 in which the mask is blue."""
    color = np.full((480, 640, 3), 120, np.uint8)
    color[mask] = (0, 0, 250)
    return color


def scene_of(data: Frame | Cloud | Image, config: SegmentConfig, mask: Array | None = None) -> Scene:
    """Return the scene that the stage makes, without its record."""
    return segment(data, config, mask).scene

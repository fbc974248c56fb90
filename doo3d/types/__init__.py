"""The data that flows between the parts: checked on construction, read-only afterwards."""

from .arrays import Array, Bools, Floats, Ints, check_mask
from .data import Camera, CameraView, Cloud, Frame, Image
from .products import Foreground, Path, Skeleton, VoxelGrid
from .results import (
    COORDINATES,
    FORMER_SCHEMA,
    SCHEMA,
    Chain,
    Connection,
    Crossing,
    Detection,
    SegmentRef,
)

__all__ = [
    "COORDINATES",
    "FORMER_SCHEMA",
    "SCHEMA",
    "Array",
    "Bools",
    "Camera",
    "CameraView",
    "Chain",
    "Cloud",
    "Connection",
    "Crossing",
    "Detection",
    "Floats",
    "Foreground",
    "Frame",
    "Image",
    "Ints",
    "Path",
    "SegmentRef",
    "Skeleton",
    "VoxelGrid",
    "check_mask",
]

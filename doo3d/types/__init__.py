"""Define the data that flows between the stages: checked on construction, read-only afterwards."""

from .arrays import Array, Bools, Floats, Ints, check_mask
from .data import Camera, CameraView, Cloud, Frame, Image
from .pose import Plane, as_pose
from .products import CloudSampling, Path, Skeleton, VoxelGrid
from .results import (
    COORDINATES,
    DEPTH_WORDS,
    SCHEMA,
    Chain,
    Connection,
    Crossing,
    Detection,
    SegmentRef,
)
from .tree import ChainEnd, Junction, LinearObject
from .view import View

__all__ = [
    "COORDINATES",
    "DEPTH_WORDS",
    "SCHEMA",
    "Array",
    "Bools",
    "Camera",
    "CameraView",
    "Chain",
    "ChainEnd",
    "Cloud",
    "CloudSampling",
    "Connection",
    "Crossing",
    "Detection",
    "Floats",
    "Frame",
    "Image",
    "Ints",
    "Junction",
    "LinearObject",
    "Path",
    "Plane",
    "SegmentRef",
    "Skeleton",
    "View",
    "VoxelGrid",
    "as_pose",
    "check_mask",
]

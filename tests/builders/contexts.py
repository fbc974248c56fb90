"""What stages are told of a frame, for tests of one stage."""

from __future__ import annotations

import numpy as np

from doo3d.scene.context import FrameContext
from doo3d.scene.visibility import Visibility
from doo3d.types import Foreground, VoxelGrid


def context_of(
    foreground: Foreground | None = None,
    radius: float = 1.0,
    voxel: float = 1.0,
    segment_length: float = 1.0,
    visibility: Visibility | None = None,
    grid: VoxelGrid | None = None,
    dim: int = 3,
) -> FrameContext:
    """A context of a frame of which only what is named is known: its points and its grid are empty."""
    none = np.zeros((0, dim))
    empty = VoxelGrid(none.astype(np.int64), none, np.zeros(0, dtype=np.int64), voxel, np.zeros(dim), radius)
    return FrameContext(foreground or Foreground(none), grid or empty, visibility, segment_length)

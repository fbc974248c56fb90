"""The stages of the method, a file or a folder each: one public function `stage(data, context, config) -> data`.

`segment` and `voxelize` come first and make what the others are told of the frame as a whole, the FrameContext. Stages never
import each other; a stage that drops or decides something returns a record of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..types import Foreground, VoxelGrid
from ..visibility import Visibility


@dataclass(frozen=True)
class FrameContext:
    """What is known of a frame as a whole before it has chains.

    Attributes
    ----------
    foreground : the object's points, mask and camera; `foreground.viewpoint` is where the sensor stood, if that is known.
    grid : the seen surface as voxels with centroids; in 2-D the pixels of the mask.
    visibility : answers what the camera saw at a place; None where there is no camera.
    segment_length : of every chain, m (px in 2-D).
    """

    foreground: Foreground
    grid: VoxelGrid
    visibility: Visibility | None
    segment_length: float

    @property
    def radius(self) -> float:
        """The object's radius as far as it is known before there is a chain, m (px in 2-D)."""
        return self.grid.radius

    @property
    def voxel(self) -> float:
        """The edge of a voxel, m (1 px in 2-D)."""
        return self.grid.size

    def seen_from(self, foreground: Foreground) -> FrameContext:
        """Return the context with a foreground whose viewpoint is decided."""
        return replace(self, foreground=foreground)

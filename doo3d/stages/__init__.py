"""The stages of the method, a file or a folder each: one public function `stage(data, context, config) -> data`.

`segment` and `voxelize` come first and make the FrameContext that all later stages get. Stages never
import each other; a stage that drops or decides something returns a record of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..geometry.gap_path import GapPath
from ..types import Floats, Foreground, VoxelGrid
from ..visibility import Visibility


@dataclass(frozen=True)
class FrameContext:
    """What is known of a frame as a whole before it has chains; every stage after voxelization gets it.

    Attributes
    ----------
    foreground
        the object's points, mask and camera. `foreground.viewpoint` is the position of the sensor, or None if unknown.
    grid
        the seen surface as voxels with centroids; in 2-D the pixels of the mask.
    visibility
        tells whether a position is seen, hidden or free; None for a cloud without camera views.
    segment_length
        length of the segments of every chain, m (px in 2-D).
    """

    foreground: Foreground
    grid: VoxelGrid
    visibility: Visibility | None
    segment_length: float

    @property
    def radius(self) -> float:
        """The first estimate of the object's radius, from its seen width, m (px in 2-D)."""
        return self.grid.radius

    @property
    def voxel(self) -> float:
        """The edge of a voxel, m (1 px in 2-D)."""
        return self.grid.size

    def seen_from(self, foreground: Foreground) -> FrameContext:
        """Return a copy of the context with another foreground, whose viewpoint (position of the sensor) has been decided."""
        return replace(self, foreground=foreground)


@dataclass(frozen=True)
class Assembly:
    """The pieces of one object in order, from its start to its end, before the gaps between them are filled.

    Attributes
    ----------
    pieces
        the joints of each piece, (N + 1, D) m (px in 2-D), in the order and direction in which the object runs.
    gap_paths
        the path from each piece to the next; a closed object has one more, from the last piece to the first.
    costs
        the cost of each connection, in cost units (1 per mm of gap, 1 per px in 2-D).
    closed
        True for a ring, whose last piece is joined to the first.
    confidence
        the confidence of each connection, 0 to 1.
    """

    pieces: tuple[Floats, ...]
    gap_paths: tuple[GapPath, ...] = ()
    costs: tuple[float, ...] = ()
    closed: bool = False
    confidence: tuple[float, ...] = ()

    @property
    def segments(self) -> int:
        """The number of segments of all pieces together."""
        return sum(len(piece) - 1 for piece in self.pieces)

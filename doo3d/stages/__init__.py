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
    """What is known of a frame as a whole before it has chains.

    Attributes
    ----------
    foreground
        the object's points, mask and camera; `foreground.viewpoint` is where the sensor stood, if that is known.
    grid
        the seen surface as voxels with centroids; in 2-D the pixels of the mask.
    visibility
        answers what the camera saw at a place; None where there is no camera.
    segment_length
        of every chain, m (px in 2-D).
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


@dataclass(frozen=True)
class Assembly:
    """The pieces of one object in order, before the gaps between them are filled: from merge to fill.

    Attributes
    ----------
    pieces
        the joints of each piece, (N + 1, D) m (px in 2-D), from the start of the object to its end.
    gap_paths
        from each piece to the next; of a closed object one more, from the last piece to the first.
    costs
        the cost of each connection.
    closed
        the last piece is followed by the first.
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
        """Number of segments of all pieces."""
        return sum(len(piece) - 1 for piece in self.pieces)

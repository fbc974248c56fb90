"""Add up the points of many frames in sparse voxels of constant memory."""

from dataclasses import dataclass, field

import numpy as np

from ..errors import InputError
from ..geometry.cells import distinct
from ..geometry.disjoint_set import group_sums
from ..types import Floats, Ints

GRID_HALF_VOXELS = 1 << 20
"""Number of voxels from the world's origin to the border of the grid on either side; three such coordinates fit 64 bits."""


@dataclass
class VoxelSums:
    """A sparse voxel grid with the sums of the point values in each voxel.

    It is empty at first; `add_frame` adds points.

    Attributes
    ----------
    size
        m, edge of a voxel.
    keys
        (M,) int64, ascending, of M occupied voxels: three integer coordinates packed into one number (see `keys_of`).
    sums
        (M, C) sums of the C values of the points in each voxel.
    frames
        (M,) int64, number of frames with points in each voxel.
    """

    size: float
    keys: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    sums: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    frames: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def keys_of(self, points: Floats) -> Ints:
        """Return the key of the voxel of each point, occupied or not: (N,) int64.

        points : (N, 3) m.

        Raises
        ------
        InputError : a point is more than 2^20 voxels from the origin along an axis.
        """
        coords = np.floor(points / self.size).astype(np.int64) + GRID_HALF_VOXELS
        if (coords < 0).any() or (coords >= 2 * GRID_HALF_VOXELS).any():
            raise InputError(
                f"it lies over {GRID_HALF_VOXELS * self.size:.3g} m from the world's origin: give poses in metres from an origin "
                "nearby",
                code="voxels-too-many",
            )
        return np.asarray((coords[:, 0] * 2 * GRID_HALF_VOXELS + coords[:, 1]) * 2 * GRID_HALF_VOXELS + coords[:, 2])

    def centers(self) -> Floats:
        """Return the centers of the occupied voxels, (M, 3) m."""
        coords = np.stack((self.keys // (4 * GRID_HALF_VOXELS**2), self.keys // (2 * GRID_HALF_VOXELS), self.keys), axis=1)
        return np.asarray((coords % (2 * GRID_HALF_VOXELS) - GRID_HALF_VOXELS + 0.5) * self.size)

    def add_frame(self, points: Floats, values: Floats) -> None:
        """Add the points of one frame, and count the frame in each of their voxels.

        points : (N, 3) m. values : (N, C), C values of each point, such as color channels; C must be the same in all calls.

        Raises
        ------
        InputError : a point is more than 2^20 voxels from the origin along an axis.
        """
        keys = self.keys_of(points)
        merged = distinct(self.keys, keys)
        old, new = np.searchsorted(merged, self.keys), np.searchsorted(merged, keys)
        sums: Floats = group_sums(values, new, len(merged))
        frames: Ints = (np.bincount(new, minlength=len(merged)) > 0).astype(np.int64)
        if len(self.keys):
            sums[old] += self.sums
            frames[old] += self.frames
        self.keys, self.sums, self.frames = merged, sums, frames

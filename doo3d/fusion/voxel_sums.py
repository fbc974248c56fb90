"""Sparse voxels that accumulate the points of many frames in constant memory per occupied voxel."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..errors import InputError
from ..geometry.cells import distinct
from ..geometry.disjoint_set import group_sums
from ..types import Floats, Ints

GRID_HALF_VOXELS = 1 << 20
"""Voxels from the world's origin to the border of the grid on either side; three such coordinates fit 64 bits."""


@dataclass
class VoxelSums:
    """A sparse voxel grid with the sum of the values of all points in each occupied voxel.

    It begins empty; `add_frame` adds points.

    Attributes
    ----------
    size
        edge of a voxel, m.
    keys
        (M,) int64, ascending, for M occupied voxels: the three integer coordinates of each packed into one number (see
        `keys_of`).
    sums
        (M, C) sums of the C values of the points added to each voxel.
    frames
        (M,) int64, number of frames that added points to each voxel.
    """

    size: float
    keys: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    sums: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    frames: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def keys_of(self, points: Floats) -> Ints:
        """Return the key of the voxel that each point lies in, whether the voxel is occupied or not.

        points : (N, 3) m. Returns (N,) int64.

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
        """Return the middles of the occupied voxels, (M, 3) m."""
        coords = np.stack((self.keys // (4 * GRID_HALF_VOXELS**2), self.keys // (2 * GRID_HALF_VOXELS), self.keys), axis=1)
        return np.asarray((coords % (2 * GRID_HALF_VOXELS) - GRID_HALF_VOXELS + 0.5) * self.size)

    def add_frame(self, points: Floats, values: Floats) -> None:
        """Add the points of one frame to their voxels: their values to `sums`, and 1 to `frames` of each voxel that holds any.

        points : (N, 3) m. values : (N, C), C values for each point, such as color channels; C must be the same in all calls.

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

"""Voxels to a curve skeleton (paper, section III-B: connected stays connected, one line per branch)."""

from __future__ import annotations

import numpy as np

from ..config import ThinConfig
from ..kernels.thinning import skeletonize
from ..types import Skeleton, VoxelGrid


def thin(grid: VoxelGrid, config: ThinConfig) -> Skeleton:
    """The voxels of the curve skeleton, each at the centroid of its points."""
    if not len(grid.coords):
        return Skeleton(grid.coords, grid.centroids, grid.size, grid.radius)
    kept = np.flatnonzero(skeletonize(grid.coords))
    return Skeleton(grid.coords[kept], grid.centroids[kept], grid.size, grid.radius)

"""Voxels to a curve skeleton (paper, section III-B: connected stays connected, one line per branch)."""

from __future__ import annotations

import numpy as np

from ..config import ThinConfig
from ..kernels import zhang_suen
from ..kernels.thinning import skeletonize
from ..types import Skeleton, VoxelGrid


def thin(grid: VoxelGrid, config: ThinConfig) -> Skeleton:
    """The voxels of the curve skeleton, each at the centroid of its points; in 2-D pixels, by Zhang and Suen's rule."""
    if not len(grid.coords):
        return Skeleton(grid.coords, grid.centroids, grid.size, grid.radius)
    if grid.coords.shape[1] == 2:
        image = np.zeros(grid.coords.max(axis=0) + 2, dtype=np.uint8)
        image[tuple(grid.coords.T)] = 1
        kept = np.flatnonzero(zhang_suen.thin(image)[tuple(grid.coords.T)])
    else:
        kept = np.flatnonzero(skeletonize(grid.coords))
    return Skeleton(grid.coords[kept], grid.centroids[kept], grid.size, grid.radius)

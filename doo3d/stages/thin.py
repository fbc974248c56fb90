"""Voxels to a curve skeleton (paper, section III-B: connected stays connected, one line per branch)."""

from __future__ import annotations

import numpy as np

from ..kernels import zhang_suen
from ..kernels.thinning import skeletonize
from ..types import Skeleton, VoxelGrid


def thin(grid: VoxelGrid) -> Skeleton:
    """The voxels of the curve skeleton, each at the centroid of its points; in 2-D pixels, by Zhang and Suen's rule."""
    if not len(grid.coords):
        return Skeleton(grid.coords, grid.centroids)
    kept = np.flatnonzero(zhang_suen.thin_pixels(grid.coords) if grid.coords.shape[1] == 2 else skeletonize(grid.coords))
    return Skeleton(grid.coords[kept], grid.centroids[kept])

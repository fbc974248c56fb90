"""Thin voxels to a curve skeleton (paper, section III-B: connected stays connected, one line per branch)."""

from __future__ import annotations

import numpy as np

from ..kernels import zhang_suen
from ..kernels.thinning import skeletonize
from ..types import Skeleton, VoxelGrid


def thin(grid: VoxelGrid) -> Skeleton:
    """Return the curve skeleton of the voxels, each voxel of it at the centroid of its points.

    Voxels are thinned by Lee, Kashyap and Chu's algorithm, pixels (2-D) by Zhang and Suen's.
    """
    if not len(grid.coords):
        return Skeleton(grid.coords, grid.centroids)
    on_skeleton = zhang_suen.thin_pixels(grid.coords) if grid.coords.shape[1] == 2 else skeletonize(grid.coords)
    kept = np.flatnonzero(on_skeleton)
    return Skeleton(grid.coords[kept], grid.centroids[kept])

"""Thin voxels to a curve skeleton (Keipour et al., RA-L 2022, section III-B).

Connected voxels stay connected, and every branch becomes one line.
"""

from __future__ import annotations

import numpy as np

from ..kernels import neighbor_table, thin_pixels, thin_voxels
from ..types import Skeleton, VoxelGrid


def thin(grid: VoxelGrid) -> Skeleton:
    """Thin the occupied voxels to a curve skeleton, one voxel wide and connected as the voxels are.

    In 3-D by Lee, Kashyap and Chu's algorithm, in 2-D by Zhang and Suen's.

    Returns
    -------
    The skeleton, in the order of the grid's voxels. Its points are the centroids of the measured points in each voxel, m (px in
    2-D).
    """
    if not len(grid.coords):
        return Skeleton(grid.coords, grid.centroids)
    planar = grid.coords.shape[1] == 2
    on_skeleton = thin_pixels(grid.coords) if planar else thin_voxels(neighbor_table(grid.coords))
    kept = np.flatnonzero(on_skeleton)
    return Skeleton(grid.coords[kept], grid.centroids[kept])

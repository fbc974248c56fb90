"""Thin voxels to a curve skeleton (Keipour et al., RA-L 2022, section III-B).

Connected voxels stay connected, and every branch becomes one line.
"""

import numpy as np

from ..kernels import neighbor_table, thin_pixels, thin_voxels
from ..types import Skeleton, VoxelGrid
from ..types.stopwatch import timed


@timed("thin")
def thin(grid: VoxelGrid) -> Skeleton:
    """Thin the occupied voxels to lines one voxel wide (a curve skeleton), connected as the voxels are.

    The algorithm is that of Lee, Kashyap and Chu in 3-D, that of Zhang and Suen in 2-D.

    Parameters
    ----------
    grid
        the occupied voxels.

    Returns
    -------
    The voxels of the skeleton, a subset of the grid's voxels in the same order, with their centroids in m (px in 2-D). Empty for
    an empty grid.
    """
    if not len(grid.coords):
        return Skeleton(grid.coords, grid.centroids)
    if grid.coords.shape[1] == 2:
        on_skeleton = thin_pixels(grid.coords)
    else:
        on_skeleton = thin_voxels(neighbor_table(grid.coords) if grid.neighbors is None else grid.neighbors)
    kept = np.flatnonzero(on_skeleton)
    return Skeleton(grid.coords[kept], grid.centroids[kept])

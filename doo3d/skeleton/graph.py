"""From the points of a scene to ordered paths along the object: voxelize, thin, traverse."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.curves import Curves
from ..geometry.limits import MAX_SAMPLES
from ..geometry.radii import STEP_RADII
from ..scene.scene import Scene
from ..types import Array, Path, Skeleton, VoxelGrid
from .thin import thin
from .traverse import Traversal, traverse
from .voxelize import voxelize


@dataclass(frozen=True)
class Graph:
    """The skeleton of the object.

    Attributes
    ----------
    grid
        the voxels of the seen surface.
    skeleton
        the voxels that thinning left.
    traversal
        the polylines along the skeleton, and how much of the skeleton's length is in none of them.
    segment_length
        m (px in 2-D), of the segments until the axis is known.
    """

    grid: VoxelGrid
    skeleton: Skeleton
    traversal: Traversal
    segment_length: float

    @property
    def paths(self) -> list[Path]:
        """The polylines (`types.Path`) along the skeleton, one per branch or loop, in m (px in 2-D)."""
        return self.traversal.paths


def skeletonize(scene: Scene, clearance: float = 1.0) -> Graph:
    """Return the skeleton of the object in a scene.

    scene : what was captured, with the settings. clearance : factor of the distance from other branches up to which paths are
    cut back at junctions.

    Raises
    ------
    InputError : the grid would hold more than MAX_CELLS (two million) voxels.
    """
    if len(scene.each_layer) == 1:
        grid = voxelize(scene)
        skeleton = thin(grid)
        traversal = traverse(skeleton, scene, scene.config.traverse, clearance)
    else:
        layers = [skeletonize(layer, clearance) for layer in scene.each_layer]
        coords, centroids, counts = (_joined(layers, "grid", name) for name in ("coords", "centroids", "counts"))
        grid = VoxelGrid(coords, centroids, counts, layers[0].grid.size, layers[0].grid.origin)
        skeleton = Skeleton(_joined(layers, "skeleton", "coords"), _joined(layers, "skeleton", "points"))
        spurs, loops, trimmed = (
            sum(getattr(layer.traversal, name) for layer in layers) for name in ("spur_length", "loop_length", "trimmed_length")
        )
        notes = tuple(note for layer in layers for note in layer.traversal.notes)
        traversal = Traversal([path for layer in layers for path in layer.paths], spurs, loops, trimmed, notes)
    return Graph(grid, skeleton, traversal, _fitted_length(traversal.paths, scene))


def _joined(layers: Sequence[Graph], product: str, name: str) -> Array:
    """Return an array of a product of all layers, one after the other; name : of the array."""
    return np.concatenate([getattr(getattr(layer, product), name) for layer in layers])


def _fitted_length(paths: list[Path], scene: Scene) -> float:
    """Return the length of the segments until the axis is known, m or px: in most frames that of the settings.

    Shorter ones follow the points of a sparse cloud, and the bends of a thin strand at a junction, with MAX_SAMPLES at most.
    """
    config = scene.config
    if not (scene.is_sparse or (config.merge.branches and config.mode == "2d")):
        return config.fit.length
    least = float(Curves.of([path.points for path in paths]).lengths.sum()) / (MAX_SAMPLES - 1)
    if scene.is_sparse:
        return max(scene.spacing / 2, least)
    return min(config.fit.length, max(STEP_RADII * scene.radius, least))

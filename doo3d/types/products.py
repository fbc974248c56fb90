"""What flows from stage to stage: voxels, skeleton, paths."""

from dataclasses import dataclass, field

from .arrays import Bools, Floats, Ints, set_sealed


@dataclass(frozen=True)
class CloudSampling:
    """How the points of a cloud lie on its strands, as segmentation measured it once for all stages.

    Attributes
    ----------
    spacing
        m, typical distance between neighboring points: along the strand where points are sparse, on the surface otherwise.
    scatter
        m, root mean square distance of sparse points from the line along their strand, which is the radius of the strand or the
        noise of the scanner; None if there are so many points that they show surfaces.
    """

    spacing: float
    scatter: float | None = None

    @property
    def is_sparse(self) -> bool:
        """Whether the points lie one behind the other along the strands, and show no surface."""
        return self.scatter is not None


@dataclass(frozen=True)
class VoxelGrid:
    """The M occupied voxels of a sparse voxel grid, in lexicographic order of `coords`; in 2-D the pixels of the mask.

    The voxel of index c along an axis extends from origin + c size to origin + (c + 1) size along that axis. For a frame the axes
    are x and y where the rays meet the plane at the median depth, and inverse depth (`voxelize`).

    Attributes
    ----------
    coords
        (M, D) int64 >= 1, index of each voxel along each axis.
    centroids
        (M, D) m (px in 2-D), mean of the points in each voxel. A voxel that was added to close a hole has the mean centroid of
        its neighbors.
    counts
        (M,) int, number of points in each voxel; 0 for a voxel that was added to close a hole.
    size
        edge of a voxel, m (1 px in 2-D); for a frame, at the median depth.
    origin
        (D,) m (px in 2-D), position of the corner of the grid where all indices are 0.
    neighbors
        (M, 26) int32, indices of the neighbors of each voxel, as `kernels.neighbor_table` returns them; None where not made.
    """

    coords: Ints
    centroids: Floats
    counts: Ints
    size: float
    origin: Floats
    neighbors: Ints | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        set_sealed(self, **{name: getattr(self, name) for name in ("coords", "centroids", "counts", "origin", "neighbors")})


@dataclass(frozen=True)
class Skeleton:
    """The K voxels that thinning left: lines one voxel wide along the object; in 2-D pixels.

    Attributes
    ----------
    coords
        (K, D) int64, index of each voxel along each axis of the voxel grid.
    points
        (K, D) m (px in 2-D), the centroid of each voxel: the mean of the surface points in it.
    """

    coords: Ints
    points: Floats

    def __post_init__(self) -> None:
        set_sealed(self, coords=self.coords, points=self.points)


@dataclass(frozen=True)
class Path:
    """A polyline along the object: P ordered points, from one end to the other or round a loop.

    Attributes
    ----------
    points
        (P, D) m (px in 2-D).
    closed
        True for a loop, whose last point is joined to the first. The first point is not repeated at the end.
    filled
        (P - 1,) bool, one for each step from a point to the next, True if the step bridges a gap; (P,) if closed. None if no step
        bridges a gap.
    joins
        for each two pieces that were connected to one path: (index of the step in the middle of the gap between them, confidence
        of the connection from 0 to 1).
    """

    points: Floats
    closed: bool = False
    filled: Bools | None = None
    joins: tuple[tuple[int, float], ...] = ()

    def __post_init__(self) -> None:
        set_sealed(self, points=self.points, filled=self.filled)

"""What flows from stage to stage: foreground, voxels, skeleton, paths."""

from dataclasses import dataclass, field
from typing import Any

from .arrays import Array, Bools, Floats, Ints, set_sealed
from .data import Camera, CameraView
from .pose import Plane


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
class Foreground:
    """The pixels or points that segmentation takes for the object, with the image they come from.

    Segmentation is conservative: it rather loses part of the object than keeps something else.

    Attributes
    ----------
    points
        (N, D) m (px in 2-D), N points as measured: one per object pixel with depth (per object pixel in 2-D), or the points of a
        cloud.
    filtered
        (N, D) m, the same points with the depth noise averaged away, at the price of detail; None if nothing was averaged.
    bridges
        (K, 3) m, points between neighbors along the strands of a cloud of sparse points; None if there are none.
    pixels
        (N, 2) int, the pixel (u, v) = (column, row) of each point; None for clouds.
    mask
        (H, W) bool, the pixels of the object, with depth reading or without; None for clouds.
    depth
        (H, W) float32 m, the depth of the whole frame, 0 = no reading; None in 2-D and for clouds.
    color
        (H, W, 3) uint8 RGB, the whole color image; None if there is none.
    probability
        (H, W) float32, the probability that a pixel of a photograph belongs to a thin object; None unless a network tells.
    camera
        the intrinsics; None in 2-D and for clouds.
    viewpoint
        (3,) m, position of the sensor in the frame of the points; None if unknown, and in 2-D.
    mask_radius
        m, median half-width of the mask, each pixel taken at its own depth. 0 if no pixel has depth; None if not measured.
    side_by_side
        (H, W) bool, the pixels of strands that touch or nearly touch side by side, and of the gaps between; None without
        such strands.
    colors
        (H, W) uint8, the number of the color of the strand at each pixel, from 1, 0 for none; None unless strands of different
        colors run side by side.
    sampling
        how the points of a cloud lie on its strands; None for a frame or an image, and for a cloud that was not measured.
    notes
        messages of the segmentation to the user, one sentence each.
    views
        the camera views that a cloud was fused from; empty otherwise.
    plane
        the plane around the object, such as a table; None if there is none, and in 2-D.
    is_told
        whether somebody said what the object is: by a mask, a color, a reference image, a network, or by taking everything for
        it. False if strands were looked for by their shape alone.
    is_clean
        whether the mask holds no noise of depth: it is told, of a photograph, of strands that their color tells, or judged by the
        network. False if it was looked for by shape alone.
    facts
        what follows from the mask and the depth in it (`facts.frame_facts.FrameFacts`), made once; None for a cloud.
    cloud_facts
        what follows from the points of a cloud (`facts.cloud_facts.CloudFacts`), made once; None for a frame or an image, and
        where points are sparse.
    """

    points: Floats
    filtered: Floats | None = None
    bridges: Floats | None = None
    pixels: Ints | None = None
    mask: Bools | None = None
    depth: Array | None = None
    color: Array | None = None
    probability: Array | None = None
    camera: Camera | None = None
    viewpoint: Floats | None = None
    mask_radius: float | None = None
    side_by_side: Bools | None = None
    colors: Array | None = None
    sampling: CloudSampling | None = None
    notes: tuple[str, ...] = ()
    views: tuple[CameraView, ...] = ()
    plane: Plane | None = None
    is_told: bool = True
    is_clean: bool = True
    facts: Any = field(default=None, repr=False, compare=False)
    cloud_facts: Any = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        arrays = ("points", "filtered", "bridges", "pixels", "mask", "depth", "color", "viewpoint", "side_by_side", "colors")
        for name in (*arrays, "probability") if self.probability is not None else arrays:
            set_sealed(self, **{name: getattr(self, name)})


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
    radius
        m (px in 2-D), first estimate of the object's radius, from its seen width, before there is a chain.
    neighbors
        (M, 26) int32, indices of the neighbors of each voxel, as `kernels.neighbor_table` returns them; None where not made.
    """

    coords: Ints
    centroids: Floats
    counts: Ints
    size: float
    origin: Floats
    radius: float
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

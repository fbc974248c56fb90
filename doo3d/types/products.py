"""What flows from stage to stage: foreground, voxels, skeleton, paths."""

from __future__ import annotations

from dataclasses import dataclass

from .arrays import Array, Bools, Floats, Ints, set_sealed
from .data import Camera, CameraView


@dataclass(frozen=True)
class Foreground:
    """The pixels or points that belong to the object; segmentation loses some rather than keeping other things.

    Attributes
    ----------
    points
        (N, D) m (px in 2-D), one per seen surface point, as measured.
    filtered
        (N, D) m, the same after averaging noise away, at the price of detail; None where they are the same.
    pixels
        (N, 2) int, the (u, v) each point was seen at; None for clouds.
    mask
        (H, W) bool, the pixels of the object, with depth or without; None for clouds.
    depth
        (H, W) float32 m, the whole frame's, 0 = none; None where there is none.
    color
        (H, W, 3) uint8 RGB, the whole image's; None where there is none.
    camera
        None where there is none.
    viewpoint
        (3,) m, where the sensor stood; None where unknown or in 2-D.
    mask_radius
        m (px in 2-D), median half-width of the mask at its depth, 0 where unknown; None where not measured.
    notes
        what the segmentation tells the user, a sentence each.
    views
        what some cameras saw of the object, for a cloud fused from many views."""

    points: Floats
    filtered: Floats | None = None
    pixels: Ints | None = None
    mask: Bools | None = None
    depth: Array | None = None
    color: Array | None = None
    camera: Camera | None = None
    viewpoint: Floats | None = None
    mask_radius: float | None = None
    notes: tuple[str, ...] = ()
    views: tuple[CameraView, ...] = ()

    def __post_init__(self) -> None:
        for name in ("points", "filtered", "pixels", "mask", "depth", "color", "viewpoint"):
            set_sealed(self, **{name: getattr(self, name)})


@dataclass(frozen=True)
class VoxelGrid:
    """Occupied voxels only, in lexicographic order.

    Attributes
    ----------
    coords
        (M, D) int64 >= 1, the voxel's place in the box.
    centroids
        (M, D) m, mean of the points inside; voxels that closing added have the mean of their neighbors.
    counts
        (M,) int, points inside; 0 for voxels that closing added.
    size
        m (1 px in 2-D), the edge of a voxel.
    origin
        (D,) m, the corner of voxel 0.
    radius
        m (px in 2-D), the object's radius as far as it is known before there is a chain, from the seen width."""

    coords: Ints
    centroids: Floats
    counts: Ints
    size: float
    origin: Floats
    radius: float

    def __post_init__(self) -> None:
        set_sealed(self, coords=self.coords, centroids=self.centroids, counts=self.counts, origin=self.origin)


@dataclass(frozen=True)
class Skeleton:
    """The voxels that thinning left.

    Attributes
    ----------
    coords
        (K, D) int64, as in the voxel grid.
    points
        (K, D) m (px in 2-D), the centroids of those voxels."""

    coords: Ints
    points: Floats

    def __post_init__(self) -> None:
        set_sealed(self, coords=self.coords, points=self.points)


@dataclass(frozen=True)
class Path:
    """An ordered polyline along the object.

    Attributes
    ----------
    points
        (P, D) m (px in 2-D).
    closed
        whether the last point is followed by the first, which is not repeated.
    filled
        (P - 1,) bool ((P,) where closed), whether the step from each point to the next bridges a gap; None where none does.
    joins
        for each connection the number of the step in the middle of its gap, and the connection's confidence, 0 to 1."""

    points: Floats
    closed: bool = False
    filled: Bools | None = None
    joins: tuple[tuple[int, float], ...] = ()

    def __post_init__(self) -> None:
        set_sealed(self, points=self.points, filled=self.filled)

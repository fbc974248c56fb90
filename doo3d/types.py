"""The data that flows between the parts: checked on construction, read-only afterwards.

Letters used in shapes everywhere: H, W image height and width; N points (or segments of a chain, whose
joints are N + 1); M voxels; K skeleton voxels; P points of a path; S segments; D the dimension, 2 or 3.
Three-dimensional data is float64 metres in the camera's optical frame (x right, y down, z forward), or in
the frame of the cloud that was given; two-dimensional data is pixels (x right, y down).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .errors import InputError

Array = NDArray[Any]
Floats = NDArray[np.floating[Any]]
Ints = NDArray[np.integer[Any]]
Bools = NDArray[np.bool_]

SCHEMA = "doo3d/detection/2"
FORMER_SCHEMA = "doo3d/detection/1"
"""Confidences were called sure; such files are still read."""

COORDINATES = {
    "camera": "camera optical frame: x right, y down, z forward",
    "cloud": "the frame of the cloud as given",
    "image": "image: x right, y down",
    "world": "the world frame of the camera's poses",
}


def _sealed(array: Array) -> Array:
    """The array as a read-only view (the caller's own array stays writable)."""
    view = array.view()
    view.flags.writeable = False
    return view


def _set(instance: object, **values: Any) -> None:
    for name, value in values.items():
        object.__setattr__(instance, name, _sealed(value) if isinstance(value, np.ndarray) else value)


def check_mask(mask: Array, shape: tuple[int, ...]) -> Bools:
    """The mask as bool of the given shape, (H, W) or (N,).

    Raises
    ------
    InputError : its shape is not `shape`, or its type is neither bool nor integer.
    """
    mask = np.asarray(mask)
    if mask.shape != shape:
        raise InputError(
            f"mask has shape {mask.shape}, the frame is {shape} : give the mask the size of the data", code="mask-shape"
        )
    if mask.dtype != bool and not np.issubdtype(mask.dtype, np.integer):
        raise InputError(f"mask has type {mask.dtype}, expected bool or integers (non-zero = object)", code="mask-type")
    return mask.astype(bool, order="C")


@dataclass(frozen=True)
class Camera:
    """A pinhole camera without distortion: pixel (u, v) = (fx x / z + cx, fy y / z + cy), in pixels.

    Raises InputError on construction when a number is not finite, a focal length or size not positive.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def __post_init__(self) -> None:
        numbers = np.array([self.fx, self.fy, self.cx, self.cy], dtype=float)
        if not np.isfinite(numbers).all() or self.fx <= 0 or self.fy <= 0:
            raise InputError(
                f"intrinsics fx={self.fx} fy={self.fy} cx={self.cx} cy={self.cy}: expected finite numbers in pixels, "
                "focal lengths above zero",
                code="intrinsics-invalid",
            )
        if self.width < 1 or self.height < 1:
            raise InputError(
                f"intrinsics: image size {self.width}x{self.height}, expected at least 1x1", code="intrinsics-invalid"
            )

    def project(self, points: Floats) -> Floats:
        """(N, 3) m in the camera frame -> (N, 2) pixels; z <= 0 gives NaN."""
        points = np.asarray(points, dtype=float)
        z = np.where(points[:, 2] > 0, points[:, 2], np.nan)
        return np.column_stack((self.fx * points[:, 0] / z + self.cx, self.fy * points[:, 1] / z + self.cy))

    def unproject(self, pixels: Array, depth: Array) -> Floats:
        """(N, 2) pixels and (N,) z in m -> (N, 3) m in the camera frame."""
        pixels = np.asarray(pixels, dtype=float)
        z = np.asarray(depth, dtype=float)
        return np.column_stack(((pixels[:, 0] - self.cx) * z / self.fx, (pixels[:, 1] - self.cy) * z / self.fy, z))


@dataclass(frozen=True)
class Frame:
    """One RGB-D frame.

    color : (H, W, 3) uint8 RGB, registered to the depth; None where there is none.
    depth : (H, W) float, metres along the optical axis; 0, NaN, negative or infinite = none. Kept as float32 with 0 = none.
    camera : the intrinsics of both.
    name, timestamp : as the capture calls it; seconds.

    Raises InputError on construction when shapes or types do not fit each other.
    """

    color: Array | None
    depth: Array
    camera: Camera
    name: str = "frame"
    timestamp: float | None = None

    def __post_init__(self) -> None:
        depth = np.asarray(self.depth)
        if depth.ndim != 2 or depth.size == 0:
            raise InputError(f"depth has shape {depth.shape}, expected (height, width)", code="depth-shape")
        if not np.issubdtype(depth.dtype, np.floating):
            raise InputError(
                f"depth has type {depth.dtype}, expected float metres: divide the raw values by the depth_scale "
                "(units per metre)",
                code="depth-type",
            )
        if (self.camera.height, self.camera.width) != depth.shape:
            raise InputError(
                f"depth is {depth.shape[1]}x{depth.shape[0]} but the intrinsics are for "
                f"{self.camera.width}x{self.camera.height}: give the intrinsics of this resolution",
                code="intrinsics-size",
            )
        color = self.color
        if color is not None:
            color = np.asarray(color)
            if color.ndim != 3 or color.shape[2] != 3 or color.dtype != np.uint8:
                raise InputError(
                    f"color has shape {color.shape} and type {color.dtype}, expected (height, width, 3) uint8 RGB",
                    code="color-shape",
                )
            if color.shape[:2] != depth.shape:
                raise InputError(
                    f"color is {color.shape[1]}x{color.shape[0]} but depth is {depth.shape[1]}x{depth.shape[0]}: "
                    "align one to the other first (same size, same view)",
                    code="color-size",
                )
        with np.errstate(invalid="ignore"):
            good = np.isfinite(depth) & (depth > 0)
        _set(self, color=color, depth=np.where(good, depth, 0).astype(np.float32))


@dataclass(frozen=True)
class Image:
    """One photograph, for the 2-D mode: pixels are the only unit.

    color : (H, W, 3) uint8 RGB, or (H, W) uint8 grey, which becomes that. name, timestamp : as the capture calls it; seconds.

    Raises InputError on construction when the shape or type is another.
    """

    color: Array
    name: str = "image"
    timestamp: float | None = None

    def __post_init__(self) -> None:
        color = np.asarray(self.color)
        if color.ndim == 2:
            color = np.repeat(color[:, :, None], 3, axis=2)
        if color.ndim != 3 or color.shape[2] != 3 or color.dtype != np.uint8 or color.size == 0:
            raise InputError(
                f"image has shape {color.shape} and type {color.dtype}, expected (height, width, 3) uint8 RGB", code="image-shape"
            )
        _set(self, color=color)


@dataclass(frozen=True)
class CameraView:
    """What one camera saw of the object in a cloud that was made of many views.

    camera : its intrinsics. pose : (4, 4), its optical frame in the frame of the cloud. mask : (H, W) bool, the object's pixels.
    depth : (H, W) float32 m, 0 = none.
    """

    camera: Camera
    pose: Floats
    mask: Bools
    depth: Array

    def __post_init__(self) -> None:
        _set(self, pose=np.asarray(self.pose, dtype=float), mask=self.mask, depth=self.depth)


@dataclass(frozen=True)
class Cloud:
    """One point cloud.

    points : (N, 3) float, metres; rows with NaN or infinity are dropped.
    colors : (N, 3) uint8 RGB, or None.
    viewpoint : (3,) m, where the sensor stood; None where unknown. Clouds in a camera's optical frame have (0, 0, 0).
    name, timestamp : as the capture calls it; seconds.
    views : of a cloud made of many views, what some of them saw of the object.
    segmented : all points are the object. coordinates : the frame they are in, a key of COORDINATES.
    notes : what the user should know of how it was made.

    Raises InputError on construction when shapes or types do not fit each other.
    """

    points: Floats
    colors: Array | None = None
    viewpoint: Array | None = None
    name: str = "cloud"
    timestamp: float | None = None
    views: tuple[CameraView, ...] = ()
    segmented: bool = False
    coordinates: str = "cloud"
    notes: tuple[str, ...] = ()
    finite: Bools = field(init=False, repr=False)
    """(rows given,) bool: which rows of what was given became points."""

    def __post_init__(self) -> None:
        points = np.asarray(self.points)
        if points.ndim != 2 or points.shape[1] != 3 or not np.issubdtype(points.dtype, np.number):
            raise InputError(
                f"points have shape {points.shape} and type {points.dtype}, expected (N, 3) float metres", code="points-shape"
            )
        points = points.astype(float)
        finite = np.isfinite(points).all(axis=1)
        colors = self.colors
        if colors is not None:
            colors = np.asarray(colors)
            if colors.shape != points.shape or colors.dtype != np.uint8:
                raise InputError(
                    f"colors have shape {colors.shape} and type {colors.dtype}, expected {points.shape} uint8 RGB",
                    code="colors-shape",
                )
            colors = colors[finite]
        viewpoint = self.viewpoint
        if viewpoint is not None:
            viewpoint = np.asarray(viewpoint, dtype=float)
            if viewpoint.shape != (3,) or not np.isfinite(viewpoint).all():
                raise InputError(f"viewpoint {viewpoint}: expected three finite numbers in metres", code="viewpoint-invalid")
        _set(self, points=points[finite], colors=colors, viewpoint=viewpoint, finite=finite)


@dataclass(frozen=True)
class Foreground:
    """What surely is the object.

    points : (N, D) m (pixels in 2-D), one per seen surface point, as measured.
    filtered : (N, D) m, the same with their noise averaged away, at the price of detail; None where they are the same.
    pixels : (N, 2) int, the (u, v) each point was seen at; None for clouds.
    mask : (H, W) bool, the pixels of the object, with depth or without; None for clouds.
    mask_radius : m, the usual half-width of the mask at its depth (0: unknown), as `geometry.mask.mask_radius` has it; None where
        it has not been measured.
    depth : (H, W) float32 m, the whole frame's, 0 = none; None where there is none.
    color : (H, W, 3) uint8 RGB, the whole image's; None where there is none.
    camera : None where there is none.
    viewpoint : (3,) m, where the sensor stood; None where unknown or in 2-D.
    notes : what the segmentation has to say to the user.
    views : of a cloud made of many views, what some of them saw of the object.
    """

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
            _set(self, **{name: getattr(self, name)})


@dataclass(frozen=True)
class VoxelGrid:
    """Occupied voxels only, in lexicographic order.

    coords : (M, D) int64 >= 1, the voxel's place in the box.
    centroids : (M, D) m, mean of the points inside; voxels that closing added have the mean of their neighbours.
    counts : (M,) int, points inside; 0 for voxels that closing added.
    size : m, the edge of a voxel. origin : (D,) m, the corner of voxel 0.
    radius : m, the object's radius as far as it is known before there is a chain (from the seen width).
    """

    coords: Ints
    centroids: Floats
    counts: Ints
    size: float
    origin: Floats
    radius: float

    def __post_init__(self) -> None:
        _set(self, coords=self.coords, centroids=self.centroids, counts=self.counts, origin=self.origin)


@dataclass(frozen=True)
class Skeleton:
    """The voxels that thinning left: coords (K, D) int64, points (K, D) m (px in 2-D)."""

    coords: Ints
    points: Floats

    def __post_init__(self) -> None:
        _set(self, coords=self.coords, points=self.points)


@dataclass(frozen=True)
class Path:
    """An ordered polyline.

    points : (P, D) m (px in 2-D). closed : the last point is followed by the first (which is not repeated).
    filled : (P - 1,) bool (P where closed): the step from this point to the next bridges a gap; None where no step does.
    joins : per connection the number of the step in the middle of its gap, and the confidence of the connection, 0 to 1.
    """

    points: Floats
    closed: bool = False
    filled: Bools | None = None
    joins: tuple[tuple[int, float], ...] = ()

    def __post_init__(self) -> None:
        _set(self, points=self.points, filled=self.filled)


class Connection(NamedTuple):
    """Where merging joined two pieces to one chain, and how sure it is that they belong together.

    segment : the segment of the chain that lies there. confidence : 0 to 1, the connection's cost against the next best
    alternative: 0 where another would have cost no more, 1 where all others cost as much more as is ever paid.
    """

    segment: int
    confidence: float


@dataclass(frozen=True)
class Chain:
    """Equal cylinders on ball joints.

    joints : (N + 1, D) float64, m in the camera frame (px in 2-D), consecutive ones exactly segment_length apart.
    segment_length : m (px in 2-D). radius : m (px in 2-D), of the whole chain.
    radii : (N + 1,) the same at each joint, where it was seen; filled in between.
    occluded : (N,) bool, the segment was filled in, not seen. closed : a ring, whose last joint meets the first.
    connections : where pieces were joined to make this chain, and how sure that is, along the chain.
    id : which one it is of the chains of a capture, the same from frame to frame; None where frames were not compared.
    """

    joints: Floats
    segment_length: float
    radius: float = float("nan")
    radii: Floats = field(default_factory=lambda: np.zeros(0))
    occluded: Bools = field(default_factory=lambda: np.zeros(0, dtype=bool))
    closed: bool = False
    connections: tuple[Connection, ...] = ()
    id: int | None = None

    def __post_init__(self) -> None:
        joints = np.asarray(self.joints, dtype=float)
        if joints.ndim != 2 or joints.shape[1] not in (2, 3) or len(joints) < 2:
            raise InputError(f"joints have shape {joints.shape}, expected (N + 1, 2 or 3) with N >= 1", code="chain-shape")
        steps = np.linalg.norm(np.diff(joints, axis=0), axis=1)
        if not (np.abs(steps - self.segment_length) <= 1e-6 * self.segment_length).all():
            raise InputError(
                f"joints are {steps.min():.6g} to {steps.max():.6g} apart, expected {self.segment_length:.6g}",
                code="chain-spacing",
            )
        radii = np.asarray(self.radii, dtype=float) if len(self.radii) else np.full(len(joints), float(self.radius))
        occluded = np.asarray(self.occluded, dtype=bool) if len(self.occluded) else np.zeros(len(joints) - 1, dtype=bool)
        if radii.shape != (len(joints),) or occluded.shape != (len(joints) - 1,):
            raise InputError(
                f"{len(joints)} joints, radii {radii.shape}, occluded {occluded.shape}: expected (N + 1,) and (N,)",
                code="chain-shape",
            )
        _set(self, joints=joints, radii=radii, occluded=occluded)

    @property
    def length(self) -> float:
        """N * segment_length, m (px in 2-D)."""
        return (len(self.joints) - 1) * self.segment_length

    @property
    def confidence(self) -> float:
        """0 to 1: how sure the least sure of its connections is; 1 where there are none."""
        return min((connection.confidence for connection in self.connections), default=1.0)

    def nodes(self, count: int) -> Floats:
        """(count, D): points at equal arc length from the first joint to the last, as trackers want them.

        Raises
        ------
        InputError : count is below 2.
        """
        if count < 2:
            raise InputError(f"nodes({count}): expected at least 2", code="value-out-of-bounds")
        at = np.linspace(0, len(self.joints) - 1, count)
        index = np.minimum(at.astype(int), len(self.joints) - 2)
        part = (at - index)[:, None]
        return np.asarray(self.joints[index] * (1 - part) + self.joints[index + 1] * part)

    def to_dict(self) -> dict[str, Any]:
        """What the JSON file holds of a chain: plain lists and numbers."""
        return {
            "id": self.id,
            "joints": self.joints.tolist(),
            "segment_length": self.segment_length,
            "radius": self.radius,
            "radii": self.radii.tolist(),
            "length": self.length,
            "occluded": self.occluded.tolist(),
            "closed": self.closed,
            "connections": [connection._asdict() for connection in self.connections],
            "confidence": self.confidence,
        }


class SegmentRef(NamedTuple):
    """A segment of one of a detection's chains: the number of the chain, and that of the segment in it."""

    chain: int
    segment: int


@dataclass(frozen=True)
class Crossing:
    """Two strands, of one chain or of two, that cross in the view.

    upper, lower : where; the upper strand is the nearer to the camera, and hides the lower. point : (D,) m (px in 2-D), on
    the upper strand's axis. confidence : 0 to 1, how sure it is which of them is the upper; 0 where nothing tells.
    """

    upper: SegmentRef
    lower: SegmentRef
    point: Floats
    confidence: float = 1.0

    def __post_init__(self) -> None:
        _set(self, point=np.asarray(self.point, dtype=float))

    def to_dict(self) -> dict[str, Any]:
        """What the JSON file holds of a crossing."""
        upper, lower = self.upper._asdict(), self.lower._asdict()
        return {"upper": upper, "lower": lower, "point": self.point.tolist(), "confidence": self.confidence}


@dataclass(frozen=True)
class Detection:
    """What was found in one frame.

    chains : longest first. mode : "3d" or "2d". coordinates : which frame the joints are in (a key of COORDINATES).
    seconds : stage -> s. notes : what the user should know, a sentence each. crossings : where strands cross in the view, in
    the order of the chains and along them.
    """

    chains: tuple[Chain, ...]
    mode: str = "3d"
    coordinates: str = "camera"
    frame: str = "frame"
    timestamp: float | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    crossings: tuple[Crossing, ...] = ()

    @property
    def confidence(self) -> float:
        """0 to 1: how sure the least sure connection of all chains is; 1 where there are none."""
        return min((chain.confidence for chain in self.chains), default=1.0)

    def to_dict(self) -> dict[str, Any]:
        """What the JSON file holds (schema doo3d/detection/2): plain lists, strings and numbers."""
        return {
            "schema": SCHEMA,
            "frame": self.frame,
            "timestamp": self.timestamp,
            "mode": self.mode,
            "units": "m" if self.mode == "3d" else "px",
            "coordinates": COORDINATES[self.coordinates],
            "chains": [chain.to_dict() for chain in self.chains],
            "crossings": [crossing.to_dict() for crossing in self.crossings],
            "confidence": self.confidence,
            "seconds": dict(self.seconds),
            "notes": list(self.notes),
        }

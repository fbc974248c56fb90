"""Define the input data: camera, RGB-D frame, image, point cloud. Checked on construction, read-only afterwards."""

from dataclasses import dataclass, field

import numpy as np

from ..errors import InputError
from ..guard.limits import current_limits
from . import arguments
from .arrays import Array, Bools, Floats, set_sealed
from .display import Displayed

MAX_LENGTH_M = 1e8
"""Greatest coordinate or depth in m; larger values are damaged data. Coordinates relative to the Earth's center reach 6.4e6."""

MIN_DEPTH_M = 1e-6
"""Least depth in m; smaller values count as no reading, since no camera measures so near."""

MIN_FOCAL_PX, MAX_INTRINSIC_PX = 1e-2, 1e8
"""Least focal length, and greatest focal length or principal point, in px; no camera is outside."""

CLOUD_COORDINATES = ("camera", "cloud", "world")


@dataclass(frozen=True)
class Camera:
    """Pinhole camera without distortion: pixel (u, v) = (fx x / z + cx, fy y / z + cy).

    Points (x, y, z) are in the camera's optical frame, metres: x right, y down, z forward.

    Attributes
    ----------
    fx, fy
        focal lengths, px.
    cx, cy
        principal point, px; (0, 0) is the center of the top left pixel.
    width, height
        size of the image, px.

    Raises
    ------
    InputError : on construction, when a number is not finite or a focal length or size is not positive.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def __post_init__(self) -> None:
        for name in ("fx", "fy", "cx", "cy"):
            object.__setattr__(self, name, arguments.number(getattr(self, name), f"camera: {name}", "intrinsics-invalid"))
        for name in ("width", "height"):
            object.__setattr__(self, name, arguments.whole(getattr(self, name), f"camera: {name}"))
        values = self.intrinsics
        if not (np.abs(values) < MAX_INTRINSIC_PX).all() or (values[:2] < MIN_FOCAL_PX).any():
            raise InputError(
                f"intrinsics fx={self.fx} fy={self.fy} cx={self.cx} cy={self.cy}: expected finite numbers in pixels, "
                f"focal lengths from {MIN_FOCAL_PX:g}",
                code="intrinsics-invalid",
            )
        if self.width < 1 or self.height < 1:
            raise InputError(
                f"intrinsics: image size {self.width}x{self.height}, expected at least 1x1", code="intrinsics-invalid"
            )

    @property
    def intrinsics(self) -> Floats:
        """The numbers fx, fy, cx, cy, (4,) px."""
        return np.array((self.fx, self.fy, self.cx, self.cy))

    def project(self, points: Floats) -> Floats:
        """Return the pixels (u, v) at which points are seen.

        points : (N, 3) m in the camera's optical frame. Returns (N, 2) px; NaN for points with z <= 0. Pixels outside the image
        are kept.
        """
        points = arguments.numbers(points, "points", (None, 3), "points-shape")
        z = np.where(points[:, 2] > 0, points[:, 2], np.nan)
        with np.errstate(all="ignore"):  # beyond any image
            return points[:, :2] * (self.fx, self.fy) / z[:, None] + (self.cx, self.cy)

    def unproject(self, pixels: Array, depth: Array) -> Floats:
        """Return the points in the camera's optical frame that are seen at given pixels.

        Parameters
        ----------
        pixels
            (N, 2), (u, v) = (column, row) px.
        depth
            (N,) m, the z coordinate of each point, not its distance along the ray.

        Returns
        -------
        (N, 3) m
        """
        pixels = arguments.numbers(pixels, "pixels", (None, 2), "points-shape")
        z = arguments.numbers(depth, "depth", (len(pixels),), "depth-shape")
        points = np.empty((len(z), 3))
        points[:, 0], points[:, 1], points[:, 2] = (
            (pixels[:, 0] - self.cx) * z / self.fx,
            (pixels[:, 1] - self.cy) * z / self.fy,
            z,
        )
        return points


@dataclass(frozen=True, repr=False)
class Frame(Displayed):
    """One RGB-D frame: a depth image, the color image registered to it, and the camera.

    Attributes
    ----------
    color
        (H, W, 3) uint8 RGB, registered to the depth (same size, same view); None if there is no color.
    depth
        (H, W) float, metres along the optical axis. 0, NaN, infinite and negative values mean no reading; they are stored as 0,
        and the image as float32.
    camera
        the intrinsics of the depth image, and so of the color image.
    name
        name of the frame in its capture (the file, folder or recording it was read from).
    timestamp
        time of the frame in s, as the capture gives it; None if it gives none.

    Raises
    ------
    InputError : on construction, when the shapes or types of color, depth and camera do not fit each other.
    """

    color: Array | None
    depth: Array
    camera: Camera
    name: str = "frame"
    timestamp: float | None = None

    def __post_init__(self) -> None:
        depth = arguments.array(self.depth, "depth", "depth-shape")
        if not isinstance(self.camera, Camera):
            raise arguments.refused(self.camera, "camera", "a doo3d.Camera")
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
        arguments.check_image_size(depth, "depth")
        color = self.color
        if color is not None:
            color = arguments.array(color, "color", "color-shape")
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
        with np.errstate(invalid="ignore", over="ignore", under="ignore"):  # 16-bit floats do not hold the bounds
            good = (depth > MIN_DEPTH_M) & (depth < MAX_LENGTH_M)
        color = None if color is None else np.ascontiguousarray(color)
        with np.errstate(over="ignore", under="ignore"):  # of readings that are no good
            bits = depth.astype(np.float32, order="C", copy=False).view(np.uint32)
        set_sealed(self, color=color, depth=(bits * good).view(np.float32))  # 0 where not good, three times faster than where
        _check_labels(self)

    def summary(self) -> str:
        """Return the facts of the frame in one short line, such as "'000000', 640x480, color, depth 0.52 to 0.71 m"."""
        height, width = self.depth.shape
        read = self.depth[self.depth > 0]
        depth = f"depth {read.min():.2f} to {read.max():.2f} m" if len(read) else "no depth reading"
        return f"{self.name!r}, {width}x{height}, {'no color' if self.color is None else 'color'}, {depth}"


@dataclass(frozen=True, repr=False)
class Image(Displayed):
    """One color photograph without depth, for the 2-D mode, in which all lengths are pixels.

    Attributes
    ----------
    color
        (H, W, 3) uint8 RGB. A gray image (H, W) uint8 is accepted and stored with three equal channels.
    name
        name of the image in its capture (the file or folder it was read from).
    timestamp
        time of the image in s, as the capture gives it; None if it gives none.

    Raises
    ------
    InputError : on construction, when `color` has another shape or type.
    """

    color: Array
    name: str = "image"
    timestamp: float | None = None

    def __post_init__(self) -> None:
        color = arguments.array(self.color, "image", "image-shape")
        if color.ndim in (2, 3):
            arguments.check_image_size(color, "image")
        if color.ndim == 2:
            color = np.repeat(color[:, :, None], 3, axis=2)
        if color.ndim != 3 or color.shape[2] != 3 or color.dtype != np.uint8 or color.size == 0:
            raise InputError(
                f"image has shape {color.shape} and type {color.dtype}, expected (height, width, 3) uint8 RGB", code="image-shape"
            )
        set_sealed(self, color=np.ascontiguousarray(color))
        _check_labels(self)

    def summary(self) -> str:
        """Return name and size of the image in one short line, such as "'photo', 1280x720"."""
        return f"{self.name!r}, {self.color.shape[1]}x{self.color.shape[0]}"


@dataclass(frozen=True, repr=False)
class CameraView(Displayed):
    """One of the camera views that a point cloud was fused from: camera pose, object mask and depth.

    Attributes
    ----------
    camera
        the intrinsics of the view.
    pose
        (4, 4), camera-to-cloud transform in m: p_cloud = pose @ p_camera, with the camera's optical frame x right, y down, z
        forward.
    mask
        (H, W) bool, the pixels of the object.
    depth
        (H, W) float32 m, 0 = no reading.
    """

    camera: Camera
    pose: Floats
    mask: Bools
    depth: Array

    def __post_init__(self) -> None:
        set_sealed(self, pose=np.asarray(self.pose, dtype=float), mask=self.mask, depth=self.depth)

    def summary(self) -> str:
        """Return in one short line the size of the view, the fraction of its pixels on the object, and the camera's position."""
        x, y, z = self.pose[:3, 3]
        size = f"{self.camera.width}x{self.camera.height}"
        return f"{size}, object {self.mask.mean():.1%} of the pixels, camera at ({x:.2f}, {y:.2f}, {z:.2f}) m"


@dataclass(frozen=True, repr=False)
class Cloud(Displayed):
    """One point cloud.

    Attributes
    ----------
    points
        (N, 3) float, metres. Rows with NaN, infinity or more than 1e8 are dropped on construction.
    colors
        (N, 3) uint8 RGB, one per given point; None if there is no color. Rows of dropped points are dropped.
    viewpoint
        (3,) m, position of the sensor in the frame of the points; (0, 0, 0) for a cloud in a camera's optical frame. None if
        unknown.
    name
        name of the cloud in its capture (the file, folder or recording it was read from).
    timestamp
        time of the cloud in s, as the capture gives it; None if it gives none.
    views
        the camera views that the cloud was fused from (see `doo3d.fuse`); empty for any other cloud.
    segmented
        True if all points belong to the object, so that no segmentation is needed.
    coordinates
        the coordinate frame of the points: "camera" (optical frame: x right, y down, z forward), "cloud" (the frame of the cloud
        as given) or "world" (the world frame of the cameras' poses).
    notes
        messages to the user about how the cloud was made, one sentence each.

    Raises
    ------
    InputError : on construction, when the shapes or types of points, colors and viewpoint do not fit each other.
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
    """(N given,) bool: whether each given row was finite and was kept as a point."""

    def __post_init__(self) -> None:
        points = arguments.array(self.points, "points", "points-shape")
        if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind not in "iufc":
            raise InputError(
                f"points have shape {points.shape} and type {points.dtype}, expected (N, 3) float metres", code="points-shape"
            )
        if np.issubdtype(points.dtype, np.complexfloating):
            raise InputError("points are complex numbers, expected float metres", code="points-shape")
        arguments.check_count(len(points), current_limits().max_points, "cloud", "points")
        points = points.astype(float, order="C")
        with np.errstate(invalid="ignore"):
            finite = (np.abs(points) < MAX_LENGTH_M).all(axis=1)
        colors = self.colors
        if colors is not None:
            colors = arguments.array(colors, "colors", "colors-shape")
            if colors.shape != points.shape or colors.dtype != np.uint8:
                raise InputError(
                    f"colors have shape {colors.shape} and type {colors.dtype}, expected {points.shape} uint8 RGB",
                    code="colors-shape",
                )
            colors = colors[finite]
        viewpoint = self.viewpoint
        if viewpoint is not None:
            viewpoint = arguments.numbers(viewpoint, "viewpoint", (3,), "viewpoint-invalid")
            if not (np.abs(viewpoint) < MAX_LENGTH_M).all():
                raise InputError(f"viewpoint {viewpoint}: expected three finite numbers in metres", code="viewpoint-invalid")
        set_sealed(self, points=points[finite], colors=colors, viewpoint=viewpoint, finite=finite)
        if arguments.text(self.coordinates, "coordinates") not in CLOUD_COORDINATES:
            raise InputError(
                f"coordinates is {self.coordinates!r:.99}, expected one of {', '.join(CLOUD_COORDINATES)}", code="choice-unknown"
            )
        object.__setattr__(self, "views", arguments.each(self.views, CameraView, "views"))
        object.__setattr__(self, "segmented", arguments.flag(self.segmented, "segmented"))
        object.__setattr__(self, "notes", arguments.each(self.notes, str, "notes"))
        _check_labels(self)

    def summary(self) -> str:
        """Return the facts of the cloud in one short line, such as "'helix', 5210 points, 0.41 x 0.20 x 0.33 m, color"."""
        sides = np.ptp(self.points, axis=0) if len(self.points) else np.zeros(3)
        extent = " x ".join(f"{side:.2f}" for side in sides)
        views = f", fused from {len(self.views)} views" if self.views else ""
        color = "no color" if self.colors is None else "color"
        return f"{self.name!r}, {len(self.points)} points, {extent} m, {color}{views}"


def _check_labels(data: Frame | Image | Cloud) -> None:
    """Check the name of the data, and convert its timestamp to a float or None."""
    arguments.text(data.name, "name")
    object.__setattr__(data, "timestamp", arguments.timestamp(data.timestamp))

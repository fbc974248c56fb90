"""Fuse many views of an object at rest to one cloud in the world frame."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..config import Config, ConfigLike, as_config
from ..errors import DooError, InputError
from ..inputs import FrameRef
from ..scene.frame import FrameScene
from ..scene.multiview_model import MultiViewDepthModel
from ..scene.scene import Scene
from ..segment import segment
from ..types import Array, CameraView, Cloud, Floats, Image
from ..types.arguments import refused
from ..types.display import counted
from ..types.pose import as_pose, in_frame_of
from .camera_at_rest import check_camera_moved
from .pose_agreement import check_views_agree
from .voxel_sums import VoxelSums

FUSED_NAME = "static"
"""Name of the fused frame and of its files."""

SUPPORT_RADIUS_VOXELS = 4.0
"""Radius, in voxels, within which observations of different frames support each other."""

MAX_VIEWS = 24
"""Largest number of views for estimating the axis and testing free space: more cost time and add little."""


@dataclass
class _ViewSampler:
    """At most MAX_VIEWS (24) views, spread evenly over all frames.

    First every frame is kept, then every second, every fourth, ...
    """

    step: int = 1
    count: int = 0
    views: list[CameraView] = field(default_factory=list)

    def add(self, view: CameraView) -> None:
        """Add the view of the next frame, if its turn comes."""
        if self.count % self.step == 0 and len(self.views) == MAX_VIEWS:
            self.views, self.step = self.views[::2], 2 * self.step
        if self.count % self.step == 0:
            self.views.append(view)
        self.count += 1


@dataclass
class _Accumulation:
    """The points, views and notes of the frames added so far.

    Attributes
    ----------
    fine, coarse
        sums per voxel: (1, x, y, z, r, g, b) in voxels of one point spacing, and (1) in voxels of the support radius. None
        before the first frame.
    sampler
        views for the test of visibility.
    poses
        (4, 4) m of each fused frame, camera to world.
    notes
        one sentence for each frame left out.
    codes
        error codes of the frames left out.
    without_pose
        number of frames without a pose.
    """

    fine: VoxelSums | None = None
    coarse: VoxelSums | None = None
    sampler: _ViewSampler = field(default_factory=_ViewSampler)
    poses: list[Floats] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    codes: set[str] = field(default_factory=set)
    without_pose: int = 0

    def add(self, scene: Scene, pose: Floats) -> None:
        """Add the object's points of one frame.

        pose : (4, 4) m, camera to world.
        """
        if self.fine is None or self.coarse is None:
            size = scene.spacing
            self.fine, self.coarse = VoxelSums(size), VoxelSums(SUPPORT_RADIUS_VOXELS * size)
        points = in_frame_of(pose, scene.points)
        ones = np.ones((len(points), 1))
        self.fine.add_frame(points, np.concatenate((ones, points, _point_colors(scene)), axis=1))
        self.coarse.add_frame(points, ones)
        self.poses.append(pose)
        if isinstance(scene, FrameScene):
            self.sampler.add(CameraView(scene.camera, pose, scene.mask, scene.depth))

    def voxels(self) -> tuple[VoxelSums, VoxelSums]:
        """Return the fine and the coarse voxels.

        Raises
        ------
        InputError : no frame was added.
        """
        if self.without_pose and not self.poses:
            raise InputError(
                "no frame has a camera pose, which fusing needs: give a capture with poses (TUM, BOP, a bag with tf), or "
                "--input-option trajectory=FILE",
                code="pose-missing",
            )
        if self.fine is None or self.coarse is None:
            raise InputError(
                "no frame can be used" + (f": {self.notes[0]}" if self.notes else ""),
                code=self.codes.pop() if len(self.codes) == 1 else "frames-unusable",
            )
        return self.fine, self.coarse


def fuse(frames: Iterable[FrameRef], config: ConfigLike | None = None) -> Cloud:
    """Fuse the views of an object at rest to one cloud in world coordinates.

    Each frame is segmented according to the settings, or by the capture's masks; the object's points are moved to world
    coordinates and averaged per voxel, with voxels of the point spacing. Points with fewer than `fusion.min_views` frames
    nearby are removed if at least as many views saw through them as saw the object there, or if no frame has a depth image.
    Frames are read one at a time; memory does not grow with their number.

    Parameters
    ----------
    frames
        the frames of a capture with camera poses and an object at rest, such as `open_capture(path).frames`. A pose is (4, 4)
        m, camera to world: p_world = pose @ p_camera.
    config
        the settings of segmentation and fusion, as `detect` takes them; None for the preset "default". `fusion.min_views` is
        limited to half of the number of frames, rounded up.

    Returns
    -------
    Cloud, m, in the world frame of the poses, with colors if all frames have them. It contains the object
    alone, and `detect` does not segment it again. Its notes name the frames that could not be used.

    Raises
    ------
    InputError : no frame has a pose, the camera did not move, the views contradict each other by their poses, or
    no usable frame
        shows the object.
    """
    config = as_config(config)
    if isinstance(frames, str | np.ndarray) or not isinstance(frames, Iterable):
        raise refused(frames, "frames", "the frames of a capture, as doo3d.open_capture returns it")
    gathered = _gather(frames, config)
    gathered.voxels()
    check_camera_moved(np.array(gathered.poses))
    check_views_agree(gathered.sampler.views)
    return _cloud(gathered, config, FUSED_NAME)


def fuse_cameras(views: Iterable[FrameRef], config: Config, name: str, timestamp: float | None) -> Cloud:
    """Fuse the simultaneous views of several cameras of a rig to one cloud.

    A camera from which the object is hidden is left out; one view is enough.

    Parameters
    ----------
    views
        the frame of each camera, with its pose in the rig.
    config
        the settings of segmentation and fusion.
    name, timestamp
        name and time (s) of the cloud.

    Raises
    ------
    InputError : no frame can be used, or the object is in none.
    """
    return replace(_cloud(_gather(views, config), config, name), timestamp=timestamp)


def _gather(frames: Iterable[FrameRef], config: Config) -> _Accumulation:
    """Add up the object's points of all usable frames, with notes on the others."""
    gathered = _Accumulation()
    for frame in frames:
        if not isinstance(frame, FrameRef):
            raise refused(frame, "a frame", "a FrameRef: give the capture, as doo3d.open_capture returns it")
        try:
            loaded = frame.load()
            if loaded.pose is None:
                gathered.without_pose += 1
                continue
            pose = as_pose(loaded.pose, "its pose")
            if isinstance(loaded.data, Image):
                raise InputError("it is an image without depth, of which no cloud can be made", code="mode-needs-depth")
            scene = segment(loaded.data, config.segment, loaded.mask_for(config), config.seed).scene
            if not len(scene.points):
                raise InputError("the object is not in it", code="object-missing")
        except DooError as error:
            gathered.notes.append(f"{frame.name} is left out: {error}")
            gathered.codes.add(error.code)
            continue
        gathered.add(scene, pose)
    return gathered


def _cloud(gathered: _Accumulation, config: Config, name: str) -> Cloud:
    """Return the cloud of the accumulated points; raise InputError if there are none."""
    fine, coarse = gathered.voxels()
    poses: Floats = np.array(gathered.poses)
    notes = [f"{counted(len(poses), 'frame')} {'is' if len(poses) == 1 else 'are'} fused", *gathered.notes]
    if gathered.without_pose:
        notes.append(f"{gathered.without_pose} frames without a pose are left out")
    views = gathered.sampler.views
    min_views = min(config.fusion.min_views, (len(poses) + 1) // 2)
    points, colors = _consistent_points(fine, coarse, min_views, views, config.visibility.margin)
    return Cloud(
        points,
        colors,
        viewpoint=_central_viewpoint(poses) if views else None,
        name=name,
        views=tuple(views),
        segmented=True,
        coordinates="world",
        notes=tuple(notes),
    )


def _central_viewpoint(poses: Floats) -> Floats:
    """Return the camera position (3,) m that is nearest to the mean of all positions."""
    positions: Floats = poses[:, :3, 3]
    return np.asarray(positions[np.linalg.norm(positions - positions.mean(axis=0), axis=1).argmin()])


def _point_colors(scene: Scene) -> Floats:
    """Return the colors (N, 3) of the points; NaN without colors."""
    colors = scene.point_colors()
    return colors.astype(float) if len(colors) else np.full(scene.points.shape, np.nan)


def _consistent_points(
    fine: VoxelSums, coarse: VoxelSums, min_views: int, views: Sequence[CameraView], margin: float
) -> tuple[Floats, Array | None]:
    """Return the mean point and color of each voxel that the views do not contradict.

    Parameters
    ----------
    fine, coarse
        the voxels of `_Accumulation`.
    min_views
        smallest number of frames in the coarse voxel of a point. A point with fewer is removed if the views contradict it (at
        least as many saw through it as saw the object there), or if there are no views.
    views
        the views to compare with.
    margin
        m, smallest distance of a depth reading behind a point that shows free space.

    Returns
    -------
    Points (N, 3) m, and colors (N, 3) uint8; None for the colors if a voxel has none.
    """
    mean = fine.sums[:, 1:] / fine.sums[:, :1]
    points, colors = mean[:, :3], mean[:, 3:]
    kept = coarse.frames[np.searchsorted(coarse.keys, coarse.keys_of(fine.centers()))] >= min_views
    if views and not kept.all():
        kept[~kept] = ~MultiViewDepthModel.of_views(views, margin, True).contradicted_by_views(points[~kept])
    points, colors = points[kept], colors[kept]
    if not len(points):
        raise InputError(
            f"no part is seen by {min_views} frames: check the poses, and that the object is at rest", code="views-too-few"
        )
    return points, np.rint(colors).astype(np.uint8) if np.isfinite(colors).all() else None

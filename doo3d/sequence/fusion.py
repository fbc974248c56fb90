"""Many views of a thing at rest as one cloud: the object's pixels of every frame, by the camera's poses, in the world."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from ..config import Config
from ..errors import DooError, InputError
from ..geometry.radius import point_spacing
from ..geometry.sparse_grid import sorted_unique
from ..inputs import Capture, FrameData, FrameRef
from ..stages.segment import segment
from ..types import Array, CameraView, Cloud, Floats, Foreground, Frame, Image, Ints
from ..visibility import MultiViewVisibility

NAME = "static"

HALF = 1 << 20
"""Voxels from the world's origin to the end of the grid, on either side; three such numbers fit 64 bits."""

MOVED, TURNED = 0.005, np.radians(1.0)
"""m and radians; a camera whose poses differ by less has not moved."""


SUPPORT_RADIUS_VOXELS = 4.0
"""Radius, in voxels, within which observations of different frames support each other."""

MAX_VIEWS = 24
"""Frames, evenly over all, whose masks tell where the axis is: more cost time and add little."""


@dataclass
class _Voxels:
    """Occupied voxels of an edge in m: keys (M,) ascending, the sums (M, C) of what was in each, and how many frames saw it."""

    size: float
    keys: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    sums: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    frames: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def of(self, points: Floats) -> Ints:
        """The keys (N,) of points (N, 3) m."""
        places = np.floor(points / self.size).astype(np.int64) + HALF
        if (places < 0).any() or (places >= 2 * HALF).any():
            raise InputError(
                f"it lies over {HALF * self.size:.3g} m from the world's origin: give poses in metres from an origin nearby",
                code="voxels-too-many",
            )
        return np.asarray((places[:, 0] * 2 * HALF + places[:, 1]) * 2 * HALF + places[:, 2])

    def add(self, points: Floats, values: Floats) -> None:
        """One more frame: points (N, 3) m with values (N, C)."""
        keys = self.of(points)
        merged = sorted_unique(np.concatenate((self.keys, keys)))
        old, new = np.searchsorted(merged, self.keys), np.searchsorted(merged, keys)
        sums: Floats = np.column_stack([np.bincount(new, weights=column, minlength=len(merged)) for column in values.T])
        frames: Ints = (np.bincount(new, minlength=len(merged)) > 0).astype(np.int64)
        if len(self.keys):
            sums[old] += self.sums
            frames[old] += self.frames
        self.keys, self.sums, self.frames = merged, sums, frames


@dataclass
class _Views:
    """Some of all views, evenly: every one, then every second, every fourth, so that there are never more than `most`."""

    most: int
    every: int = 1
    count: int = 0
    kept: list[CameraView] = field(default_factory=list)

    def add(self, view: CameraView) -> None:
        if self.count % self.every == 0:
            if len(self.kept) == self.most:
                self.kept, self.every = self.kept[::2], 2 * self.every
            if self.count % self.every == 0:
                self.kept.append(view)
        self.count += 1


def fuse(entries: Iterable[FrameRef], config: Config) -> Cloud:
    """The object in all frames as one cloud in the world frame of the poses, each voxel the mean of what was seen in it.

    Every frame is told from the rest as the config says, or by the capture's masks. What fewer than `fusion.min_views` frames
    see, and others see through, goes. Frames are read one at a time, and what is kept does not grow with their number; those
    that cannot be used are named in the notes.

    Raises
    ------
    InputError : no frame has a pose; the camera did not move; no frame can be used, or the object is in none.
    """
    fine: _Voxels | None = None
    coarse: _Voxels | None = None
    views = _Views(MAX_VIEWS)
    poses: list[Floats] = []
    notes: list[str] = []
    codes: set[str] = set()
    lost = 0
    for entry in entries:
        try:
            shot = entry.load()
            if shot.pose is None:
                lost += 1
                continue
            pose = _checked(shot.pose)
            found = segment(_with_depth(shot), config.segment, shot.mask_for(config), config.seed).foreground
            if not len(found.points):
                raise InputError("the object is not in it", code="object-missing")
        except DooError as error:
            notes.append(f"{entry.name} is left out: {error}")
            codes.add(error.code)
            continue
        if fine is None or coarse is None:
            size = point_spacing(found)
            fine, coarse = _Voxels(size), _Voxels(SUPPORT_RADIUS_VOXELS * size)
        points = found.points @ pose[:3, :3].T + pose[:3, 3]
        one = np.ones((len(points), 1))
        fine.add(points, np.concatenate((one, points, _colors(found)), axis=1))
        coarse.add(points, one)
        poses.append(pose)
        if found.camera is not None and found.mask is not None and found.depth is not None:
            views.add(CameraView(found.camera, pose, found.mask, found.depth))
    if lost and not poses:
        raise InputError(
            "no frame says where its camera was, which fusing them needs: a capture with poses (TUM, BOP, a bag with tf), or "
            "--input-option trajectory=FILE",
            code="pose-missing",
        )
    if fine is None or coarse is None:
        raise InputError(
            "no frame can be used" + (f": {notes[0]}" if notes else ""),
            code=codes.pop() if len(codes) == 1 else "frames-unusable",
        )
    if lost:
        notes.append(f"{lost} frames without a pose are left out")
    check_moved(np.array(poses))
    least = min(config.fusion.min_views, (len(poses) + 1) // 2)
    seen, shown = _kept(fine, coarse, least, views.kept, config.visibility.margin)
    places: Floats = np.array(poses)[:, :3, 3]
    central = places[np.linalg.norm(places - places.mean(axis=0), axis=1).argmin()]
    viewpoint = central if views.kept else None
    said = (f"{len(poses)} frames are fused", *notes)
    return Cloud(seen, shown, viewpoint, NAME, None, tuple(views.kept), True, "world", said)


def check_moved(poses: Floats) -> None:
    """Raises InputError where all poses (F, 4, 4) are the same."""
    way = np.linalg.norm(poses[:, :3, 3] - poses[0, :3, 3], axis=1).max()
    cos = (np.einsum("fij,ij->f", poses[:, :3, :3], poses[0, :3, :3]) - 1) / 2
    turn = np.arccos(np.clip(cos, -1, 1)).max()
    if way < MOVED and turn < TURNED:
        raise InputError(
            f"the camera did not move ({1000 * way:.1f} mm, {np.degrees(turn):.1f} degrees in {len(poses)} frames): every frame "
            "shows the same parts, detect in them one by one, without --fuse-views",
            code="camera-still",
        )


def _checked(pose: Floats) -> Floats:
    pose = np.asarray(pose, dtype=float)
    if pose.shape != (4, 4) or not np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-3):
        raise InputError("its pose is no rotation and shift, 4 x 4", code="pose-invalid")
    return pose


def _with_depth(shot: FrameData) -> Frame | Cloud:
    if isinstance(shot.data, Image):
        raise InputError("it is an image without depth, of which no cloud can be made", code="mode-needs-depth")
    return shot.data


def _colors(found: Foreground) -> Floats:
    """(N, 3) of the points; NaN where they have none."""
    if found.color is None or found.pixels is None:
        return np.full(found.points.shape, np.nan)
    return found.color[found.pixels[:, 1], found.pixels[:, 0]].astype(float)


def _kept(fine: _Voxels, coarse: _Voxels, least: int, views: list[CameraView], margin: float) -> tuple[Floats, Array | None]:
    """The means of the voxels, points (N, 3) m and colours (N, 3) uint8, without what other frames contradict.

    A voxel near which fewer than `least` frames saw something goes where as many of the views saw through it, or where there
    are no views to ask.
    """
    mean = fine.sums[:, 1:] / fine.sums[:, :1]
    points, colors = mean[:, :3], mean[:, 3:]
    kept = coarse.frames[np.searchsorted(coarse.keys, coarse.of(points))] >= least
    if views and not kept.all():
        kept[~kept] = ~MultiViewVisibility.of_views(views, margin, True).contradicted_by_views(points[~kept])
    points, colors = points[kept], colors[kept]
    if not len(points):
        raise InputError(
            f"nothing is seen by {least} frames: are the poses right, and is the thing at rest?", code="views-too-few"
        )
    return points, np.rint(colors).astype(np.uint8) if np.isfinite(colors).all() else None


class FusedCapture:
    """A capture of which all frames are one, called `static`: the cloud that they are fused to when it is loaded.

    Raises
    ------
    InputError : the config is for images.
    """

    def __init__(self, capture: Capture, config: Config) -> None:
        if config.mode == "2d":
            raise InputError(
                "--fuse-views fuses frames in space, and the config is for images (mode: 2d): use a 3-D one (-c default)",
                code="config-mode",
            )
        self.path, self.format = capture.path, f"{capture.format}, fused"
        self.masks: Path | None = getattr(capture, "masks", None)
        self.selection: str | None = getattr(capture, "selection", None)
        self.frames: Sequence[FrameRef] = [FrameRef(NAME, capture.path, partial(_load, tuple(capture.frames), config))]


def _load(entries: tuple[FrameRef, ...], config: Config) -> FrameData:
    return FrameData(fuse(entries, config))

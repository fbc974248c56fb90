"""Measure coverage and accuracy against the number of fused views: `python -m doo3d.evaluation.benchmark.fused_views`."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ...config import Config, load_config
from ...fusion.fuse import fuse
from ...inputs import FrameData, FrameRef
from ...pipeline import detect
from ...types import Bools, Floats
from ..metrics.record import Record, flags, number, share
from ..metrics.score import score
from ..rendering.renderer import Rendered, render
from ..scenes.model import Scene, corners, cuboid, moved_scene
from ..scenes.registry import make_scene
from .run import print_lines
from .tables import markdown_table

SCENES = (("open", 1), ("crossing", 3), ("crossings", 2), ("several", 6), ("occluded", 5))
VIEW_COUNTS = (1, 2, 4, 8, 16)

TILT_DEGREES = 30.0
"""Angle in degrees between the optical axis of each camera and that of the scene's own camera."""

SIZE = (640, 480)
"""Width and height of the images, px."""

BLOCK_SIZE, BLOCK_HEIGHT = (0.06, 0.05, 0.02), 0.05
"""Block that hides a part of the cable from each view: edges in m (along the cable, across it, up), height above it in m."""


@dataclass(frozen=True)
class RenderedView:
    """A rendered frame, and the pose of its camera.

    Attributes
    ----------
    rendered
        the frame with its truth, in the optical frame of this view's camera.
    pose
        (4, 4) transform from this view's camera to the scene, m: p_scene = pose @ p_camera. The scene's coordinate frame is the
        optical frame of its own camera.
    """

    rendered: Rendered
    pose: Floats

    def ref(self) -> FrameRef:
        """Return the view as a frame of a capture, whose `load` returns the images, the true mask and the pose."""
        data = FrameData(self.rendered.frame, self.rendered.mask, self.pose)
        return FrameRef(self.rendered.frame.name, Path(self.rendered.frame.name), partial(_identity, data))


def _identity(data: FrameData) -> FrameData:
    return data


def with_block(scene: Scene) -> Scene:
    """Return the scene with a block above the middle of its first cable, which replaces all other occluders.

    The block is 6 cm long along the cable, 5 cm wide and 2 cm high, with its middle 5 cm above the cable's axis. Up is the
    table's normal; without a table, towards the camera.
    """
    axis, k = scene.cables[0].axis, len(scene.cables[0].axis) // 2
    up = scene.table.normal if scene.table is not None else np.array((0.0, 0.0, -1.0))
    along = axis[k + 1] - axis[k]
    along = along - (along @ up) * up
    along /= np.linalg.norm(along)
    rotation = np.array((along, np.cross(up, along), up))
    return replace(scene, occluders=(cuboid(axis[k] + BLOCK_HEIGHT * up + corners(BLOCK_SIZE) @ rotation),))


def scene_in_view(scene: Scene, pose: Floats, name: str) -> Scene:
    """Return the scene, transformed to the optical frame of another camera.

    Parameters
    ----------
    scene
        the scene, in the optical frame of its own camera.
    pose
        (4, 4), from the other camera to the scene: p_scene = pose @ p_other, m.
    name
        name of the returned scene.
    """
    rotation, position = pose[:3, :3], pose[:3, 3]
    return moved_scene(scene, lambda points: (points - position) @ rotation, lambda vector: vector @ rotation, name)


def circle_views(scene: Scene, count: int, tilt_degrees: float = TILT_DEGREES, sensor: str = "d435") -> list[RenderedView]:
    """Render a scene from cameras on a circle round the optical axis of its own camera.

    All cameras look at the same point, the one on that axis at the cables' mean depth, from the same distance.

    Parameters
    ----------
    scene
        the scene, in the optical frame of its own camera.
    count
        number of cameras, evenly spaced on the circle.
    tilt_degrees
        angle between the optical axis of each camera and that of the scene's own camera, degrees.
    sensor
        simulated depth camera: "d435", "d455", "zivid", or "none" for exact depth.

    Returns
    -------
    A view for each camera, with its pose in the scene's frame.
    """
    return rendered_views(scene, circle_poses(scene, count, tilt_degrees), f"{scene.name}/", sensor)


def rendered_views(scene: Scene, poses: Sequence[Floats], name: str, sensor: str = "d435") -> list[RenderedView]:
    """Render a scene from cameras at poses (4, 4), each from the camera to the scene, m; view names begin with `name`."""
    return [RenderedView(render(scene_in_view(scene, pose, f"{name}{k}"), sensor), pose) for k, pose in enumerate(poses)]


def circle_poses(scene: Scene, count: int, tilt_degrees: float = TILT_DEGREES) -> list[Floats]:
    """Return the poses (4, 4) of the cameras of `circle_views`, from each camera to the scene, m."""
    center = np.vstack([cable.axis for cable in scene.cables]).mean(axis=0) * (0, 0, 1)
    poses = list[Floats]()
    for k in range(count):
        angle = 2 * np.pi * k / count
        pose = np.eye(4)
        tilt = np.radians(tilt_degrees) * np.array((np.cos(angle), np.sin(angle), 0))
        pose[:3, :3] = Rotation.from_rotvec(tilt).as_matrix()
        pose[:3, 3] = center - pose[:3, :3] @ center
        poses.append(pose)
    return poses


def fused_score(scene: Scene, views: list[RenderedView], config: Config) -> Record:
    """Detect in the fused views of a scene, or in the frame of a single view, and return the score.

    Parameters
    ----------
    scene
        the scene with the true cables.
    views
        one or more views of this scene. A part of a cable counts as seen if any view shows it.
    config
        the configuration of the fusion and the detection.
    """
    if len(views) == 1:
        rendered = views[0].rendered
        return score(detect(rendered.frame, config, rendered.mask).chains, rendered.truths)
    truths = [replace(cable, seen=seen) for cable, seen in zip(scene.cables, seen_by_any(views), strict=True)]
    return score(detect(fuse([view.ref() for view in views], config), config).chains, truths)


def seen_by_any(views: Sequence[RenderedView]) -> list[Bools]:
    """Return for each cable a (P,) bool array: which of its P axis samples at least one view shows."""
    per_cable = zip(*([truth.seen for truth in view.rendered.truths] for view in views), strict=True)
    return [np.asarray(np.any(np.array(seen), axis=0)) for seen in per_cable]


def seen_fraction(views: list[RenderedView]) -> float:
    """Return the fraction, 0 to 1, of the cables' length that at least one of the views shows.

    Parameters
    ----------
    views
        views of the same scene, from `circle_views`; at least one.
    """
    return float(np.mean(np.concatenate(seen_by_any(views))))


COLUMNS = (
    number(("in view", "%"), 0, "in_view", 1, np.mean, 100),
    share(("correct", ""), 0, "frames", flags("correct"), "{} of {}"),
    number(("covered, least,", "%"), 0, "coverage", 0, np.min, 100),
    number(("RMS seen,", "mm"), 0, "rms_seen", 2, np.mean),
    number(("RMS hidden,", "mm"), 0, "rms_hidden", 2, np.mean),
    number(("radius,", "detected/true"), 0, "radius_ratio", 3, np.mean),
)
"""Columns of the table: percentage of the cables' length that a view shows; correct scenes; least coverage of a cable by its
chain over the scenes; distance from the true axis where it is seen and where it is hidden; detected radius divided by the true
radius."""


def table(sensor: str = "d435") -> Iterator[str]:
    """Yield the lines of a Markdown table of coverage and accuracy for 1, 2, 4, 8 and 16 fused views.

    Each line summarizes five rendered scenes with a block above a cable. `sensor` is a simulated depth camera, or "none" for
    exact depth.
    """
    config, rows = load_config("default"), list[Record]()
    for count in VIEW_COUNTS:
        for scene in (with_block(make_scene(family, seed, SIZE)) for family, seed in SCENES):
            views = circle_views(scene, count, sensor=sensor)
            rows.append(Record(fused_score(scene, views, config) | {"variant": str(count), "in_view": seen_fraction(views)}))
    return markdown_table("views", rows, COLUMNS)


if __name__ == "__main__":
    print_lines(table)

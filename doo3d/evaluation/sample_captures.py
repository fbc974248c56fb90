"""Write small rendered captures and clouds with their truth, for `doo3d samples`."""

import json
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from ..inputs.support.open3d import open3d
from ..types import Array, Camera
from .benchmark.fused_views import circle_poses, scene_in_view, with_block
from .rendering.renderer import Rendered, render
from .sample_bag import write_bag
from .sample_scenes import hand_scenes, t_piece_scene
from .scenes.model import Scene, Truth, moved_scene
from .scenes.registry import make_scene
from .truth_file import write_truth

Writer = Callable[[], Path]
"""Function that writes one sample and returns its path."""

CAPTURES: dict[str, tuple[str, int, int]] = {
    "straight": ("straight", 3, 1),
    "crossing": ("crossing", 3, 3),
    "occluder": ("occluded", 5, 2),
    "helix": ("air", 11, 1),
    "two_cables": ("several", 6, 1),
}
"""Name of a capture -> family, seed, number of frames; the seeds are typical of their families."""

LAID_OUT: dict[str, Callable[[], list[Scene]]] = {"hand": hand_scenes, "t_piece": lambda: [t_piece_scene()]}
"""Name of a capture with hand-made scenes -> function that returns its scenes, one for each frame."""

CLOUDS: dict[str, tuple[str, int, str, bool]] = {
    "open.ply": ("open", 1, "d435", False),
    "crossing.ply": ("crossing", 10, "d435", False),
    "helix.ply": ("air", 8, "d435", False),
    "on_table.ply": ("open", 2, "d435", True),
    "two_cables.npz": ("several", 10, "d435", False),
}
"""Name of a cloud -> family, seed, sensor, whether the cloud includes the table around the cable."""

PHOTOS: dict[str, tuple[str, int]] = {
    "four": ("several", 3),
    "hairpin": ("hairpin", 2),
    "hidden": ("occluded", 3),
    "knot": ("knots", 3),
    "loop": ("crossing", 3),
    "tangle": ("tangle", 3),
}
"""Name of a photograph -> family, seed."""

PAIRS: dict[str, tuple[str, int]] = {"stereo_pair": ("crossing", 2)}
"""Name of a stereo pair without depth -> family, seed."""

PAIR_BASELINE = 0.06
"""Distance in m from the left to the right camera of a pair."""

RIGS: dict[str, tuple[str, int]] = {"two_cameras": ("open", 1)}
"""Name of a rig of two depth cameras -> family, seed. A block hides a part of the cable from one of the cameras."""

RIG_TILT = 25.0
"""Angle in degrees between the cameras of a rig and the scene's own camera."""

BAGS = ("crossing",)
"""Names of the captures that are also written as a ROS 2 bag."""

PHOTO_SIZE = (640, 480)
"""Width and height of a photograph, px."""

AXES_SCHEMA = "doo3d/axes/1"

AXIS_STRIDE = 6
"""Number of points of a true axis, 0.5 mm apart, per point written to axes.json."""

DEPTH_SCALE = 1000
"""Units per metre of the depth images."""

JPEG_QUALITY = 90

ORBIT_STEP_DEGREES = 4.0
"""Angle in degrees by which the camera orbits the scene from frame to frame."""

TABLE_MARGIN_PX, TABLE_STRIDE_PX = 40, 3
"""Cloud with its table: margin around the cable in px, and step from one used pixel to the next in px."""


def write_samples(folder: str | Path, with_progress: Callable[[list[Writer]], Iterable[Writer]] = iter) -> list[Path]:
    """Render all samples and write them below a folder; the files have the same bytes every time.

    - A capture is `<name>/color/000000.jpg`, `<name>/depth/000000.png` (uint16 mm), `<name>/camera_intrinsic.json` and
      `<name>/truth.json`.
    - A cloud is `clouds/<name>` and `clouds/<name without suffix>.truth.json`, in the camera's optical frame.
    - `bags/<name>` is a ROS 2 bag of a capture's first frame.
    - A photograph is `photos/<name>.jpg` with its mask `photos/mask/<name>.png`; `photos/axes.json` holds the true axes of all
      photographs, in pixels.
    - A stereo pair is `<name>/000000.jpg`, both images side by side, with masks, `rig.yaml` and the truth for the left camera.
    - A rig of depth cameras is a capture for each camera, and `rig.yaml`.

    folder : output folder; made if missing. with_progress : called with the list of writers; returns an iterable of them, for
    example one that shows a progress bar.

    Returns
    -------
    The written paths: the folders of the captures, the files of the clouds, the bags, and the folder of the photographs.

    Raises
    ------
    MissingDependency : rosbags or open3d is not installed.
    """
    folder = Path(folder)
    writers: list[Writer] = [
        *(partial(_write_capture, folder / name, orbited_scenes, *values) for name, values in CAPTURES.items()),
        *(partial(_write_capture, folder / name, lay_out) for name, lay_out in LAID_OUT.items()),
        *(partial(_write_cloud, folder / "clouds" / name, *scene) for name, scene in CLOUDS.items()),
        *(partial(write_bag, folder / name, folder / "bags" / name) for name in BAGS if name in CAPTURES),
        partial(_write_photos, folder / "photos"),
        *(partial(_write_pair, folder / name, *scene) for name, scene in PAIRS.items()),
        *(partial(_write_rig, folder / name, *scene) for name, scene in RIGS.items()),
    ]
    return [write() for write in with_progress(writers)]


def _write_capture(folder: Path, make_scenes: Callable[..., list[Scene]], *values: str | int) -> Path:
    return write_rendered(folder, map(render, make_scenes(*values)))


def write_rendered(folder: Path, frames: Iterable[Rendered], with_labels: bool = False) -> Path:
    """Write rendered frames of one camera as a capture with truth.json; return its folder.

    Parameters
    ----------
    folder
        the folder, made if missing.
    frames
        the frames; each is written before the next is taken.
    with_labels
        whether to write the true mask (mask/) and the number of the cable at each pixel (instances/), too.
    """
    truths: dict[str, tuple[Truth, ...]] = {}
    for part in ("color", "depth", *(("mask", "instances") if with_labels else ())):
        (folder / part).mkdir(parents=True, exist_ok=True)
    for k, rendered in enumerate(frames):
        name = f"{k:06d}"
        depth = np.round(rendered.frame.depth * DEPTH_SCALE).astype(np.uint16)
        _write_image(folder / "depth" / f"{name}.png", depth, cv2.IMWRITE_PNG_COMPRESSION, 9)
        _write_color(folder / "color" / f"{name}.jpg", rendered)
        if with_labels:
            _write_mask(folder / "mask" / f"{name}.png", rendered)
            numbers = np.where(rendered.mask, rendered.labels, 0).astype(np.uint8)
            _write_image(folder / "instances" / f"{name}.png", numbers, cv2.IMWRITE_PNG_COMPRESSION, 9)
        truths[name] = rendered.truths
        write_intrinsics(folder / "camera_intrinsic.json", rendered.frame.camera)
    write_truth(folder / "truth.json", truths)
    return folder


def _write_photos(folder: Path) -> Path:
    (folder / "mask").mkdir(parents=True, exist_ok=True)
    axes = {}
    for name, (family, seed) in PHOTOS.items():
        rendered = render(make_scene(family, seed, PHOTO_SIZE))
        _write_color(folder / f"{name}.jpg", rendered)
        _write_mask(folder / "mask" / f"{name}.png", rendered)
        axes[name] = [_pixel_axis(truth, rendered.frame.camera) for truth in rendered.truths]
    text = json.dumps({"schema": AXES_SCHEMA, "photos": axes}, separators=(",", ":")).replace("}", "}\n")
    (folder / "axes.json").write_text(text, encoding="utf-8", newline="\n")
    return folder


def _write_pair(folder: Path, family: str, seed: int) -> Path:
    scene, shift = make_scene(family, seed, PHOTO_SIZE), np.array([PAIR_BASELINE, 0.0, 0.0])
    aside = moved_scene(scene, lambda points: points - shift, lambda vector: vector, f"{scene.name}/right")
    views = [render(scene, "none"), render(aside, "none")]
    (folder / "mask").mkdir(parents=True, exist_ok=True)
    _write_color(folder / "000000.jpg", *views)
    _write_mask(folder / "mask" / "000000.png", *views)
    camera = scene.camera
    known = {"intrinsics": [camera.fx, camera.fy, camera.cx, camera.cy]}
    cameras = [
        {"name": side, "side_by_side": side} | known | {"pose": [*position.tolist(), 0.0, 0.0, 0.0, 1.0]}
        for side, position in (("left", 0 * shift), ("right", shift))
    ]
    _write_rig_file(folder, cameras)
    write_truth(folder / "truth.json", {"000000": views[0].truths})
    return folder


def _write_rig(folder: Path, family: str, seed: int) -> Path:
    scene = with_block(make_scene(family, seed, PHOTO_SIZE))
    cameras = []
    for name, pose in zip(("front", "back"), circle_poses(scene, 2, RIG_TILT), strict=True):
        _write_capture(folder / name, lambda pose=pose, name=name: [scene_in_view(scene, pose, f"{scene.name}/{name}")])
        cameras.append({"name": name, "capture": name, "pose": pose.round(6).tolist()})
    _write_rig_file(folder, cameras)
    return folder


def _write_rig_file(folder: Path, cameras: list[dict[str, Any]]) -> None:
    text = yaml.safe_dump({"cameras": cameras}, sort_keys=False, default_flow_style=None, width=200)
    (folder / "rig.yaml").write_text(text, encoding="utf-8", newline="\n")


def _pixel_axis(truth: Truth, camera: Camera) -> dict[str, Any]:
    """Return the JSON values of a cable in the image: axis to 0.1 px, median radius in px, and visibility of each point."""
    chosen = np.append(np.arange(0, len(truth.axis) - 1, AXIS_STRIDE), len(truth.axis) - 1)
    seen = np.ones(len(truth.axis), dtype=bool) if truth.seen is None else truth.seen
    return {
        "radius": round(float(np.median(truth.radius * camera.fx / truth.axis[:, 2])), 2),
        "closed": truth.closed,
        "axis": camera.project(truth.axis[chosen]).round(1).tolist(),
        "seen": seen[chosen].astype(int).tolist(),
    }


def write_intrinsics(path: Path, camera: Camera) -> None:
    """Write the camera's intrinsics to a JSON file in the format of Open3D's recorder.

    The file holds width, height, the 3 x 3 intrinsic matrix in px (column by column), and the depth scale (1000 units per metre).

    path : the file to write; an existing one is replaced. camera : the intrinsics and the image size.
    """
    values = {
        "width": camera.width,
        "height": camera.height,
        "intrinsic_matrix": [camera.fx, 0, 0, 0, camera.fy, 0, camera.cx, camera.cy, 1],
        "depth_scale": DEPTH_SCALE,
    }
    path.write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8", newline="\n")


def _write_image(path: Path, image: Array, *options: int) -> None:
    _, data = cv2.imencode(path.suffix, image, options)
    path.write_bytes(data.tobytes())


def _write_color(path: Path, *views: Rendered) -> None:
    """Write the color images of views side by side."""
    color = cv2.cvtColor(np.hstack([np.asarray(view.frame.color) for view in views]), cv2.COLOR_RGB2BGR)
    _write_image(path, color, cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY)


def _write_mask(path: Path, *views: Rendered) -> None:
    """Write the masks of views side by side."""
    _write_image(path, np.hstack([view.mask for view in views]).astype(np.uint8) * 255, cv2.IMWRITE_PNG_COMPRESSION, 9)


def _write_cloud(path: Path, family: str, seed: int, sensor: str, with_table: bool) -> Path:
    rendered = render(make_scene(family, seed), sensor)
    points, colors = cloud_of(rendered, with_table)
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".npz":
        np.savez_compressed(path, points=points, colors=colors)
    else:
        core, cloud = open3d().core, open3d().t.geometry.PointCloud()
        cloud.point.positions = core.Tensor.from_numpy(points)
        cloud.point.colors = core.Tensor.from_numpy(colors)
        open3d().t.io.write_point_cloud(str(path), cloud)
    write_truth(path.with_suffix(".truth.json"), {path.stem: rendered.truths})
    return path


def cloud_of(rendered: Rendered, with_table: bool = False) -> tuple[Array, Array]:
    """Convert a rendered frame to a colored cloud of the cables, alone or with the table around them.

    rendered : the frame and its mask. with_table : False takes all pixels of the cables; True takes every third pixel in x and y
    of the rectangle around the cables, with a margin of 40 px.

    Returns
    -------
    points : (N, 3) float32 m, N points in the camera's optical frame; pixels without depth are left out.
    colors : (N, 3) uint8 RGB.
    """
    chosen = rendered.mask
    if with_table:
        v, u = np.nonzero(rendered.mask)
        chosen = np.zeros_like(rendered.mask)
        around = (slice(max(v.min() - TABLE_MARGIN_PX, 0), v.max() + TABLE_MARGIN_PX, TABLE_STRIDE_PX),)
        chosen[(*around, slice(max(u.min() - TABLE_MARGIN_PX, 0), u.max() + TABLE_MARGIN_PX, TABLE_STRIDE_PX))] = True
    depth = rendered.frame.depth
    v, u = np.nonzero(chosen & (depth > 0))
    points = rendered.frame.camera.unproject(np.column_stack((u, v)), depth[v, u])
    return points.astype(np.float32), np.ascontiguousarray(np.asarray(rendered.frame.color)[v, u])


def orbited_scenes(family: str, seed: int, frames: int) -> list[Scene]:
    """Return the scene of each frame, seen by a camera that orbits a scene of a family."""
    scene = make_scene(family, seed)
    return [orbited_scene(scene, k * ORBIT_STEP_DEGREES, f"{scene.name}/{k}") for k in range(frames)]


def orbited_scene(scene: Scene, angle: float, name: str) -> Scene:
    """Return the scene in the optical frame of a camera that moved on a circle around the scene.

    The center of the circle is the point on the optical axis at the cables' mean depth; the circle's axis is parallel to the
    image's y axis. The camera keeps looking at the center.

    Parameters
    ----------
    scene
        the scene, in the optical frame of its own camera.
    angle
        degrees; a positive angle moves the camera to its right.
    name
        name of the returned scene.
    """
    middle = np.vstack([cable.axis for cable in scene.cables]).mean(axis=0)
    middle[:2] = 0
    rotation = Rotation.from_euler("y", angle, degrees=True)
    return moved_scene(scene, lambda points: rotation.apply(points - middle) + middle, rotation.apply, name)

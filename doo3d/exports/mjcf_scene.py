"""Build the scene around the chains of a MuJoCo model: light, ground at z = 0 with z up, camera of the capture."""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ..types import Chain, Detection, Floats
from .gravity import ground_of, upright_pose
from .xml import tag

SKY, HORIZON = (0.36, 0.45, 0.56), (0.83, 0.87, 0.91)
TILES = (0.80, 0.81, 0.82), (0.72, 0.73, 0.75)
TILES_PER_METRE = 10  # squares of 5 cm: a checker texture has two of them along each side
LIGHT_HEIGHT = 2.0  # m above the chains
OPTICAL_TO_CAMERA = np.diag((1.0, -1.0, -1.0))
"""Rotation from an optical frame (y down, looks along z) to a MuJoCo camera's frame (y up, looks along -z)."""


class Scene(NamedTuple):
    """The frames in the coordinates of the model, with gravity, camera and ground.

    Attributes
    ----------
    frames
        the detections; the model is made from the first.
    gravity
        (3,) m/s².
    pose
        (4, 4) m, pose of the results' coordinates in the model's; None if they are equal.
    camera
        (4, 4) m, pose of the capture's camera (its optical frame) in the model; None if it is unknown.
    ground
        a point on the ground and its normal, (3,) each; None without ground.
    """

    frames: list[Detection]
    gravity: Floats
    pose: Floats | None
    camera: Floats | None
    ground: tuple[Floats, Floats] | None


def scene_of(
    frames: Sequence[Detection], gravity: Floats, radius_of: Callable[[Chain], float], upright: bool, has_ground: bool
) -> Scene:
    """Transform frames so that gravity points along -z and the ground is at z = 0.

    World coordinates, and frames without gravity, are not changed.

    Parameters
    ----------
    frames
        the detections, in the same coordinates; the ground is the plane of the first, under the chains of all.
    gravity
        (3,) m/s², in their coordinates.
    radius_of
        radius of a chain, m.
    upright
        False keeps the coordinates of the results.
    has_ground
        whether the model has a ground.

    Raises
    ------
    InputError : a ground is wanted, but gravity is 0.
    """
    is_turned = upright and gravity.any() and frames[0].coordinates != "world"
    ground = None
    if has_ground or is_turned:
        tubes = [(chain, radius_of(chain)) for frame in frames for chain in frame.chains]
        ground = ground_of(frames[0], gravity, tubes)
    if ground is None or not is_turned:
        return Scene(list(frames), gravity, None, frames[0].pose, ground)
    pose, (at, up) = upright_pose(gravity, ground[0]), ground
    is_camera = frames[0].coordinates == "camera"
    turned = [frame.transformed(pose) for frame in frames]
    ground = (pose[:3, :3] @ at + pose[:3, 3], pose[:3, :3] @ up)
    down = np.array((0.0, 0.0, -np.linalg.norm(gravity)))
    return Scene(turned, down, pose, turned[0].pose if is_camera else None, ground if has_ground else None)


def surroundings(pose: Floats | None) -> Iterator[str]:
    """Yield the XML elements before the bodies: light and appearance, and `pose`, if given, as the numeric "pose"."""
    yield "<visual>"
    yield tag("headlight", ambient=(0.35, 0.35, 0.35), diffuse=(0.4, 0.4, 0.4), specular=(0.1, 0.1, 0.1))
    yield tag("rgba", haze=(*HORIZON, 1.0))
    yield tag("map", znear=0.005)
    yield tag("quality", shadowsize=4096)
    yield "</visual>"
    if pose is not None:
        yield f"<custom>{tag('numeric', name='pose', data=pose)}</custom>"
    yield "<asset>"
    yield tag("texture", type="skybox", builtin="gradient", rgb1=HORIZON, rgb2=SKY, width=128, height=768)
    yield tag("texture", name="tiles", type="2d", builtin="checker", rgb1=TILES[0], rgb2=TILES[1], width=256, height=256)
    yield tag("material", name="tiles", texture="tiles", texuniform="true", texrepeat=(TILES_PER_METRE, TILES_PER_METRE))
    yield "</asset>"


def around_bodies(scene: Scene) -> Iterator[str]:
    """Yield the XML elements of the light above the chains and, if known, the camera "capture" and the ground."""
    magnitude, chains = float(np.linalg.norm(scene.gravity)), scene.frames[0].chains
    down = scene.gravity / magnitude if magnitude else np.array((0.0, 0.0, -1.0))
    center = np.mean([chain.joints.mean(axis=0) for chain in chains], axis=0) if chains else np.zeros(3)
    light = {"pos": center - LIGHT_HEIGHT * down, "dir": down, "diffuse": (0.4, 0.4, 0.4), "specular": (0.1, 0.1, 0.1)}
    yield tag("light", name="above", directional="true", **light)
    if scene.camera is not None:
        quaternion = Rotation.from_matrix(scene.camera[:3, :3] @ OPTICAL_TO_CAMERA).as_quat()
        yield tag("camera", name="capture", pos=scene.camera[:3, 3], quat=np.roll(quaternion, 1))
    if scene.ground is not None:
        place = {"pos": scene.ground[0], "zaxis": scene.ground[1], "size": (0, 0, 1)}
        yield tag("geom", name="ground", type="plane", material="tiles", **place, contype=3, conaffinity=3)

"""Estimate the direction of gravity, and the ground under the chains."""

import warnings
from collections.abc import Sequence

import numpy as np

from ..errors import DooWarning, InputError
from ..types import Chain, Detection, Floats, Plane
from .base import is_z_up

GRAVITY = 9.81  # m/s^2
MAX_COSINE_OF_RIGHT = 0.9  # between the x axis and the upward direction: above that, y is turned to the right in place of x
MAX_LYING_HEIGHT_RADII, MAX_LYING_HEIGHT_M = 5.0, 0.1  # of the lowest joint of a chain on or over a table, the larger counts
MAX_TILT_DEG = 20.0  # of a table against the z axis of a world: beyond that, the pose or the plane is wrong


def gravity_of(detection: Detection) -> Floats:
    """Return the gravity in the coordinates of a detection, (3,) m/s².

    Gravity is along -z in a world or robot's base frame; otherwise opposite to the normal of the plane that the object lies on.
    Without such a plane, as for an object that hangs in front of a wall, it is +y in a camera's coordinates and -z in a cloud's,
    with a warning.
    """
    if detection.coordinates == "world":
        return np.array((0.0, 0.0, -GRAVITY))
    if detection.plane is not None and (not detection.chains or _lies_on(detection.plane, detection)):
        return -GRAVITY * detection.plane.normal
    down, direction = ("-z", (0.0, 0.0, -GRAVITY)) if is_z_up(detection) else ("+y, as of a level camera,", (0.0, GRAVITY, 0.0))
    if not detection.chains:
        return np.array(direction)
    cause = "neither a plane under the object nor the pose of the camera is known"
    if detection.plane is not None:
        cause = "the object does not lie on the plane behind it, which may be a wall, and the pose of the camera is not known"
    warnings.warn(
        f"frame {detection.frame}: {cause}, so {down} is taken for down: give --pose, or --set gravity=[x,y,z]",
        DooWarning,
        stacklevel=2,
    )
    return np.array(direction)


def ground_of(detection: Detection, gravity: Floats, chains: Sequence[tuple[Chain, float]]) -> tuple[Floats, Floats]:
    """Return a point of the ground under the chains, (3,) m, and the ground's unit normal, (3,).

    The ground is the plane around the object, if it is known and level to within 20 degrees; it is lowered if a chain would
    penetrate it. Otherwise the ground is perpendicular to gravity, just below the lowest chain.

    Parameters
    ----------
    detection
        the detection with its plane.
    gravity
        (3,) m/s², not 0.
    chains
        chains and the radius of each, m.

    Raises
    ------
    InputError : gravity is 0.
    """
    magnitude = float(np.linalg.norm(gravity))
    if magnitude == 0:
        raise InputError("ground=true needs a gravity other than 0 0 0", code="options-conflict")
    up = -gravity / magnitude
    plane = _level_plane(detection, up)
    normal = up if plane is None else plane.normal
    lowest = [float((chain.joints @ normal).min()) - radius for chain, radius in chains]
    if plane is not None:
        lowest.append(plane.height)
    center = np.mean([chain.joints.mean(axis=0) for chain, _ in chains], axis=0) if chains else np.zeros(3)
    return center + (min(lowest, default=0.0) - center @ normal) * normal, normal


def upright_pose(gravity: Floats, ground: Floats) -> Floats:
    """Return the (4, 4) pose that turns gravity to -z and puts the ground at z = 0.

    The x axis keeps its direction as closely as possible, so that right in a view stays right. The origin moves along gravity
    only.

    Parameters
    ----------
    gravity
        (3,) m/s², not 0.
    ground
        (3,) m, a point on the ground.
    """
    up = -gravity / np.linalg.norm(gravity)
    right = np.eye(3)[0 if abs(up[0]) < MAX_COSINE_OF_RIGHT else 1]
    right = right - (right @ up) * up
    right = right / np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = (right, np.cross(up, right), up)
    pose[2, 3] = -up @ ground
    return pose


def _level_plane(detection: Detection, up: Floats) -> Plane | None:
    """Return the plane of a detection if it is level; otherwise None, with a warning."""
    if detection.plane is None:
        return None
    tilt = float(np.degrees(np.arccos(np.clip(detection.plane.normal @ up, -1, 1))))
    if tilt <= MAX_TILT_DEG:
        return detection.plane
    if not _lies_on(detection.plane, detection):  # a wall
        return None
    warnings.warn(
        f"frame {detection.frame}: the plane found around the object is tilted by {tilt:.0f} degrees against gravity, so the "
        "ground is level and under the lowest chain: check the pose",
        DooWarning,
        stacklevel=2,
    )
    return None


def _lies_on(plane: Plane, detection: Detection) -> bool:
    """Return whether a chain of a detection touches the plane."""
    return any(
        float((chain.joints @ plane.normal).min()) - plane.height
        <= max(MAX_LYING_HEIGHT_RADII * chain.radius, MAX_LYING_HEIGHT_M)
        for chain in detection.chains
    )

"""Chains by formula, as a capture of three frames: two chains, none, one chain that has moved."""

from __future__ import annotations

import numpy as np

import doo3d
from doo3d.kernels import lay_equal_chords
from doo3d.types import View

LENGTH, RADIUS, START = 0.01, 0.004, 1_700_000_000.123456
CAMERA = doo3d.Camera(600.0, 600.0, 319.5, 239.5, 640, 480)
VIEW = View.of(np.ones((480, 640), dtype=bool), (480, 640), CAMERA)


def helix(count: int = 25, shift: float = 0.0, **values) -> doo3d.Chain:
    """Return a helix of `count` segments of which every fifth is occluded, and the depth of two of five was filled in."""
    turn = np.arange(count) * LENGTH / 0.05
    along = np.column_stack((np.cos(turn), np.sin(turn), np.full(count, 0.5))) / np.sqrt(1.25)
    joints = np.concatenate((np.zeros((1, 3)), np.cumsum(along * LENGTH, axis=0))) + np.array((0.1, shift, 0.7))
    radii = RADIUS + 1e-4 * np.sin(np.arange(count + 1))
    deviations = 1e-4 * np.column_stack((2 + np.sin(np.arange(count + 1)), np.arange(count + 1)))
    filled = np.arange(count) % 5 > 2
    values = {"occluded": np.arange(count) % 5 == 3, "depth_filled": filled, "deviations": deviations} | values
    return doo3d.Chain(joints, LENGTH, RADIUS, radii=radii, **values)


def ring(count: int = 40) -> doo3d.Chain:
    """Return a closed chain, a regular polygon."""
    turn = 2 * np.pi * np.arange(count + 1) / count
    size = LENGTH / 2 / np.sin(np.pi / count)
    joints = np.column_stack((size * np.cos(turn), size * np.sin(turn), np.full(count + 1, 0.5)))
    joints[-1] = joints[0]
    return doo3d.Chain(joints, LENGTH, RADIUS, closed=True)


def along(line: np.ndarray, length: float = LENGTH, radius: float = RADIUS) -> doo3d.Chain:
    """Return a chain of equal segments along a line (P, 3)."""
    return doo3d.Chain(lay_equal_chords(np.ascontiguousarray(line), length)[0], length, radius)


def straight(axis: int, sign: float, count: int = 3) -> doo3d.Chain:
    """Return a straight chain along a coordinate axis, in the direction of the sign."""
    joints = np.zeros((count + 1, 3))
    joints[:, axis] = sign * LENGTH * np.arange(count + 1)
    return doo3d.Chain(joints, LENGTH, RADIUS)


def capture(coordinates: str = "camera") -> list[doo3d.Detection]:
    """Return three frames with timestamps."""
    chains = [(helix(id=0), helix(12, 0.2, id=3)), (), (helix(shift=0.01, id=0),)]
    return [
        doo3d.Detection(frame_chains, coordinates=coordinates, frame=f"{i:06d}", timestamp=START + i / 30, view=VIEW)
        for i, frame_chains in enumerate(chains)
    ]


def flat() -> doo3d.Detection:
    """Return a 2-D result, px."""
    joints = np.column_stack((np.arange(5) * 10.0, np.full(5, 7.25)))
    view = View.of(np.ones((20, 60), dtype=bool), (20, 60))
    return doo3d.Detection((doo3d.Chain(joints, 10.0, 3.0, id=0),), mode="2d", coordinates="image", frame="photo", view=view)

"""Poses of another convention are named from what the views show, and right ones are not doubted."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from builders.errors import refuses
from scipy.spatial.transform import Rotation

from doo3d.fusion.pose_agreement import check_views_agree
from doo3d.types import Camera, CameraView, Floats

CAMERA = Camera(fx=150.0, fy=150.0, cx=79.5, cy=59.5, width=160, height=120)
OPENGL = np.diag((1.0, -1.0, -1.0, 1.0))


def view(turn: float, tilt: float, noise: float = 0.0) -> CameraView:
    """A camera that looks down on a table with a box, from 0.8 m above it."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("zx", (turn, 180 + tilt), degrees=True).as_matrix()
    pose[:3, 3] = -0.8 * pose[:3, 2] + (0.05, 0.02, 0)
    v, u = np.mgrid[0:120, 0:160]
    rays = CAMERA.unproject(np.column_stack((u.ravel(), v.ravel())), np.ones(u.size)) @ pose[:3, :3].T
    depth = -pose[2, 3] / rays[:, 2]
    top = (0.1 - pose[2, 3]) / rays[:, 2]
    on_box = (np.abs(pose[:3, 3] + top[:, None] * rays)[:, :2] < 0.1).all(axis=1)
    depth = np.where(on_box, top, depth) + np.random.default_rng(0).normal(0, noise, u.size)
    image = depth.reshape(120, 160).astype(np.float32)
    return CameraView(CAMERA, pose, image > 0, image)


VIEWS = [view(turn, tilt, 0.002) for turn, tilt in ((0, 20), (40, 25), (80, 15), (120, 25), (160, 20))]


def changed(change: Callable[[Floats], Floats]) -> list[CameraView]:
    return [CameraView(each.camera, change(each.pose), each.mask, each.depth) for each in VIEWS]


def test_right_poses_are_not_doubted():
    check_views_agree(VIEWS)
    drifted = [
        CameraView(each.camera, each.pose + 0.01 * k * np.eye(4, k=3), each.mask, each.depth) for k, each in enumerate(VIEWS)
    ]
    check_views_agree(drifted)


def test_views_that_do_not_overlap_are_not_doubted():
    far = np.eye(4)
    far[0, 3] = 50.0
    check_views_agree([VIEWS[0], CameraView(CAMERA, far @ VIEWS[1].pose, VIEWS[1].mask, VIEWS[1].depth)])
    check_views_agree(VIEWS[:1])
    check_views_agree([])


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (np.linalg.inv, "invert them"),
        (lambda pose: pose @ OPENGL, "diag(1, -1, -1, 1)"),
        (lambda pose: OPENGL @ np.linalg.inv(pose), "view matrices"),
    ],
)
def test_the_convention_that_agrees_is_named(change, named):
    with refuses("poses-contradict", named):
        check_views_agree(changed(change))


def test_poses_by_which_nothing_agrees():
    order = [VIEWS[k] for k in (2, 4, 1, 0, 3)]
    shuffled = [CameraView(CAMERA, a.pose @ Rot, b.mask, b.depth) for a, b in zip(order, VIEWS, strict=True)]
    with refuses("poses-contradict", "check the poses and their order"):
        check_views_agree(shuffled)


Rot = np.eye(4)
Rot[:3, :3] = Rotation.from_euler("x", 50, degrees=True).as_matrix()

"""The motion of a camera from the background of its frames, before a scene that is known exactly."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import doo3d
from doo3d.camera.background import VIEW_PIXELS, BackgroundView, background_view
from doo3d.camera.camera_motion import MOTION_NOTE, UNTRUSTED_NOTE, CameraMotion, estimate_motion

HEIGHT, WIDTH, FOCAL = 72, 96, 90.0
FAR, NEAR = 0.7, 0.62
INTRINSICS = np.array([FOCAL, FOCAL, (WIDTH - 1) / 2, (HEIGHT - 1) / 2])
MIDDLE = np.array([0.0, 0.0, FAR, 1.0])
MAX_GAP = 5


def pose(angle, x):
    """A camera turned about the middle of the table, and moved aside."""
    result = np.eye(4)
    result[:3, :3] = Rotation.from_rotvec((0.4 * angle, angle, 0.3 * angle)).as_matrix()
    result[:3, 3] = MIDDLE[:3] - result[:3, :3] @ MIDDLE[:3] + (x, -0.5 * x, 0.2 * x)
    return result


def path(frames=24):
    return [pose(0.25 * np.sin(0.15 * k), 0.04 * np.sin(0.1 * k)) for k in range(frames)]


def view(at, seed=0, contrast=40.0):
    """What a camera shows of a table with a printed cloth and a block on it, with noise."""
    rng = np.random.default_rng([seed, 7])
    v, u = np.mgrid[:HEIGHT, :WIDTH].reshape(2, -1)
    rays = np.column_stack(((u - INTRINSICS[2]) / FOCAL, (v - INTRINSICS[3]) / FOCAL, np.ones(len(u))))
    turned, center = rays @ at[:3, :3].T, at[:3, 3]
    scale = (FAR - center[2]) / turned[:, 2]
    nearer = (NEAR - center[2]) / turned[:, 2]
    hit = center + nearer[:, None] * turned
    on_block = (np.abs(hit[:, 0] - 0.1) < 0.08) & (np.abs(hit[:, 1] + 0.05) < 0.06)
    scale = np.where(on_block, nearer, scale)
    points = center + scale[:, None] * turned
    waves = sum(np.sin(points[:, :2] @ each + phase) for phase, each in enumerate(((45, 15), (-20, 55), (12, -30), (70, 30))))
    gray = 120 + contrast * waves / 2 - 30 * on_block * (contrast > 0) + rng.normal(0, 0.6, len(u))
    inverse = 1 / scale + rng.normal(0, 0.004, len(u))
    return BackgroundView(
        np.clip(gray, 1, 255).reshape(HEIGHT, WIDTH).astype(np.uint8),
        inverse.reshape(HEIGHT, WIDTH).astype(np.float16),
        INTRINSICS,
    )


def estimated(views):
    return estimate_motion(lambda k: views[k], len(views), MAX_GAP)


def errors(found, true):
    """How far each pose puts the middle of the table off, m."""
    start = np.linalg.inv(true[0])
    return np.array([np.linalg.norm(((a - start @ b) @ MIDDLE)[:3]) for a, b in zip(found, true, strict=True)])


def test_a_camera_that_moves_is_followed():
    true = path()
    motion = estimated([view(each, k) for k, each in enumerate(true)])
    assert motion.notes == (MOTION_NOTE,)
    assert errors(motion.poses, true).max() < 0.001


def test_few_pixels_of_one_color_do_not_tell_that_a_camera_moves():
    """A stereo camera before a plain wall has depth at its edge alone: any motion along that agrees exactly."""
    gray = np.full((HEIGHT, WIDTH), 60, dtype=np.uint8)
    views = []
    for k in range(6):
        inverse = np.zeros((HEIGHT, WIDTH), dtype=np.float16)
        inverse[-3:, : WIDTH - 3 * k] = 1 / (FAR + 0.02 * k)
        views.append(BackgroundView(gray, inverse, INTRINSICS))
    assert estimated(views) == CameraMotion()


def test_a_camera_that_leaves_its_first_view_is_followed_over_key_views():
    true = [pose(0.02 * k, 0.02 * k) for k in range(30)]
    motion = estimated([view(each, k) for k, each in enumerate(true)])
    assert motion.notes == (MOTION_NOTE,)
    assert errors(motion.poses, true).max() < 0.004


def test_a_camera_that_stands_still_has_no_motion_however_the_light_changes():
    rng = np.random.default_rng(1)

    def dimmed(k):
        still = view(np.eye(4), k)
        gray = np.clip(rng.uniform(0.7, 1.0) * still.gray.astype(float), 1, 255).astype(np.uint8)
        gray[10:50, 5 * k % 60 : 5 * k % 60 + 25] = 60  # a hand that passes
        inverse = still.inverse.copy()
        inverse[10:50, 5 * k % 60 : 5 * k % 60 + 25] = 2.5
        return BackgroundView(gray, inverse, INTRINSICS)

    motion = estimated([dimmed(k) for k in range(24)])
    assert motion.poses is None
    assert motion.notes == ()


@pytest.mark.parametrize("contrast", [0.0, 40.0])
def test_frames_without_anything_in_common_and_without_any_are_no_motion(contrast):
    rng = np.random.default_rng(2)
    flat = BackgroundView(np.full((HEIGHT, WIDTH), 90, np.uint8), np.full((HEIGHT, WIDTH), 1.5, np.float16), INTRINSICS)
    noise = [BackgroundView(rng.integers(1, 255, flat.gray.shape, np.uint8), flat.inverse, INTRINSICS) for _ in range(9)]
    for views in ([], [None] * 9, [flat] * 9, noise):
        assert estimated(views).poses is None
        assert estimated(views).notes == ()


def test_a_table_of_one_color_does_not_tell_how_the_camera_moves_along_it():
    motion = estimated([view(each, k, contrast=0.0) for k, each in enumerate(path())])
    assert motion.poses is None
    assert motion.notes == (UNTRUSTED_NOTE,)


@pytest.mark.parametrize(("lost", "note"), [(range(9, 13), MOTION_NOTE), (range(9, 16), UNTRUSTED_NOTE)])
def test_a_short_loss_is_interpolated_and_a_long_one_is_no_motion(lost, note):
    true = path()
    motion = estimated([None if k in lost else view(each, k) for k, each in enumerate(true)])
    assert motion.notes == (note,)
    if note == MOTION_NOTE:
        assert errors(motion.poses, true).max() < 0.005
    else:
        assert motion.poses is None


def test_frames_without_depth_are_aligned_by_their_brightness():
    true = path()
    views = [view(each, k) for k, each in enumerate(true)]
    for k in (5, 6, 7, 14):
        views[k] = BackgroundView(views[k].gray, np.zeros_like(views[k].inverse), INTRINSICS)
    assert errors(estimated(views).poses, true).max() < 0.001


def test_frames_of_another_size_are_lost():
    small = view(np.eye(4))
    small = BackgroundView(small.gray[:-2], small.inverse[:-2], INTRINSICS)
    assert estimated([view(np.eye(4))] + [small] * 9).poses is None


def test_a_view_leaves_the_object_out_and_is_read_back_as_it_was():
    camera = doo3d.Camera(600.0, 600.0, 319.5, 239.5, 640, 480)
    color, depth = np.full((480, 640, 3), 100, np.uint8), np.full((480, 640), 0.5, np.float32)
    depth[:, :70] = np.nan
    mask = np.zeros((480, 640), bool)
    mask[240, 300:400] = True
    small = background_view(doo3d.Frame(color=color, depth=depth, camera=camera), mask)
    assert max(small.gray.shape) <= VIEW_PIXELS
    row, columns = 240 // 7, slice(300 // 7, 400 // 7)
    assert not small.gray[row - 1 : row + 2, columns].any()
    assert (small.gray[row + 2 :] == 100).all()
    assert not small.inverse[:, :10].any()
    assert np.allclose(small.inverse[:, 10:], 2.0)
    u = (350 - camera.cx) / camera.fx
    assert (350 / 7 - 0.5 + 0.5 / 7 - small.intrinsics[2]) / small.intrinsics[0] == pytest.approx(u, abs=1e-9)
    back = BackgroundView.from_dict(json.loads(json.dumps(small.to_dict())))
    for name in ("gray", "inverse", "intrinsics"):
        np.testing.assert_array_equal(getattr(back, name), getattr(small, name))
    without = background_view(doo3d.Frame(color=None, depth=depth, camera=camera), None)
    assert (without.gray == without.gray[0, 0]).all()

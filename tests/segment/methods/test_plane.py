"""What stands off the dominant plane."""

from __future__ import annotations

import numpy as np
import pytest
from builders.drawn_masks import CAMERA, depth_of, line, surface, wave

from doo3d.config import SegmentConfig
from doo3d.segment.methods.plane import fit_plane, height_above_plane, mask, plane_noise
from doo3d.types import Cloud, Frame

CONFIG = SegmentConfig(method="plane")
RADIUS = 0.006


def unit(vector):
    return np.array(vector) / np.linalg.norm(vector)


@pytest.mark.parametrize("normal", [[0, 0, 1], [0.2, -0.5, 1], [1, 0, 0.1], [0, 1, 0]])
@pytest.mark.parametrize("noise", [0.0, 0.001])
def test_a_plane_among_other_points(normal, noise):
    random = np.random.default_rng(0)
    normal = unit(normal)
    points = random.uniform(-0.5, 0.5, (6000, 3))
    points -= np.outer(points @ normal - 0.7 - noise * random.normal(size=6000), normal)
    points[:2000] += normal * random.uniform(0.02, 0.4, (2000, 1))
    found, offset = fit_plane(points, 0.003, 0)
    spread = plane_noise(np.abs(points @ found - offset), 0.003)
    assert abs(found @ normal) > 1 - 1e-5
    assert offset * np.sign(found @ normal) == pytest.approx(0.7, abs=0.001)
    assert spread <= 1.5 * noise + 1e-6
    again = fit_plane(points, 0.003, 0)
    np.testing.assert_array_equal(again[0], found)
    assert again[1] == offset


def table(tilt=0.0, noise=0.0, radius=RADIUS):
    """A frame of a cable on a table 0.6 m away, leaning by `tilt` radians, and which pixels are the cable."""
    v, u = np.mgrid[0 : CAMERA.height, 0 : CAMERA.width]
    normal = np.array([0.0, np.sin(tilt), np.cos(tilt)])
    rays = np.stack(((u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, np.ones(u.shape)), axis=-1)
    flat = 0.6 * normal[2] / (rays @ normal)
    axis = wave(0.25, 0.6)
    axis[:, 2] = (0.6 * normal[2] - axis[:, 1] * normal[1]) / normal[2]
    axis -= radius * normal
    depth, which = depth_of([axis], [radius])
    depth = np.where((depth > 0) & (depth < flat), depth, flat)
    depth += noise * np.random.default_rng(1).normal(size=depth.shape)
    return Frame(None, depth.astype(np.float32), CAMERA), (which >= 0)


@pytest.mark.parametrize("tilt", [0.0, 0.5, -0.8])
@pytest.mark.parametrize("noise", [0.0, 0.0007])
def test_a_cable_on_a_table(tilt, noise):
    frame, truth = table(tilt, noise)
    found = mask(frame, CONFIG, 0).mask
    assert found.shape == truth.shape
    assert (found & truth).sum() > 0.85 * truth.sum()
    assert (found & ~truth).sum() < 0.02 * truth.sum()


def test_a_plane_has_one_side_towards_the_sensor():
    """Whichever way its normal points: for a cloud with a viewpoint, and for one without."""
    frame, _ = table(0.4)
    normal = unit([0.0, np.sin(0.4), np.cos(0.4)])
    offset = 0.6 * np.cos(0.4)
    v, u = np.nonzero(frame.depth)
    points = CAMERA.unproject(np.column_stack((u, v)), frame.depth[v, u])
    above = offset - points @ normal
    assert above.max() == pytest.approx(2 * RADIUS, abs=0.0005)
    assert above.min() > -1e-5
    for viewpoint in (np.zeros(3), None):
        cloud = Cloud(points, viewpoint=viewpoint)
        for sign in (1, -1):
            np.testing.assert_allclose(height_above_plane(cloud, sign * normal, sign * offset), above, atol=1e-5)


def test_pixels_behind_the_plane_are_not_the_object():
    frame, _ = table()
    depth = frame.depth.copy()
    depth[20:60, 20:60] += 0.1
    assert not mask(Frame(None, depth, CAMERA), CONFIG, 0).mask[20:60, 20:60].any()


@pytest.mark.parametrize("viewpoint", [np.zeros(3), None])
@pytest.mark.parametrize("below", [False, True])
def test_a_cloud(viewpoint, below):
    """Without a viewpoint the side that holds more of the points is in front; with one the viewpoint decides."""
    random = np.random.default_rng(2)
    sign = 1 if below else -1
    floor = np.column_stack((random.uniform(-0.3, 0.3, (20000, 2)), 0.8 + 0.0004 * random.normal(size=20000)))
    cable = surface(line([-0.2, -0.1, 0.8 + sign * 0.02], [0.2, 0.12, 0.8 + sign * 0.02]), RADIUS)
    found = mask(Cloud(np.concatenate((floor, cable)), viewpoint=viewpoint), CONFIG, 0).mask
    wanted = viewpoint is None or not below
    assert found[20000:].mean() > 0.9 if wanted else not found[20000:].any()
    assert found[:20000].mean() < 0.005


@pytest.mark.parametrize("points", [np.zeros((2, 3)), np.ones((50, 3)), np.linspace([0, 0, 1], [1, 0, 1], 50)])
def test_no_plane_to_be_found(points):
    found = mask(Cloud(points), CONFIG, 0).mask
    assert found.shape == (len(points),)
    assert not found.any()


def test_no_depth():
    assert not mask(Frame(None, np.zeros((480, 640), np.float32), CAMERA), CONFIG, 0).mask.any()

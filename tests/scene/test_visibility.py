"""What the camera says about a path, and about an end."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.scene.depth_model import DepthModel
from doo3d.scene.visibility import Visibility
from doo3d.types import Camera

CAMERA = Camera(fx=100.0, fy=120.0, cx=20.0, cy=15.0, width=40, height=30)
MASK = np.zeros((30, 40), dtype=bool)


def place(pixel, z=0.5):
    return CAMERA.unproject(np.array([pixel]), np.array([z]))


def test_an_end_is_open_where_the_camera_sees_past_it_and_not_where_something_hides_what_follows():
    """A strand of 10 mm radius ends at u = 20: beyond it the table, 0.3 m farther; or a block, 0.1 m nearer; or more of it."""
    mask = np.zeros((30, 40), dtype=bool)
    mask[12:18, :21] = True
    ends, along = place((19, 15), 0.5), np.array([[1.0, 0.0, 0.0]])
    for beyond, expected in ((0.8, True), (0.4, False), (0.5, False), (0.0, False)):
        depth = np.where(mask, 0.5, beyond)
        assert Visibility(DepthModel(depth, mask, CAMERA, 0.012)).is_exposed(ends, along, 0.01, 0.03).tolist() == [expected]
    assert Visibility(DepthModel(None, mask, None, 0.012)).is_exposed(ends[:, :2], along[:, :2], 1.0, 3.0).tolist() == [False]


def lengths(depth, mask, *paths):
    return Visibility(DepthModel(depth, mask, CAMERA, 0.02)).gap_lengths(paths)


def test_tips_are_as_sure_as_the_depth_beyond_them():
    """A strand of 10 mm radius ends at u = 20, 0.5 m away; beyond it the table, a block, more of the strand, or no reading."""
    mask = np.zeros((30, 40), dtype=bool)
    mask[12:18, :21] = True
    ends, along = place((19, 15), 0.5), np.array([[1.0, 0.0, 0.0]])
    rng = np.random.default_rng(0)

    def tip(beyond, noise=0.001, mask=mask):
        depth = np.where(mask, rng.normal(0.5, noise, mask.shape), beyond).astype(np.float32)
        return float(Visibility(DepthModel(depth, mask, CAMERA, 0.012)).tips(ends, along, 0.01)[0])

    assert tip(0.8) > 0 > tip(0.4)
    assert tip(0.0) == 0
    assert tip(0.8, noise=0.002) == pytest.approx(tip(0.8) / 2, rel=0.2)
    longer = mask.copy()
    longer[12:18] = True
    assert tip(0.8, mask=longer) == -np.inf
    assert Visibility(DepthModel(None, mask, None, 0.012)).tips(ends[:, :2], along[:, :2], 1.0).tolist() == [-np.inf]


def test_free_length_is_that_part_of_the_path():
    """Along one row: 0.8 m is measured but for the pixels of the fixture and a patch in front."""
    depth = np.full((30, 40), 0.8, np.float32)
    depth[20, 20:] = 0.3
    path = np.linspace(place((5.0, 20))[0], place((34.0, 20))[0], 500)
    length = np.linalg.norm(path[-1] - path[0])
    assert lengths(depth, MASK, path)[0, 0] == pytest.approx(length * (19.5 - 5) / 29, rel=0.01)
    assert not lengths(depth, MASK, path[:1]).any()
    nothing = lengths(np.zeros_like(depth), MASK, path)
    assert nothing[0, 0] == 0
    assert nothing[0, 1] > 0.9 * length


def test_lengths_of_many_are_those_of_each():
    """Nothing is counted between the end of one path and the start of the next."""
    ways = [np.linspace(place((5.0, v))[0], place((u, 20.0))[0], count) for u, v, count in ((34, 20, 90), (10, 2, 1), (60, 9, 7))]
    depth = np.full((30, 40), 0.8, np.float32)
    depth[10:15] = 0
    together = lengths(depth, MASK, *ways, ways[0][:1])
    expected = [lengths(depth, MASK, way)[0] for way in ways]
    np.testing.assert_allclose(together, [*expected, (0, 0, 0)], atol=1e-15)
    assert (together[[0, 2], 0] > 0).all()
    assert together[2, 1] > 0
    assert not together[1].any()

"""What the camera of a frame says of a path, and of an end; an image says less, a cloud nothing."""

from __future__ import annotations

import numpy as np
import pytest
from builders.scenes import cloud_scene, frame_scene, image_scene

from doo3d.scene.point_visibility import PointVisibility
from doo3d.types import Camera, Frame

CAMERA = Camera(fx=100.0, fy=120.0, cx=20.0, cy=15.0, width=40, height=30)
MASK = np.zeros((30, 40), dtype=bool)
STRAND = MASK.copy()
STRAND[12:18, :21] = True


def scene_of(depth, mask=MASK, margin=0.012):
    """A frame in which a reading counts as farther or nearer from a margin on."""
    return frame_scene(Frame(None, depth.astype(np.float32), CAMERA), mask, radius=0.001, visibility__margin=margin)


def place(pixel, z=0.5):
    return CAMERA.unproject(np.array([pixel]), np.array([z]))


def test_an_end_is_open_where_the_camera_sees_past_it_and_not_where_something_hides_what_follows():
    """A strand of 10 mm radius ends at u = 20: beyond it the table, 0.3 m farther; or a block, 0.1 m nearer; or more of it."""
    ends, along = place((19, 15), 0.5), np.array([[1.0, 0.0, 0.0]])
    for beyond, expected in ((0.8, True), (0.4, False), (0.5, False), (0.0, False)):
        scene = scene_of(np.where(STRAND, 0.5, beyond), STRAND)
        assert scene.is_exposed(ends, along, 0.01, 0.03).tolist() == [expected]


def lengths(depth, *paths):
    return scene_of(depth, margin=0.02).gap_lengths(paths)


def test_tips_are_as_sure_as_the_depth_beyond_them():
    """A strand of 10 mm radius ends at u = 20, 0.5 m away; beyond it the table, a block, more of the strand, or no reading."""
    ends, along = place((19, 15), 0.5), np.array([[1.0, 0.0, 0.0]])
    rng = np.random.default_rng(0)

    def tip(beyond, noise=0.001, mask=STRAND):
        depth = np.where(mask, rng.normal(0.5, noise, mask.shape), beyond)
        return float(scene_of(depth, mask).tips(ends, along, 0.01)[0])

    assert tip(0.8) > 0 > tip(0.4)
    assert tip(0.0) == 0
    assert tip(0.8, noise=0.002) == pytest.approx(tip(0.8) / 2, rel=0.2)
    longer = STRAND.copy()
    longer[12:18] = True
    assert tip(0.8, mask=longer) == -np.inf


def test_without_depth_no_end_is_in_plain_view():
    for scene in (image_scene(STRAND), cloud_scene(place((19, 15)))):
        ends, along = np.zeros((1, scene.dim)), np.eye(scene.dim)[:1]
        assert scene.is_exposed(ends, along, 1.0, 3.0).tolist() == [False]
        assert scene.tips(ends, along, 1.0).tolist() == [-np.inf]


def test_in_an_image_the_mask_decides_and_a_cloud_says_nothing():
    at = np.array([(20.0, 15.0), (30.0, 3.0), (-5.0, 3.0)])
    assert image_scene(STRAND).classify(at).tolist() == [PointVisibility.SURFACE, PointVisibility.FREE, PointVisibility.OUTSIDE]
    assert cloud_scene(place((19, 15))).classify(np.zeros((2, 3))).tolist() == [PointVisibility.NO_DEPTH] * 2


def test_the_margin_grows_with_the_object():
    frame = Frame(None, np.ones((30, 40), np.float32), CAMERA)
    thin, thick = (frame_scene(frame, ~MASK, radius=radius) for radius in (0.001, 0.05))
    assert thin.model.margin >= thin.config.visibility.margin
    assert thick.model.margin >= 0.05


def test_free_length_is_that_part_of_the_path():
    """Along one row: 0.8 m is measured but for the pixels of the fixture and a patch in front."""
    depth = np.full((30, 40), 0.8, np.float32)
    depth[20, 20:] = 0.3
    path = np.linspace(place((5.0, 20))[0], place((34.0, 20))[0], 500)
    length = np.linalg.norm(path[-1] - path[0])
    assert lengths(depth, path)[0, 0] == pytest.approx(length * (19.5 - 5) / 29, rel=0.01)
    assert not lengths(depth, path[:1]).any()
    nothing = lengths(np.zeros_like(depth), path)
    assert nothing[0, 0] == 0
    assert nothing[0, 1] > 0.9 * length


def test_lengths_of_many_are_those_of_each():
    """Nothing is counted between the end of one path and the start of the next."""
    ways = [np.linspace(place((5.0, v))[0], place((u, 20.0))[0], count) for u, v, count in ((34, 20, 90), (10, 2, 1), (60, 9, 7))]
    depth = np.full((30, 40), 0.8, np.float32)
    depth[10:15] = 0
    together = lengths(depth, *ways, ways[0][:1])
    expected = [lengths(depth, way)[0] for way in ways]
    np.testing.assert_allclose(together, [*expected, (0, 0, 0)], atol=1e-15)
    assert (together[[0, 2], 0] > 0).all()
    assert together[2, 1] > 0
    assert not together[1].any()

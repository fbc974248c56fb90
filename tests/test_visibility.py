"""What the depth image says about a place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from doo3d.config import VisibilityConfig
from doo3d.types import Camera, Foreground
from doo3d.visibility import PointVisibility, Visibility

CAMERA = Camera(fx=100.0, fy=120.0, cx=20.0, cy=15.0, width=40, height=30)
PIXELS = {
    PointVisibility.FREE: (5, 5),
    PointVisibility.NO_DEPTH: (10, 5),
    PointVisibility.MASKED: (15, 5),
    PointVisibility.SURFACE: (20, 5),
    PointVisibility.HIDDEN: (25, 5),
}


@pytest.fixture
def visibility():
    """Depth 0.8 m; at five pixels one of each case for a place 0.5 m away, to be told apart at 20 mm."""
    depth, mask = np.full((30, 40), 0.8, np.float32), np.zeros((30, 40), bool)
    for seen, (u, v) in PIXELS.items():
        depth[v, u] = {
            PointVisibility.NO_DEPTH: 0,
            PointVisibility.MASKED: 0,
            PointVisibility.SURFACE: 0.495,
            PointVisibility.HIDDEN: 0.3,
        }.get(seen, 0.8)
        mask[v, u] = seen in (PointVisibility.MASKED, PointVisibility.SURFACE)
    return Visibility(depth, mask, CAMERA, 0.02)


def place(pixel, z=0.5):
    return CAMERA.unproject(np.array([pixel]), np.array([z]))


@pytest.mark.parametrize("seen", PIXELS)
def test_each_case(visibility, seen):
    assert visibility.classify(place(PIXELS[seen])).tolist() == [seen]


def test_all_at_once(visibility):
    points = np.concatenate([place(pixel) for pixel in PIXELS.values()])
    assert visibility.classify(points).tolist() == list(PIXELS)
    assert visibility.classify(np.zeros((0, 3))).shape == (0,)


@pytest.mark.parametrize(
    "point",
    [place((-0.6, 10))[0], place((39.6, 10))[0], place((10, -0.6))[0], place((10, 29.6))[0], [0, 0, -0.5], [0, 0, 0]],
)
def test_outside_the_image_or_behind_the_camera(visibility, point):
    assert visibility.classify(np.array([point], dtype=float)).tolist() == [PointVisibility.OUTSIDE]


@pytest.mark.parametrize("pixel", [(-0.4, -0.4), (39.4, 29.4)])
def test_the_corners_are_inside(visibility, pixel):
    assert visibility.classify(place(pixel)).tolist() == [PointVisibility.FREE]


def test_the_object_behind_a_place_is_free_space_only_where_that_is_asked_for(visibility):
    """A strand that the camera sees beyond a place is not hidden by anything at that place."""
    assert visibility.classify(place(PIXELS[PointVisibility.SURFACE], 0.6)).tolist() == [PointVisibility.HIDDEN]
    assert visibility.classify(place(PIXELS[PointVisibility.SURFACE], 0.4)).tolist() != [PointVisibility.FREE]
    assert replace(visibility, own_object_counts_as_free=True).classify(place(PIXELS[PointVisibility.SURFACE], 0.4)).tolist() == [
        PointVisibility.FREE
    ]


def test_an_end_is_open_where_the_camera_sees_past_it_and_not_where_something_hides_what_follows():
    """A strand of 10 mm radius ends at u = 20: beyond it the table, 0.3 m farther; or a block, 0.1 m nearer; or more of it."""
    mask = np.zeros((30, 40), dtype=bool)
    mask[12:18, :21] = True
    ends, along = place((19, 15), 0.5), np.array([[1.0, 0.0, 0.0]])
    for beyond, expected in ((0.8, True), (0.4, False), (0.5, False), (0.0, False)):
        depth = np.where(mask, 0.5, beyond)
        assert Visibility(depth, mask, CAMERA, 0.012).is_exposed(ends, along, 0.01, 0.03).tolist() == [expected]
    assert Visibility(None, mask, None, 0.012).is_exposed(ends[:, :2], along[:, :2], 1.0, 3.0).tolist() == [False]


def test_within_the_margin_nothing_is_free(visibility):
    assert visibility.classify(place(PIXELS[PointVisibility.FREE], 0.785)).tolist() != [PointVisibility.FREE]
    assert visibility.classify(place(PIXELS[PointVisibility.FREE], 0.775)).tolist() == [PointVisibility.FREE]


def lengths(depth, mask, *paths):
    return Visibility(depth, mask, CAMERA, 0.02).gap_lengths(paths)


def test_free_length_is_that_part_of_the_path(visibility):
    """Along one row: 0.8 m is measured but for the pixels of the fixture and a patch in front."""
    depth = visibility.depth.copy()
    depth[20, 20:] = 0.3
    path = np.linspace(place((5.0, 20))[0], place((34.0, 20))[0], 500)
    length = np.linalg.norm(path[-1] - path[0])
    assert lengths(depth, visibility.mask, path)[0, 0] == pytest.approx(length * (19.5 - 5) / 29, rel=0.01)
    assert not lengths(depth, visibility.mask, path[:1]).any()
    nothing = lengths(np.zeros_like(depth), visibility.mask, path)
    assert nothing[0, 0] == 0
    assert nothing[0, 1] > 0.9 * length


def test_lengths_of_many_are_those_of_each(visibility):
    """Nothing is counted between the end of one path and the start of the next."""
    ways = [np.linspace(place((5.0, v))[0], place((u, 20.0))[0], count) for u, v, count in ((34, 20, 90), (10, 2, 1), (60, 9, 7))]
    depth = visibility.depth.copy()
    depth[10:15] = 0
    together = lengths(depth, visibility.mask, *ways, ways[0][:1])
    expected = [lengths(depth, visibility.mask, way)[0] for way in ways]
    np.testing.assert_allclose(together, [*expected, (0, 0, 0)], atol=1e-15)
    assert (together[[0, 2], 0] > 0).all()
    assert together[2, 1] > 0
    assert not together[1].any()


def test_a_cloud_says_nothing():
    assert Visibility.of(Foreground(np.zeros((3, 3))), VisibilityConfig(), 0.005) is None


def test_the_margin_grows_with_the_object():
    frame = Foreground(np.zeros((1, 3)), mask=np.ones((30, 40), bool), depth=np.ones((30, 40), np.float32), camera=CAMERA)
    thin, thick = (Visibility.of(frame, VisibilityConfig(), radius) for radius in (0.001, 0.05))
    assert thin.margin >= VisibilityConfig().margin
    assert thick.margin >= 0.05

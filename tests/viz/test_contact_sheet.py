"""The contact sheet."""

import numpy as np

from doo3d.types import Camera, Cloud, Frame, Image
from doo3d.viz.contact_sheet import WIDTH, Tile, depth_colors, draw_sheet, make_tile
from doo3d.viz.palette import CHAINS

CAMERA = Camera(600, 600, 640, 360, 1280, 720)


def frame(depth) -> Frame:
    color = np.full((720, 1280, 3), (200, 10, 60), np.uint8)
    return Frame(color, np.broadcast_to(np.float32(depth), (720, 1280)), CAMERA)


def test_near_is_red_far_is_blue_and_none_is_black():
    near, middle, far, none = depth_colors(np.array([[0.4, 0.7, 1.0, 0.0]], np.float32), 0.4, 1.0)[0].astype(int)
    assert near[0] > 2 * near[2]
    assert far[2] > 2 * far[0]
    assert middle[1] == max(middle)
    assert none.tolist() == [0, 0, 0]


def test_colors_of_the_depth_are_those_of_the_whole_sheet():
    """Two flat frames, near and far: each has one end of the scale, and not both the middle."""
    picture = draw_sheet("t", [make_tile("a", frame(0.5)), make_tile("b", frame(1.5))])
    left, right = (picture[150, x] for x in (600, 1400))
    assert left[0] > left[2]
    assert right[2] > right[0]
    assert picture[150, 100].tolist() == [200, 10, 60]


def test_a_depth_edge_is_not_smeared():
    depth = np.full((720, 1280), 0.5, np.float32)
    depth[:, 640:] = 2.0
    assert set(np.unique(make_tile("a", frame(depth)).depth)) == {np.float32(0.5), np.float32(2.0)}


def test_the_mask_is_outlined():
    mask = np.zeros((720, 1280), bool)
    mask[300:400, 300:800] = True
    plain, outlined = (make_tile("a", frame(0.5), m).pictures[0] for m in (None, mask))
    changed = (plain != outlined).any(axis=2)
    assert (outlined[changed] == CHAINS[2]).all()
    assert 200 < changed.sum() < 600
    assert not changed[105, 165]  # inside


def test_sizes_and_sorts_beside_each_other():
    wide = make_tile("wide", Image(np.zeros((480, 640, 3), np.uint8)))
    high = make_tile("high", Image(np.zeros((4000, 300, 3), np.uint8)))
    small = make_tile("small", Image(np.full((10, 12, 3), 255, np.uint8)))
    cloud = make_tile("cloud", Cloud(np.random.default_rng(0).uniform(0, 1, (500, 3))))
    assert small.pictures[0].shape == (10, 12, 3)  # nothing is made larger
    picture = draw_sheet(
        "Kabel über 電線", [wide, high, small, cloud, Tile("bad", error="why " * 300), make_tile("d", frame(0.0))]
    )
    assert picture.shape[1] == WIDTH
    assert picture.dtype == np.uint8


def test_clouds_are_seen_from_above():
    """A flat ring in the x-z plane shows as a ring, wherever the sensor stood."""
    angle = np.linspace(0, 2 * np.pi, 4000)
    points = np.column_stack((np.cos(angle), np.zeros(4000), np.sin(angle)))
    for viewpoint in (None, (5.0, 0.0, 0.0)):
        (seen,) = make_tile("a", Cloud(points, np.full((4000, 3), 255, np.uint8), viewpoint)).pictures
        rows, columns = np.nonzero(seen.min(axis=2) > 150)
        assert np.ptp(rows) > 0.9 * np.ptp(columns) > 100


def test_an_error_is_written():
    empty, told = (draw_sheet("t", [Tile("a", error=fault)]) for fault in (" ", "is cut off"))
    assert (told != empty).any()


def test_a_sheet_without_tiles():
    assert draw_sheet("none", []).shape[1] == WIDTH

"""What the end of a strand is: a tip in plain view, cut off, or unknown."""

import numpy as np
import pytest
from builders.scenes import cloud_scene, frame_scene

from doo3d.track.observations import _strands
from doo3d.track.strand_ends import CUT_OFF, TIP, UNKNOWN, _in_view
from doo3d.types import Camera, Chain, Frame

CAMERA = Camera(fx=600.0, fy=600.0, cx=80.0, cy=60.0, width=160, height=120)
RADIUS, DEPTH = 0.003, 0.7
AHEAD = np.column_stack((RADIUS * np.array([1.5, 2.0, 2.5, 3.0]), np.zeros(4), np.full(4, DEPTH)))
END_COLUMN = int(np.rint(CAMERA.project(AHEAD)[0, 0]))  # of the first of the places


BESIDE = np.array([[x, side * 6 * RADIUS, DEPTH] for x in (-0.01, 0.0) for side in (-1, 1)])


def scene_of(depth, mask):
    return frame_scene(Frame(None, depth.astype(np.float32), CAMERA), mask, radius=RADIUS)


def tip(depth, masked_up_to, ahead=AHEAD):
    """Return what the end is, with depth (H, W) or everywhere the same, and a mask up to and with a column."""
    mask = np.zeros((120, 160), dtype=bool)
    mask[55:66, : masked_up_to + 1] = True
    return _in_view(ahead, BESIDE, scene_of(np.broadcast_to(depth, mask.shape), mask), RADIUS)


@pytest.mark.parametrize("table", [DEPTH + RADIUS, DEPTH - 0.003, DEPTH + 0.2])
def test_an_end_before_the_table_is_a_tip_for_all_that_depth_is_noisy(table):
    assert tip(table, END_COLUMN - 1) == TIP


def test_the_surface_of_the_object_itself_hides_nothing():
    depth = np.full((120, 160), DEPTH + RADIUS)
    depth[:, : END_COLUMN + 1] = DEPTH - 0.006
    assert tip(depth, END_COLUMN) == TIP
    assert tip(depth, END_COLUMN - 1) == CUT_OFF  # something else, that near


def test_ends_at_a_hand_at_the_border_or_within_the_mask_are_cut_off():
    assert tip(DEPTH - 0.05, END_COLUMN - 1) == CUT_OFF
    assert tip(DEPTH + RADIUS, END_COLUMN + 20) == CUT_OFF
    assert tip(DEPTH + RADIUS, END_COLUMN - 1, AHEAD + np.array([0.12, 0.0, 0.0])) == CUT_OFF


@pytest.mark.parametrize(("hand", "expected"), [(DEPTH + 0.05, CUT_OFF), (1.39, TIP)])
def test_what_stands_out_before_the_background_may_hide_an_end_whose_depth_is_too_small(hand, expected):
    """A strand in the air ends at a hand, and is read 5 cm before that; or before a background whose depth is a little noisy."""
    depth = np.full((120, 160), 1.4)
    depth[:, END_COLUMN:] = hand
    assert tip(depth, END_COLUMN - 1) == expected


def test_a_steep_table_hides_nothing():
    u = np.arange(160) - CAMERA.cx
    slope = -1.0  # nearer by as much as farther along
    table = (DEPTH + RADIUS) / (1 - slope * u / CAMERA.fx) * np.ones((120, 1))
    ahead = AHEAD + np.array([0.0, 0.0, slope]) * AHEAD[:, :1]
    assert tip(table, END_COLUMN - 1, ahead) == TIP


def test_without_depth_around_nothing_is_known():
    assert tip(0.0, END_COLUMN - 1) == UNKNOWN


@pytest.mark.parametrize("has_camera", [False, True])
@pytest.mark.parametrize(("occluded", "length"), [(0, 0.2), (8, 0.12)])
def test_a_strand_ends_where_the_image_shows_its_tip_though_depth_is_lost_there(occluded, length, has_camera):
    """What a camera shows without depth has its place across the line of sight only."""
    joints = np.column_stack((0.01 * np.arange(21) - 0.1, np.zeros(21), np.full(21, DEPTH)))
    hidden, lost = np.zeros(20, dtype=bool), np.zeros(20, dtype=bool)
    hidden[:occluded] = lost[:8] = True
    chain = Chain(joints, 0.01, RADIUS, occluded=hidden, depth_filled=lost)
    frame = scene_of(np.full((120, 160), DEPTH), np.zeros((120, 160), dtype=bool))
    (strand,) = _strands(chain, 0, frame if has_camera else cloud_scene(joints, radius=RADIUS))
    assert strand.length == pytest.approx(length)
    assert strand.arcs[-1] == pytest.approx(length)
    if has_camera and not occluded:
        np.testing.assert_allclose(strand.points, joints)
        rays = joints / np.linalg.norm(joints, axis=1, keepdims=True)
        np.testing.assert_allclose(strand.sight, np.where(np.arange(21)[:, None] < 8, rays, 0.0))
    else:
        np.testing.assert_allclose(strand.points, joints[8:])
        assert not len(strand.sight)

"""What the end of a strand is: a tip in plain view, cut off, or unknown."""

from types import SimpleNamespace

import numpy as np
import pytest

from doo3d.sequence.observations import CUT_OFF, TIP, UNKNOWN, _tip_in_view
from doo3d.types import Camera

CAMERA = Camera(fx=600.0, fy=600.0, cx=80.0, cy=60.0, width=160, height=120)
RADIUS, DEPTH = 0.003, 0.7
AHEAD = np.column_stack((RADIUS * np.array([1.5, 2.0, 2.5, 3.0]), np.zeros(4), np.full(4, DEPTH)))
END_COLUMN = int(np.rint(CAMERA.project(AHEAD)[0, 0]))  # of the first of the places


def tip(depth, masked_up_to, ahead=AHEAD):
    """Return what the end is, with depth (H, W) or everywhere the same, and a mask up to and with a column."""
    mask = np.zeros((120, 160), dtype=bool)
    mask[55:66, : masked_up_to + 1] = True
    foreground = SimpleNamespace(camera=CAMERA, depth=np.broadcast_to(depth, mask.shape), mask=mask)
    return _tip_in_view(ahead, foreground, RADIUS)


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


def test_without_depth_around_nothing_is_known():
    assert tip(0.0, END_COLUMN - 1) == UNKNOWN

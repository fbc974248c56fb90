"""Strands that one frame joined wrongly are cut where the object is known to go on elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from doo3d.track.observations import ObservedStrand
from doo3d.track.strand_cutting import cut_misjoined
from doo3d.track.strand_ends import CUT_OFF, TIP

SEGMENT = 0.01


@pytest.fixture
def loop():
    """A loop of 0.8 m that crosses itself, as joints 1 cm apart."""
    t = np.linspace(0, 1, 2000)
    line = np.column_stack((0.25 * np.cos(1.6 * np.pi * t) * (1 - 0.6 * t), 0.18 * np.sin(1.6 * np.pi * t), 0.5 + 0.02 * t))
    along = np.append(0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))
    at = np.arange(int(along[-1] / SEGMENT) + 1) * SEGMENT
    return np.column_stack([np.interp(at, along, column) for column in line.T])


def strand(points, tips=(TIP, TIP), sight=()):
    arcs = np.append(0, np.cumsum(np.full(len(points) - 1, SEGMENT)))
    return ObservedStrand(points, arcs, float(arcs[-1]), tips, 0, np.reshape(sight, (-1, 3)))


def cut(strands, joints, may_leave=False):
    return cut_misjoined(strands, joints, (len(joints) - 1) * SEGMENT, 0.03, may_leave)


def test_a_strand_of_one_part_stays_whole_wherever_the_object_has_moved(loop):
    seen = strand(loop + np.array([0.01, -0.005, 0.0]))
    for one in (seen, strand(loop[::-1].copy())):
        (same,) = cut([one], loop)
        np.testing.assert_array_equal(same.points, one.points)
        assert same.tips == (TIP, TIP)


def test_parts_that_one_frame_exchanged_become_strands(loop):
    """The first part goes on in the last one, turned round, as two strands that meet at the edge of a hand."""
    first, last = loop[:25], loop[-20:][::-1]
    one, other = cut([strand(np.concatenate((first, last)))], loop)
    np.testing.assert_array_equal(one.points, first)
    np.testing.assert_array_equal(other.points, last)
    assert one.tips == (TIP, CUT_OFF)
    assert other.tips == (CUT_OFF, TIP)
    assert one.length == pytest.approx(0.24)
    assert other.arcs[0] == 0.0


def test_a_gap_without_depth_belongs_to_no_part(loop):
    """What is between the last measured point of one part and the first of the next one was filled by the wrong join."""
    first, between, last = loop[:25], np.linspace(loop[24], loop[-1], 7)[1:-1], loop[-20:][::-1]
    points = np.concatenate((first, between, last))
    sight = np.zeros_like(points)
    sight[25:30] = (0.0, 0.0, 1.0)
    one, other = cut([strand(points, sight=sight)], loop)
    np.testing.assert_array_equal(one.points, first)
    np.testing.assert_array_equal(other.points, last)


def test_short_parts_are_dropped(loop):
    (kept,) = cut([strand(np.concatenate((loop[:3], loop[-30:])))], loop)
    np.testing.assert_array_equal(kept.points, loop[-30:])


def test_a_strand_without_depth_is_cut_as_the_camera_sees_it(loop):
    first, last = loop[:25], loop[-20:][::-1]
    rays = np.concatenate((first, last))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    arcs = np.append(0, np.cumsum(np.linalg.norm(np.diff(rays, axis=0), axis=1)))
    arcs[25:] += SEGMENT - (arcs[25] - arcs[24])
    one, other = cut([ObservedStrand(rays, arcs, float(arcs[-1]), (TIP, TIP), -1, rays)], loop)
    np.testing.assert_array_equal(one.points, rays[:25])
    np.testing.assert_array_equal(other.points, rays[25:])
    assert one.is_flat
    assert other.is_flat


def test_an_unsure_connection_is_cut_sooner_than_what_was_seen_joined(loop):
    """The end of a strand lies 3 cm beside the object: noise, unless the frame itself doubts how it goes on."""
    points = np.concatenate((loop[:30], loop[30:34] + np.array([0.0, 0.0, 0.03])))
    (whole,) = cut([strand(points)], loop)
    assert len(whole.points) == 34
    joined = np.ones(34)
    joined[30] = 0.4
    far = replace(strand(np.concatenate((loop[:30], loop[40:44]))), joined=joined)
    parts = cut([far], loop)
    assert len(parts[0].points) == 30


@pytest.mark.parametrize("turn", [1, -1])
def test_a_strand_of_an_object_that_was_not_given_is_cut_at_the_gap_beyond_which_it_leaves_the_object(loop, turn):
    """2 cm beside the object it may be noise, and is for a given object; at the other gap it stays on the object."""
    points, joined = loop[::turn].copy(), np.ones(len(loop))
    joined[[20, 50]] = 0.9
    points[50:, 2] += 0.02
    found = replace(strand(points), joined=joined)
    lengths = [[len(part.points) for part in cut([found], loop, may_leave)] for may_leave in (False, True)]
    assert lengths == [[90], [50, 40]]

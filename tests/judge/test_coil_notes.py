"""Coils: the note is raised where turns touch or overlap, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest
from builders.chains import helix
from builders.drawn_masks import frame_of, line
from builders.scenes import cloud_scene, frame_scene

import doo3d
from doo3d.geometry.polyline import net_turns
from doo3d.judge.notes import COIL, coil_notes

RADIUS = 0.005


def spiral(pitch: float, turns: float = 3.0):
    """A flat spiral whose turns are `pitch` metres apart."""
    angle = np.arange(0, 2 * np.pi * turns, 0.01)
    reach = 0.05 + pitch * angle / (2 * np.pi)
    return np.column_stack((reach * np.cos(angle), reach * np.sin(angle), np.full_like(angle, 0.5)))


def notes_of(*axes):
    frame, mask = frame_of(*axes, radius=RADIUS)
    found = doo3d.detect(frame, {"merge.chains": len(axes)}, mask)
    return [note for note in found.notes if note.startswith(COIL)]


@pytest.mark.parametrize("pitch", [0.0105, 0.012])
def test_a_coil_whose_turns_touch_is_named(pitch):
    (note,) = notes_of(spiral(pitch))
    assert "turns that touch or overlap" in note
    assert "spread the turns apart" in note


def test_a_coil_with_room_between_its_turns_is_not():
    assert not notes_of(spiral(0.025))


def test_cables_side_by_side_are_no_coil():
    assert not notes_of(*(line([-0.15, y, 0.5], [0.15, y, 0.5]) for y in (-0.011, 0.0, 0.011)))


def test_a_cloud_has_no_strands_side_by_side():
    chain = helix()
    assert coil_notes([chain], cloud_scene(chain.joints)) == ()
    assert coil_notes([], frame_scene(*frame_of(line([-0.1, 0, 0.5], [0.1, 0, 0.5])))) == ()


@pytest.mark.parametrize("turns", [0.5, 1.0, 2.5])
@pytest.mark.parametrize("dim", [2, 3])
def test_turns_to_one_side_add_up_and_others_cancel(turns, dim):
    arc = spiral(0.0, turns)[:, :dim]
    back = 2 * arc[-1] - arc[::-1]  # turned by half a turn: it bends to the other side
    assert net_turns(arc) == pytest.approx(turns, abs=0.01)
    assert net_turns(np.vstack((arc, back[1:]))) == pytest.approx(0.0, abs=0.01)
    assert net_turns(arc[:2]) == 0

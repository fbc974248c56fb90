"""Frames of a sequence without any depth on the object: its place across the line of sight comes from the image."""

from __future__ import annotations

import numpy as np
import pytest
from builders.drawn_masks import CAMERA, axis_error, frame_of, ring, wave
from scipy.spatial import cKDTree

import doo3d
from doo3d.config import load_config
from doo3d.errors import InputError
from doo3d.geometry.polyline import arc_length, densify, unit
from doo3d.track import image_strands
from doo3d.track.detect_sequence import detect_sequence
from doo3d.track.first_pass import observe_frame
from doo3d.track.image_strands import strands_in_image
from doo3d.track.observations import ObservedStrand
from doo3d.track.registration import fit_joints, place_strands
from doo3d.track.rings import place_on_ring
from doo3d.track.strand_ends import CUT_OFF, TIP, UNKNOWN

CONFIG = load_config("default", {"merge.chains": 1})
PUSH = (0.0, 0.0, 0.0, 0.01, 0.02, 0.01, 0.0, 0.0, 0.0)
"""m by which the cable is pushed aside and back, which only frames without depth show."""
LOST = (3, 4, 5)
GREEN = (20, 160, 40)


def axis(frame):
    return wave() + np.array((0.0, PUSH[frame], 0.0))


def drawn(frame, lost=False, table=0.0, color=False):
    """The frame of the cable, with the depth of the cable, or all of it, lost; and the mask."""
    data, mask = frame_of(axis(frame), table=table)
    depth = np.where(mask, 0.0, data.depth).astype(np.float32) if lost else data.depth
    image = np.where(mask[..., None], GREEN, 120).astype(np.uint8) if color else None
    return doo3d.Frame(image, depth, data.camera), mask


def in_image(chain, frame):
    """The largest distance across the line of sight of the joints of a chain, but its ends, from the cable, m."""
    return 0.5 * cKDTree(densify(unit(axis(frame)), 1e-4)).query(unit(chain.joints[1:-1]))[0].max()


@pytest.mark.parametrize("table", [0.0, 0.56])
def test_a_cable_that_moves_while_its_depth_is_lost_is_where_the_image_shows_it(table):
    frames, masks = zip(*(drawn(k, k in LOST, table) for k in range(len(PUSH))), strict=True)
    detections = detect_sequence(frames, CONFIG, masks)
    for k in LOST:
        (chain,) = detections[k].chains
        assert set(chain.depth) == {"filled"}
        assert not chain.from_time.any()
        assert in_image(chain, k) < 0.002
        assert axis_error(chain, axis(k)).largest < 0.006  # its depth is that of the frames around
        deviation = chain.deviations.mean(axis=0)
        assert deviation[1] > 2 * detections[0].chains[0].deviations[:, 1].mean()


def test_without_a_mask_the_color_tells_the_strands():
    config = load_config("default", {"merge.chains": 1, "segment.ranges": [{"low": [50, 50, 50], "high": [90, 255, 255]}]})
    frames = [drawn(k, k in LOST, 0.56, color=True)[0] for k in range(len(PUSH))]
    detections = detect_sequence(frames, config)
    for k in LOST:
        assert in_image(detections[k].chains[0], k) < 0.002


def test_a_longer_loss_than_max_gap_is_filled_as_long_as_the_image_shows_the_object():
    order = [0, 0, 0, *[4] * 8, 0, 0, 0]
    frames, masks = zip(*(drawn(k, k == 4) for k in order), strict=True)
    detections = detect_sequence(frames, load_config("default", {"merge.chains": 1, "sequence.max_gap": 0.1}), masks)
    assert all(len(detection.chains) == 1 for detection in detections)
    assert max(in_image(detection.chains[0], k) for detection, k in zip(detections, order, strict=True)) < 0.002


def test_strands_of_the_image_are_directions_with_angles_for_lengths():
    frame, mask = drawn(4, lost=True)
    (strand,) = observe_frame(frame, CONFIG, mask).strands
    assert strand.is_flat
    assert strand.tips == (UNKNOWN, UNKNOWN)
    np.testing.assert_allclose(np.linalg.norm(strand.points, axis=1), 1.0)
    true = arc_length(unit(axis(4)))[-1]
    assert strand.length == pytest.approx(true, rel=0.04)  # with the round ends
    assert (
        np.abs(CAMERA.project(strand.points)[:, 1] - np.interp(CAMERA.project(strand.points)[:, 0], *CAMERA.project(axis(4)).T))[
            3:-3
        ].max()
        < 1.0
    )


def test_an_image_that_shows_no_object_has_no_strands(monkeypatch):
    frame, mask = drawn(4, lost=True)
    assert strands_in_image(frame, CONFIG, None) == ()  # no color either
    assert strands_in_image(frame, CONFIG, np.zeros_like(mask)) == ()

    def refuse(*given):
        raise InputError("no", code="voxels-too-many")

    monkeypatch.setattr(image_strands, "detect_with_stages", refuse)
    assert strands_in_image(frame, CONFIG, mask) == ()


def seen_from(center, points, tips):
    """A strand without depth at points (K, 3), as a camera at `center` sees them."""
    rays = unit(points - center)
    arcs = arc_length(rays)
    return ObservedStrand(center + rays, arcs, float(arcs[-1]), tips, -1, rays)


@pytest.mark.parametrize("tips", [(TIP, CUT_OFF), (UNKNOWN, UNKNOWN)])
@pytest.mark.parametrize("center", [(0.0, 0.0, 0.0), (0.4, 0.1, -0.2)])
def test_a_strand_without_depth_finds_its_place_on_an_object_that_moved(center, tips):
    """The object is slanted: the same angle is more of it at its far end."""
    line = np.linspace((-0.2, 0.0, 0.6), (0.2, 0.05, 0.9), 51)
    line[:, 1] += 0.05 * np.sin(np.linspace(0, 5, 51))
    length = arc_length(line)[-1]
    moved = line + np.array((0.0, 0.012, 0.0))
    (placed,) = place_strands([seen_from(np.array(center), moved[:31], tips)], line, length, 0.05)
    np.testing.assert_allclose(placed.arcs, arc_length(line)[:31], atol=0.012)
    bent, seen, _ = fit_joints(line, [placed], length)
    assert seen[:30].all()
    assert not seen[33:].any()
    across = np.cross(bent[:30] - center, unit(moved[:30] - center))
    assert np.linalg.norm(across, axis=1).max() < 0.012
    assert np.abs(across[:, 0]).max() < 0.004


def test_rings_are_not_laid_by_the_image_alone():
    joints = ring((0.0, 0.0, 0.5), 0.08)[::8]
    strand = seen_from(np.zeros(3), joints[5:30], (CUT_OFF, CUT_OFF))
    assert place_on_ring([strand], joints, float(arc_length(joints)[-1]), 0.05) == []

"""The surface beside an object: two cables in line on a table stay two; what hides a cable, or a hole in its mask, is bridged."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from builders.drawn_masks import CAMERA, depth_of, line
from builders.scenes import cloud_scene, frame_scene, image_scene

import doo3d
from doo3d import Frame, load_config
from doo3d.config import MergeConfig
from doo3d.geometry.curves import Curves
from doo3d.links import merge
from doo3d.scene.point_visibility import PointVisibility
from doo3d.scene.surface_beside import Support
from doo3d.types import Plane

TABLE, RADIUS = 0.6, 0.002
Z = TABLE - RADIUS
SEEN = Z - RADIUS / 2  # about where thinning lays the skeleton
WHOLE = [line((-0.2, 0, Z), (0.2, 0, Z))]
TABLE_COLOR, CABLE_COLOR, BOX_COLOR = (150, 150, 145), (200, 60, 30), (40, 60, 120)

with_and_without_color = pytest.mark.parametrize("colored", [True, False])
numbers = pytest.mark.parametrize("wanted", [None, 1])


def two_cables(gap):
    return [line((-0.2, 0, Z), (-gap / 2, 0, Z)), line((gap / 2, 0, Z), (0.2, 0, Z))]


def middle(length):
    """Return the columns of the image over the middle `length` (m) of the table."""
    half = int(length / 2 * CAMERA.fx / TABLE)
    return slice(320 - half, 320 + half)


def rendered(axes, colored, hole=0.0, box=0.0, noise=0.0005):
    """Return a frame of cables on a table, and their mask: a hole in the mask, or a box 5 cm high, over the middle; in m."""
    rng = np.random.default_rng(0)
    depth, which = depth_of(axes, [RADIUS] * len(axes), CAMERA, TABLE)
    mask = which >= 0
    color = np.full((*depth.shape, 3), TABLE_COLOR, float)
    color[mask] = CABLE_COLOR
    mask[:, middle(hole)] = False
    covered = (slice(200, 280), middle(box))
    depth[covered], color[covered], mask[covered] = TABLE - 0.05, BOX_COLOR, False
    color = (color + rng.normal(0, 5, color.shape)).clip(0, 255).astype(np.uint8)
    depth = depth + rng.normal(0, noise, depth.shape)
    return Frame(color if colored else None, depth.astype(np.float32), CAMERA), mask


def detect(frame, mask, wanted):
    return doo3d.detect(frame, load_config("default", {"merge.chains": wanted}), mask)


@with_and_without_color
@pytest.mark.parametrize("gap", [0.05, 0.1, 0.2])
def test_tips_on_an_empty_table_are_not_joined(gap, colored):
    assert len(detect(*rendered(two_cables(gap), colored), None).chains) == 2


@with_and_without_color
def test_a_number_that_needs_bare_table_is_refused_with_a_note(colored):
    found = detect(*rendered(two_cables(0.05), colored), 1)
    assert len(found.chains) == 1
    assert found.chains[0].length < 0.2
    (note,) = found.notes
    assert "1 chain wanted (merge.chains), but 2 found" in note
    assert "bare surface" in note
    assert "set merge.chains to 2" in note


@with_and_without_color
@numbers
def test_what_a_box_hides_is_joined(wanted, colored):
    found = detect(*rendered(WHOLE, colored, box=0.06), wanted)
    assert len(found.chains) == 1
    assert not found.notes


@with_and_without_color
@numbers
@pytest.mark.parametrize("hole", [0.01, 0.03, 0.05])
def test_a_hole_in_the_mask_is_bridged(hole, wanted, colored):
    found = detect(*rendered(WHOLE, colored, hole=hole), wanted)
    assert len(found.chains) == 1
    assert found.confidence > 0.8
    assert not found.notes


def test_confidence_falls_over_bare_table():
    """A gap that is short enough to be joined costs its length over the table."""
    bare = detect(*rendered(two_cables(0.018), True), None)
    hole = detect(*rendered(WHOLE, True, hole=0.018), None)
    assert len(bare.chains) == len(hole.chains) == 1
    (over_table,), (over_hole,) = bare.chains[0].connections, hole.chains[0].connections
    assert over_table.confidence < over_hole.confidence - 0.4


def classified(frame, mask, points):
    ends = [np.linspace((a, 0, SEEN), (b, 0, SEEN), 20) for a, b in ((-0.15, -0.05), (0.05, 0.15))]
    return frame_scene(frame, mask, radius=RADIUS).with_support(Curves.of(ends)).classify(points)


@with_and_without_color
def test_the_three_answers_for_a_pixel_outside_the_mask(colored):
    gap = np.linspace((-0.02, 0, SEEN), (0.02, 0, SEEN), 60)
    for (frame, mask), expected in (
        (rendered(two_cables(0.06), colored), PointVisibility.BARE),
        (rendered(WHOLE, colored, hole=0.06), PointVisibility.HIDDEN),
        (rendered(two_cables(0.06), colored, box=0.06), PointVisibility.HIDDEN),
    ):
        assert (classified(frame, mask, gap) == expected).mean() > 0.9


def test_color_decides_where_depth_does_not():
    """Noise of three times the radius: the depth of the cable is not told from that of the table, but its color is."""
    gap = np.linspace((-0.02, 0, SEEN), (0.02, 0, SEEN), 60)
    for axes, hole, expected in ((two_cables(0.06), 0.0, PointVisibility.BARE), (WHOLE, 0.06, PointVisibility.HIDDEN)):
        frame, mask = rendered(axes, True, hole=hole, noise=3 * RADIUS)
        told = classified(frame, mask, gap)
        undecided = np.isin(told, (PointVisibility.BARE, PointVisibility.HIDDEN))
        kinds = told[undecided & (np.abs(frame.depth[240, 320] - Z) < 1)]
        assert (kinds == expected).mean() > 0.6
        blind = Frame(None, frame.depth, CAMERA)
        assert not (classified(blind, mask, gap) == PointVisibility.BARE).any()


def test_the_log_odds_of_color_and_depth_are_added():
    points, pixels = np.array([(0.0, 0.0, 0.6)] * 2), np.array([(320, 240), (0, 0)])
    frame, mask = rendered(two_cables(0.06), True)
    chains = Curves.of([np.linspace((-0.15, 0, SEEN), (-0.05, 0, SEEN), 20)])
    colors = frame_scene(frame, mask, radius=RADIUS).with_support(chains).support.colors
    known = Support(points[:1], np.array([0.004]), np.array([0.001]), colors)
    blind = replace(known, colors=None)
    unresolved = Support(points[:1], np.array([np.nan]), np.array([np.nan]), colors)
    readings = np.array([0.604, 0.601])
    by_depth = blind.bare_log_odds(points, pixels, readings, 1e-9)
    assert by_depth == pytest.approx([2, -1])
    by_color = unresolved.bare_log_odds(points, pixels, readings, 1e-9)
    assert (by_color > 2).all()
    np.testing.assert_allclose(known.bare_log_odds(points, pixels, readings, 1e-9), by_depth + by_color)
    noisy = replace(blind, rise_noise=np.array([0.002]))
    np.testing.assert_allclose(noisy.bare_log_odds(points, pixels, readings, 1e-9), by_depth / 2)


def test_the_plane_tells_what_stands_on_it_where_the_rise_is_not_resolved():
    """By color a dark thing is no cable; but what is as high as the cable, or higher, may hide it."""
    points, pixels = np.array([(0.0, 0.0, 0.6)] * 3), np.array([(320, 240)] * 3)
    table = Plane(np.array((0.0, 0.0, -1.0)), -0.602)
    support = Support(points[:1], np.array([np.nan]), np.array([0.001]), None, (table, CAMERA, RADIUS))
    readings = np.array([0.602, 0.6, 0.592])  # on the table, as high as the cable's axis, and a thing of 10 mm
    assert support.bare_log_odds(points, pixels, readings, 1e-9) == pytest.approx([2, 0, -8])
    resolved = replace(support, rise=np.array([0.004]))
    assert resolved.bare_log_odds(points, pixels, readings, 1e-9) == pytest.approx([0, -2, -10])


def test_the_rise_beside_a_chain_and_its_noise_are_measured():
    frame, mask = rendered(WHOLE, False)
    chains = Curves.of([np.linspace((-0.15, 0, SEEN), (0.15, 0, SEEN), 40)])
    support = frame_scene(frame, mask, radius=RADIUS).with_support(chains).support
    assert support.rise == pytest.approx([TABLE - SEEN] * 2, abs=0.0003)
    assert support.rise_noise == pytest.approx([0.0005] * 2, rel=0.4)


def test_nothing_is_bare_without_an_image_of_depth():
    for scene in (cloud_scene(np.zeros((3, 3))), image_scene(np.ones((5, 5), bool))):
        assert scene.with_support(Curves.of([np.zeros((3, scene.dim))])) is scene
    scene = frame_scene(*rendered(WHOLE, False))
    assert scene.with_support(Curves.of([])) is scene


def test_tips_are_where_the_mask_ends_in_the_open():
    frame, mask = rendered(two_cables(0.1), True)
    chain = np.linspace((-0.15, 0, SEEN), (-0.05, 0, SEEN), 20)
    scene = frame_scene(frame, mask, radius=RADIUS).with_support(Curves.of([chain]))
    ends = np.array([chain[-1], chain[10], chain[0]])
    outward = np.array([(1.0, 0, 0), (1.0, 0, 0), (-1.0, 0, 0)])
    assert (scene.tips(ends, outward, RADIUS) > 0).tolist() == [True, False, False]


def test_bare_surface_is_a_term_of_the_cost():
    frame, mask = rendered(two_cables(0.02), True)
    chains = Curves.of([np.linspace((a, 0, SEEN), (a + 0.1, 0, SEEN), 11) for a in (-0.11, 0.01)])
    (decision,) = merge(chains, frame_scene(frame, mask, radius=RADIUS), 0.01, MergeConfig()).decisions
    gap = decision.chosen.gap_cost
    assert gap.bare == pytest.approx(20 * 20, rel=0.25)
    assert gap.free_space == gap.unknown == 0
    assert gap.open == gap.bare
    assert json.dumps(decision.chosen.terms)

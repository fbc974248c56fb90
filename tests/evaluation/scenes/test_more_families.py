"""The families of handled and wound cables are what they say, and vary."""

from dataclasses import replace

import numpy as np
import pytest

from doo3d.evaluation.benchmark.cases import known_frame, pieces_in_view
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.curves import curve_crossings
from doo3d.evaluation.scenes.model import Truth
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.evaluation.scenes.stacking import min_clearance
from doo3d.types import Camera

SMALL = (320, 180)


def flat(scene, cable=0):
    across = np.linalg.svd(scene.table.normal[None])[2][1:]
    return scene.cables[cable].axis[::4] @ across.T


def crossings(scene):
    line = flat(scene)
    return len(curve_crossings(line, np.zeros(len(line), dtype=int)).first)


def test_fingers_of_a_gripper_hide_part_of_the_cable():
    scene = make_scene("gripper", 0, SMALL)
    assert len(scene.occluders) % 3 == 0
    truth = render(scene, "none").truths[0]
    assert 0.01 < (~truth.seen).mean() < 0.4


def test_what_hangs_from_a_hook_spans_half_a_metre_of_depth_or_more():
    for seed in range(3):
        depth = make_scene("hook", seed).cables[0].axis[:, 2]
        assert 0.36 < depth.min() < 0.6
        assert 0.85 < depth.max() < 1.6


def test_a_coil_has_three_to_six_turns_and_a_tail_across_them():
    for seed in range(3):
        scene = make_scene("coil", seed)
        line = flat(scene)
        heading = np.unwrap(np.arctan2(*np.diff(line, axis=0).T[::-1]))
        assert 2.5 < abs(heading[-1] - heading[0]) / (2 * np.pi) < 7
        assert crossings(scene) >= 2


def test_a_figure_of_eight_crosses_itself_once():
    assert [crossings(make_scene("figure_eight", seed)) for seed in range(3)] == [1, 1, 1]


def test_bundled_cables_are_near_each_other_and_do_not_meet():
    scene = make_scene("bundle", 0)
    radius = scene.cables[0].radius
    assert 3 <= len(scene.cables) <= 5
    assert 1.0 <= min_clearance([cable.axis for cable in scene.cables], radius) < 1.65


def test_of_two_radii_one_is_much_thicker():
    scene = make_scene("two_radii", 0)
    thin, thick = sorted(cable.radius for cable in scene.cables)
    assert 1.6 < thick / thin < 3
    heights = [(cable.axis - scene.table.point) @ scene.table.normal for cable in scene.cables]
    assert [height.mean() for height in heights] == pytest.approx([cable.radius for cable in scene.cables], abs=1e-6)


def test_hoses_are_thick_and_wires_thin():
    assert 0.008 <= make_scene("hose", 0).cables[0].radius <= 0.015
    assert 0.0005 <= make_scene("wire", 0).cables[0].radius <= 0.00075


def test_plugs_are_solids_at_the_tips():
    scene = make_scene("plugs", 2)
    assert scene.occluders
    tips = scene.cables[0].axis[[0, -1]]
    for solid in scene.occluders:
        assert np.linalg.norm(solid.vertices.mean(axis=0) - tips, axis=1).min() < 0.04
    rendered = render(scene, "none")
    assert (rendered.labels == 255).any()


def test_stripes_are_seen():
    scene = make_scene("striped", 2, (640, 360))
    bare = replace(scene, cables=tuple(replace(cable, stripe=None) for cable in scene.cables))
    rendered, plain = render(scene, "none"), render(bare, "none")
    assert np.array_equal(rendered.mask, plain.mask)
    different = (np.abs(rendered.frame.color.astype(int) - plain.frame.color.astype(int)).max(axis=-1) > 30) & rendered.mask
    assert 0.1 < different.sum() / rendered.mask.sum() < 0.8


def test_a_ring_is_closed():
    for seed in range(3):
        cable = make_scene("ring", seed).cables[0]
        assert cable.closed
        assert np.linalg.norm(cable.axis[0] - cable.axis[-1]) < 0.001


def test_tips_touch_the_side_of_another_cable():
    scene = make_scene("touch", 0)
    main, radius = scene.cables[0], scene.cables[0].radius
    for branch in scene.cables[1:]:
        distance = np.linalg.norm(main.axis - branch.axis[0], axis=1).min()
        assert 2 * radius <= distance + 1e-4
        assert distance < 2.7 * radius


def test_a_cable_that_leaves_the_view_counts_as_its_pieces():
    rendered = render(make_scene("leaving", 0, SMALL), "none")
    assert len(rendered.truths) == 1
    known = known_frame(rendered)
    assert len(known.truths) == 2
    assert sum(len(truth.axis) for truth in known.truths) < len(rendered.truths[0].axis)
    assert all(truth.seen is not None and truth.seen.mean() > 0.9 for truth in known.truths)


def test_pieces_in_view():
    camera = Camera(100.0, 100.0, 50.0, 50.0, 100, 100)

    def cable(x, closed=False):
        return Truth(np.column_stack((x, np.zeros(len(x)), np.ones(len(x)))), 0.004, closed)

    inside = cable(np.linspace(-0.2, 0.2, 401))
    assert pieces_in_view(inside, camera)[0] is inside
    (half,) = pieces_in_view(cable(np.linspace(0, 1, 1001)), camera)
    assert half.axis[-1, 0] == pytest.approx(0.494, abs=0.002)
    assert pieces_in_view(cable(np.linspace(2, 3, 1001)), camera) == []
    angle = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    ring = Truth(np.column_stack((0.4 + 0.2 * np.cos(angle), 0.2 * np.sin(angle), np.ones(2000))), 0.004, closed=True)
    (arc,) = pieces_in_view(ring, camera)
    assert not arc.closed
    assert np.linalg.norm(np.diff(arc.axis, axis=0), axis=1).max() < 0.001

"""The tough families: cables do not intersect, and have what makes these scenes hard."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from doo3d.evaluation.benchmark.cases import known_frame
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.registry import FAMILIES, GROUPS, TOUGH, WITHOUT, make_scene
from doo3d.evaluation.scenes.stacking import min_clearance

SMALL = (320, 180)
SEEDS = range(2)


def heights(scene, cable=0):
    return (scene.cables[cable].axis - scene.table.point) @ scene.table.normal


@pytest.mark.parametrize("family", ["tough_hook", "tough_gripper"])
def test_cables_do_not_pass_through_what_holds_them(family):
    for seed in range(4):
        scene = make_scene(family, seed)
        (cable,) = scene.cables
        for solid in scene.occluders:
            corner, edges = solid.vertices[0], solid.vertices[[4, 2, 1]] - solid.vertices[0]
            places = (cable.axis - corner) @ edges.T / (edges**2).sum(axis=1)
            outside = np.maximum(np.maximum(-places, places - 1), 0) * np.linalg.norm(edges, axis=1)
            assert np.linalg.norm(outside, axis=1).min() >= 0.99 * cable.radius


def test_groups_of_families_are_apart():
    assert GROUPS["tough"] == tuple(TOUGH)
    assert GROUPS["without"] == tuple(WITHOUT)
    assert len({*FAMILIES, *TOUGH, *WITHOUT}) == len(FAMILIES) + len(TOUGH) + len(WITHOUT)
    assert GROUPS["all"] == tuple(FAMILIES) == GROUPS["basic"] + GROUPS["more"]
    assert len(FAMILIES) == 27


def test_clearance_is_in_sums_of_radii():
    x = np.arange(0, 0.1, 0.0005)
    one, other = (np.column_stack((x, np.full(len(x), y), 0 * x)) for y in (0.0, 0.009))
    assert min_clearance([one, other], np.array([0.004, 0.002])) == pytest.approx(1.5)
    assert min_clearance([one], np.array([0.004])) == 2


def test_turns_of_a_coil_touch_overlap_and_pile_up():
    for seed in SEEDS:
        scene = make_scene("tough_coil", seed)
        (cable,) = scene.cables
        assert 1.4 < cable.length < 3.3
        points, height = cable.axis[::4], heights(scene)[::4]
        i, j = cKDTree(points).query_pairs(2.3 * cable.radius, output_type="ndarray").T
        apart = np.abs(i - j) * 0.002 > 8 * cable.radius
        assert len(np.unique((i[apart], j[apart]))) > 0.3 * len(points)
        assert height.max() > 4 * cable.radius


def test_two_radii_touch_for_half_of_their_length():
    for seed in SEEDS:
        thick, thin = make_scene("tough_radii", seed).cables
        assert 2 < thick.radius / thin.radius < 2.7
        distance = cKDTree(thick.axis).query(thin.axis)[0] / (thick.radius + thin.radius)
        assert 0.4 < np.mean(distance < 1.15) < 0.75


def test_four_cables_run_side_by_side():
    scene = make_scene("tough_bundle", 0)
    assert len(scene.cables) == 4
    assert len({cable.radius for cable in scene.cables}) == 1
    assert {len({cable.color for cable in make_scene("tough_bundle", seed).cables}) > 1 for seed in range(8)} == {True, False}


def test_a_hung_cable_comes_near_the_camera_and_ends_far_away():
    for seed in SEEDS:
        scene = make_scene("tough_hook", seed)
        depth = scene.cables[0].axis[:, 2]
        assert depth.min() < 0.5
        assert depth.max() > 1.25
        assert depth.max() < scene.table.point[2]
        assert scene.occluders


def test_fingers_hide_a_lifted_cable():
    for seed in SEEDS:
        scene = make_scene("tough_gripper", seed)
        assert len(scene.occluders) == 3
        assert heights(scene).max() > 0.04
        (truth,) = known_frame(render(make_scene("tough_gripper", seed, SMALL), "none")).truths
        assert 0.01 < np.mean(~truth.seen) < 0.25


def test_wires_are_thin_and_some_are_in_the_air():
    scenes = [make_scene("tough_wire", seed) for seed in range(8)]
    assert all(0.001 <= scene.cables[0].radius <= 0.0015 for scene in scenes)
    highest = [heights(scene).max() for scene in scenes]
    assert min(highest) < 0.005
    assert max(highest) > 0.02

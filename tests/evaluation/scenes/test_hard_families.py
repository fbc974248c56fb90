"""The hard families are what they say: legs so near, crossings so many, knots that are knots."""

import numpy as np
import pytest

from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.curves import curve_crossings
from doo3d.evaluation.scenes.hard_families import HAIRPIN_GAP_DIAMETERS, SHINY_LENGTHS, THIN_WIDTHS_PX
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.evaluation.scenes.stacking import min_clearance
from doo3d.evaluation.scenes.studio import make_studio
from doo3d.evaluation.scenes.wound_families import KNOTS, alternating, planar_knot


@pytest.mark.slow
def test_tangles_cross_four_to_ten_times():
    for seed in range(3):
        scene = make_scene("tangle", seed)
        across = np.linalg.svd(scene.table.normal[None])[2][1:]
        flat = scene.cables[0].axis[::4] @ across.T
        assert 4 <= len(curve_crossings(flat, np.zeros(len(flat), dtype=int)).first) <= 10


def test_hairpin_legs_are_less_than_a_diameter_apart():
    for seed in range(5):
        cable = make_scene("hairpin", seed).cables[0]
        gap = min_clearance([cable.axis], cable.radius) - 1
        assert HAIRPIN_GAP_DIAMETERS[0] - 0.01 < gap < HAIRPIN_GAP_DIAMETERS[1] + 0.01


@pytest.mark.slow
def test_shiny_runs_are_seen_without_depth():
    scene = make_scene("shiny", 0)
    rendered = render(scene, "none")
    cable, truth = scene.cables[0], rendered.truths[0]
    start, end = cable.shiny[0]
    assert SHINY_LENGTHS[0] <= end - start <= SHINY_LENGTHS[1]
    u, v = np.round(scene.camera.project(cable.axis[(cable.arcs > start) & (cable.arcs < end)])).astype(int).T
    assert rendered.mask[v, u].mean() > 0.95
    assert (rendered.frame.depth[v, u] == 0).mean() > 0.9
    assert truth.seen[(truth.arcs > start) & (truth.arcs < end)].all()


def test_thin_cables_are_two_to_three_pixels_wide():
    scene = make_scene("thin", 1)
    wide = 2 * scene.cables[0].radius * scene.camera.fx / np.median(scene.cables[0].axis[:, 2])
    assert THIN_WIDTHS_PX[0] - 0.2 < wide < THIN_WIDTHS_PX[1] + 0.2


def _renamed(order):
    """Crossings numbered as they are first met."""
    names = {}
    return "".join(str(names.setdefault(str(which), len(names) + 1)) for which in order)


@pytest.mark.parametrize(("name", "code"), [("overhand", "123123"), ("figure eight", "12314324")])
def test_knots_are_knots(name, code):
    """By their Gauss codes, crossed over and under in turn: the trefoil's and the figure eight's."""
    rng = np.random.default_rng(0)
    for _ in range(5):
        curve = planar_knot(rng, make_studio(rng, (1280, 720)), *KNOTS[name])
        found = curve_crossings(curve, np.zeros(len(curve), dtype=int))
        order = np.argsort(np.concatenate((found.first, found.second))) % len(found.first)
        assert _renamed(order) in {_renamed(list(code[k:] + code[:k])) for k in range(len(code))}  # closed far away
        over = alternating(found)
        visits = np.concatenate((over, ~over))[np.argsort(np.concatenate((found.first, found.second)))]
        assert (visits[1:] != visits[:-1]).all()


def test_clutter_is_beside_the_cable_and_not_in_the_mask():
    scene = make_scene("clutter", 0)
    rendered = render(scene, "none")
    assert (rendered.labels == 255).any()
    assert rendered.truths[0].seen.mean() > 0.95
    near = [np.linalg.norm(solid.vertices[:, None] - scene.cables[0].axis[None, ::8], axis=-1).min() for solid in scene.occluders]
    assert min(near) > scene.cables[0].radius

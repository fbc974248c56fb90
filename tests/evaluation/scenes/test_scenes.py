"""Scenes: the same every time, inside the view, nothing touches through, strands lie on each other."""

import numpy as np
import pytest

from doo3d.evaluation.scenes.curves import curve_crossings
from doo3d.evaluation.scenes.registry import FAMILIES, GROUPS, TOUGH, TREES, WITHOUT, make_scene
from doo3d.evaluation.scenes.stacking import min_bend_radius, min_clearance


@pytest.mark.parametrize("family", [*FAMILIES, *TOUGH, *WITHOUT, *TREES])
def test_the_same_seed_gives_the_same_scene_and_another_seed_another(family):
    one, same, other = (make_scene(family, seed) for seed in (1, 1, 2))
    assert one.camera == same.camera != other.camera
    assert one.light == same.light != other.light
    assert all(np.array_equal(a.axis, b.axis) for a, b in zip(one.cables, same.cables, strict=True))
    assert all(np.array_equal(a.vertices, b.vertices) for a, b in zip(one.occluders, same.occluders, strict=True))
    assert bool(one.cables) is (family not in WITHOUT)
    if one.cables:
        assert one.cables[0].radius != other.cables[0].radius
        assert not np.array_equal(one.cables[0].axis[0], other.cables[0].axis[0])
        assert one.cables[0].axis[:, 2].min() > 0.25


SOUND = [pytest.param(family, size, marks=pytest.mark.slow) for family in GROUPS["basic"] for size in ((1280, 720), (640, 480))]


@pytest.mark.parametrize(("family", "size"), [*SOUND, *((family, (1280, 720)) for family in TOUGH)])
def test_cables_are_sound_and_in_view(family, size):
    for seed in range(3 if family in GROUPS["basic"] else 2):
        scene = make_scene(family, seed, size)
        radii = np.array([cable.radius for cable in scene.cables])
        assert min_clearance([cable.axis for cable in scene.cables], radii) >= 0.998
        for cable in scene.cables:
            steps = np.linalg.norm(np.diff(cable.axis, axis=0), axis=1)
            if family in GROUPS["basic"]:
                assert steps.max() <= 0.0005 + 1e-6
            else:
                assert ((cable.axis - scene.table.point) @ scene.table.normal).min() > 0.99 * cable.radius
            assert min_bend_radius(cable.axis) >= 3.99 * cable.radius
            pixels = scene.camera.project(cable.axis)
            assert (pixels > 5).all()
            assert (pixels < np.array(size) - 5).all()


def test_cables_lie_on_the_table_and_on_each_other():
    for seed in range(4):
        scene = make_scene("crossing", seed)
        cable, table = scene.cables[0], scene.table
        height = (cable.axis - table.point) @ table.normal
        assert height.min() == pytest.approx(cable.radius, abs=2e-5)
        across = np.linalg.svd(table.normal[None])[2][1:]
        found = curve_crossings(cable.axis @ across.T, np.zeros(len(height), dtype=int))
        assert len(found.first) == 1
        apart = abs(np.interp(found.first, range(len(height)), height) - np.interp(found.second, range(len(height)), height))
        assert 2 * cable.radius <= apart[0] <= 2.2 * cable.radius


def test_unknown_family_names_the_known_ones():
    with pytest.raises(ValueError, match="straight"):
        make_scene("spaghetti", 0)

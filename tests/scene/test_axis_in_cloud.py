"""How well the depth of an axis is known, from the measurements alone."""

from __future__ import annotations

from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from builders.drawn_masks import line, surface
from builders.scenes import cloud_scene

from doo3d.geometry.curves import Curves
from doo3d.scene.axis_in_cloud import depth_noise
from doo3d.scene.samples import Samples, sample_paths
from doo3d.types import Path

RADIUS, HALF, COUNT = 0.004, 2, 2000


def samples(count: int = COUNT) -> Samples:
    along = 0.4 * RADIUS * np.arange(count)
    places = np.column_stack((along, np.zeros(count), 0.6 + 0.05 * np.sin(along / 0.2)))
    radius = np.full(count, RADIUS)
    return Samples(Curves.of(np.split(places, 2)), np.zeros(count, dtype=bool), radius, radius, HALF, 0.4 * RADIUS)


@pytest.mark.parametrize("noise", [0.0001, 0.001])
def test_it_is_the_noise(noise):
    """On a gently bent course, with half of the places not measured at all and a step from one path to the next."""
    given = samples()
    away = np.tile([0.0, 0.0, 1.0], (COUNT, 1))
    places = given.curves.points.copy()
    places[:, 2] += noise * np.random.default_rng(0).normal(size=COUNT) + 0.3 * given.curves.owner
    known = np.ones(COUNT, dtype=bool)
    known[: COUNT // 4] = False
    places[~known, 2] += 9.0
    assert depth_noise(places, away, known, given) == pytest.approx(noise / RADIUS, rel=0.12)


def test_of_too_few_places_nothing_is_known():
    few = samples(6)
    assert depth_noise(few.curves.points, np.tile([0.0, 0.0, 1.0], (6, 1)), np.ones(6, dtype=bool), few) == 0


def test_estimation_changes_no_samples_it_is_given():
    """Samples are frozen; their arrays stay as they were, too."""
    axis = line([-0.1, 0, 0.5], [0.1, 0, 0.5])
    given = sample_paths([Path(axis - (0, 0, RADIUS))], RADIUS, 0.01)
    before = {name: np.copy(getattr(given, name)) for name in ("radius", "radii", "filled")}
    points = np.copy(given.curves.points)
    moved = cloud_scene(surface(axis, RADIUS)).measure_axis(given, 1)
    assert np.abs(moved.curves.points - points).max() > RADIUS / 2
    np.testing.assert_array_equal(given.curves.points, points)
    for name, values in before.items():
        np.testing.assert_array_equal(getattr(given, name), values)
    with pytest.raises(FrozenInstanceError):
        given.radius = moved.radius


def test_points_of_one_line_of_a_scanner_tell_no_radius():
    """A strand along a line of the scanner is seen as points that have no width across the line of sight."""
    axis = line([-0.1, 0, 0.5], [0.1, 0, 0.5])
    given = sample_paths([Path(axis)], RADIUS, 0.01)
    found = cloud_scene(axis, np.zeros(3)).measure_axis(given, 1)
    np.testing.assert_allclose(found.radii, RADIUS)

"""Strands of a cloud that touch side by side, parted by where the normals of their surfaces meet."""

from __future__ import annotations

import numpy as np
import pytest
from builders.drawn_masks import surface, wave
from builders.scenes import cloud_scene
from scipy.spatial import cKDTree

import doo3d
from doo3d.scene.touching_strands import NOT_TOUCHING, cast_votes

RADIUS, SPACING = 0.004, 0.002
ONE_CAMERA = np.zeros(3)


def bundle(count: int) -> list[np.ndarray]:
    """Return axes that touch side by side, parted at both ends."""
    apart = RADIUS * (2 + 400 * np.maximum(np.abs(np.linspace(-0.5, 0.5, 500)) - 0.3, 0) ** 2)
    sides = np.arange(count) - (count - 1) / 2
    return [wave(dive=0.02) + np.outer(side * apart, (0, 1, 0)) for side in sides]


def measured(axes: list[np.ndarray], sensor: np.ndarray | None, noise: float) -> np.ndarray:
    """Return points of the surfaces, with noise in radii; neighbors hide nothing of each other."""
    points = np.concatenate([surface(axis, RADIUS, sensor, SPACING) for axis in axes])
    return points + noise * RADIUS * np.random.default_rng(0).normal(size=points.shape)


@pytest.mark.parametrize("noise", [0.0, 0.1])
@pytest.mark.parametrize("sensor", [None, ONE_CAMERA])
@pytest.mark.parametrize("count", [2, 3])
def test_each_touching_cable_is_a_chain_on_its_own_axis(count, sensor, noise):
    axes = bundle(count)
    found = doo3d.detect(doo3d.Cloud(measured(axes, sensor, noise)), {"segment.method": "everything"})
    assert len(found.chains) == count
    owners = []
    for chain in found.chains:
        distance = np.column_stack([cKDTree(axis).query(chain.joints)[0] for axis in axes])
        owners.append(int(distance.mean(axis=0).argmin()))
        assert (distance[:, owners[-1]] < RADIUS).mean() > 0.94
    assert sorted(owners) == list(range(count))


@pytest.mark.parametrize("sensor", [None, ONE_CAMERA])
def test_one_cable_and_cables_apart_are_left_as_they_are(sensor):
    one = [wave()]
    two = [wave(), wave() + np.array((0, 6 * RADIUS, 0))]
    assert all(cloud_scene(measured(axes, sensor, 0.1), sensor).parted is NOT_TOUCHING for axes in (one, two))


def test_a_trunk_of_branches_is_not_parted():
    points = measured(bundle(2), None, 0.0)
    assert cloud_scene(points).parted.radius == pytest.approx(RADIUS, rel=0.2)
    assert cloud_scene(points, merge__branches=True).parted is NOT_TOUCHING


def test_normals_agree_at_the_radius():
    points = measured([wave()], None, 0.05)
    agreement = [cast_votes(points, factor * RADIUS, SPACING, ONE_CAMERA).agreement for factor in (0.5, 1, 2)]
    assert agreement[1] > 2 * max(agreement[0], agreement[2])

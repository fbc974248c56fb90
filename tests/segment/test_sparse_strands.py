"""Clouds of sparse points: wires of points one behind the other, and scans that only look like them."""

from __future__ import annotations

import numpy as np
import pytest
from builders.drawn_masks import axis_error, surface
from scipy.spatial import cKDTree

import doo3d
from doo3d.geometry.polyline import arc_length, resample
from doo3d.segment.point_lines import is_sparse
from doo3d.segment.sparse_strands import find_sparse_strands


def wires(count, spacing, apart=0.5, noise=0.03, gap=0.0, length=30.0, seed=0):
    """Catenaries side by side, m: their axes, and points of a scanner along them, in any order."""
    rng = np.random.default_rng(seed)
    x = np.linspace(0, length, 3000)
    axes, points = [], []
    for number in range(count):
        axis = np.column_stack((x, np.full(3000, number * apart), 80 * np.cosh((x - length / 2) / 80)))
        along = arc_length(axis)
        at = (
            np.arange(spacing, along[-1], spacing) + rng.uniform(-0.2, 0.2, len(np.arange(spacing, along[-1], spacing))) * spacing
        )
        at = at[np.abs(at - rng.uniform(8, length - 8)) >= gap / 2]
        sampled = resample(axis, at)
        axes.append(axis)
        points.append(sampled + rng.uniform(-noise, noise, sampled.shape))
    points = np.concatenate(points)
    return axes, points[rng.permutation(len(points))]


@pytest.mark.parametrize("scale", [1.0, 1 / 50])
@pytest.mark.parametrize(("count", "spacing", "gap"), [(3, 0.1, 0.0), (3, 0.1, 2.0), (2, 0.2, 2.0), (4, 0.05, 2.0)])
def test_wires_come_out_one_by_one(scale, count, spacing, gap):
    """Half a metre apart with points 5 to 20 cm apart along them, and as much smaller: gaps and voxels follow the spacing."""
    axes, points = wires(count, spacing, gap=gap)
    chains = doo3d.detect(doo3d.Cloud(scale * points)).chains
    assert len(chains) == count
    for axis in axes:
        errors = [cKDTree(axis).query(chain.joints / scale)[0].max() for chain in chains]
        chain = chains[int(np.argmin(errors))]
        assert min(errors) < 0.1
        assert abs(chain.length - scale * arc_length(axis)[-1]) < max(0.5 * scale, 0.011)


def test_a_thousandth_of_the_size():
    """Segments of 10 mm are long there, and still there is a chain for each wire."""
    _, points = wires(3, 0.1, gap=2.0)
    assert [round(chain.length, 3) for chain in doo3d.detect(doo3d.Cloud(points / 1000)).chains] == [0.03] * 3


def test_points_are_moved_to_their_lines():
    axes, points = wires(1, 0.1, noise=0.04)
    strands = find_sparse_strands(points)
    assert strands.kept.all()
    assert strands.sampling.spacing == pytest.approx(0.1, rel=0.1)
    before, after = (np.median(cKDTree(axes[0]).query(p)[0]) for p in (points, strands.centered))
    assert after < 0.6 * before
    assert cKDTree(strands.bridges).query(axes[0])[0].max() < 0.15


def scan(axis, radius, along, across):
    """Points of lines of a scanner on the upper half of a cable, m: `along` apart along it and `across` apart across."""
    at = resample(axis, np.arange(0, arc_length(axis)[-1], along))
    lateral = np.arange(-radius + across / 3, radius, across)
    height = np.sqrt(np.maximum(radius**2 - lateral**2, 0))
    tangent = np.gradient(at, axis=0)
    side = np.cross(tangent / np.linalg.norm(tangent, axis=1, keepdims=True), [0.0, 0.0, 1.0])
    return (at[:, None] + lateral[:, None] * side[:, None] + height[:, None] * np.array([0, 0, 1.0])).reshape(-1, 3)


@pytest.mark.parametrize(
    ("along", "across"), [(0.0005, 0.002), (0.001, 0.003), (0.003, 0.0007), (0.006, 0.0007), (0.012, 0.0007)]
)
def test_lines_of_a_scanner_on_one_cable_are_no_wires(along, across):
    """Dense along the cable and sparse across, and the other way round."""
    x = np.linspace(0, 0.4, 400)
    axis = np.column_stack((x, 0.05 * np.sin(10 * x), 0.5 + 0 * x))
    (chain,) = doo3d.detect(doo3d.Cloud(scan(axis, 0.005, along, across))).chains
    assert abs(chain.length - arc_length(axis)[-1]) < 0.02
    assert axis_error(chain, axis).largest < 0.007


@pytest.mark.parametrize("spacing", [0.001, 0.002, 0.004])
def test_surfaces_are_not_sparse(spacing):
    x = np.linspace(0, 0.4, 400)
    axis = np.column_stack((x, 0.05 * np.sin(10 * x), 0.5 + 0 * x))
    points = surface(axis, 0.005, spacing=spacing)
    assert not is_sparse(points)
    assert find_sparse_strands(points) is None


@pytest.mark.parametrize("count", [0, 1, 2, 13])
def test_few_points(count):
    assert find_sparse_strands(np.zeros((count, 3))) is None
    assert find_sparse_strands(np.linspace(0, 1, 3 * count).reshape(-1, 3)) is None

"""Cuboids that may intersect, against all pairs compared along the axes of both."""

import numpy as np
import pytest

from doo3d.geometry.polyline import unit
from doo3d.kernels import near_cuboids


def slow_gap(first, second):
    """Largest gap between two cuboids along the axes of the first."""
    (axes, half, middle), (other_axes, other_half, other_middle) = first, second
    return max(np.abs(axes @ (other_middle - middle)) - half - np.abs(axes @ other_axes.T) @ other_half)


def slow_gap_across_edges(first, second):
    """Largest gap between two cuboids along the axes perpendicular to an edge of each."""
    across = np.cross(first[0][:, None], second[0]).reshape(-1, 3)
    across = unit(across[np.linalg.norm(across, axis=1) > 1e-6])
    reach = sum(np.abs(across @ axes.T) @ half for axes, half, _ in (first, second))
    return max(np.abs(across @ (second[2] - first[2])) - reach)


def slow_cuboid(start, end, width):
    start, end = (np.pad(point, (0, 3 - len(point))) for point in (start, end))
    x = unit(end - start)
    y = np.eye(3)[np.argmin(np.abs(x))]
    y = unit(y - x * (x @ y))
    return np.array([x, y, np.cross(x, y)]), np.array([np.linalg.norm(end - start), width, width]) / 2, (start + end) / 2


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("width", [0.1, 0.4, 1.5])
def test_near_cuboids_are_those_without_a_gap(dim, seed, width):
    rng = np.random.default_rng(seed)
    starts = rng.uniform(0, 4, (40, dim))
    ends = starts + unit(rng.normal(size=(40, dim))) * rng.uniform(0.3, 1.2, (40, 1))
    chain = np.repeat([0, 1, 2, 3], 10)
    boxes = [slow_cuboid(*points, width) for points in zip(starts, ends, strict=True)]
    expected = [
        [i, j]
        for i in range(40)
        for j in range(i + 1, 40)
        if max(slow_gap(boxes[i], boxes[j]), slow_gap(boxes[j], boxes[i])) < 0 and not (j == i + 1 and chain[i] == chain[j])
    ]
    found, overlap = near_cuboids(starts, ends, chain, width)
    assert found.tolist() == expected
    assert 0 < len(found) < 780
    assert overlap.tolist() == [slow_gap_across_edges(boxes[i], boxes[j]) < 0 for i, j in expected]
    assert dim == 3 or overlap.all()


def test_the_last_segment_of_a_chain_and_the_first_of_the_next_are_a_pair():
    starts, ends = np.array([(0.0, 0.0), (1.0, 0.0)]), np.array([(1.0, 0.0), (2.0, 0.0)])
    assert near_cuboids(starts, ends, np.array([0, 1]), 0.1)[0].tolist() == [[0, 1]]
    assert not len(near_cuboids(starts, ends, np.array([0, 0]), 0.1)[0])

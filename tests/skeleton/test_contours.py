"""Contours around the skeletons of an image."""

from __future__ import annotations

import numpy as np
from builders.errors import refuses
from builders.scenes import empty_scene

from doo3d.config import TraverseConfig
from doo3d.errors import ConfigError
from doo3d.geometry.polyline import steps
from doo3d.skeleton.traverse import traverse
from doo3d.types import Skeleton


def contours_of(*curves, radius=4.0, **settings):
    """The contours round curves (P, 2) of whole pixels."""
    coords = np.unique(np.concatenate(curves), axis=0)
    return traverse(
        Skeleton(coords, coords + 0.5), empty_scene(radius=radius), TraverseConfig(method="contours", **settings)
    ).paths


def line(start, step, count):
    return np.array(start) + np.arange(count)[:, None] * np.array(step)


def test_a_contour_goes_from_a_tip_and_back_to_it():
    straight = line((10, 20), (1, 0), 50)
    (path,) = contours_of(straight)
    assert path.points[0].tolist() == path.points[-1].tolist()
    assert np.abs(path.points[0] - (10.5, 20.5)).max() == 1
    assert set(np.abs(path.points - straight[0] - 0.5).max(axis=1)) >= {1.0, 50.0}
    near = np.abs(path.points[:, None] - (straight + 0.5)[None]).max(axis=2).min(axis=1)
    assert (near == 1).all()
    assert steps(path.points).max() <= np.sqrt(2)


def test_no_contour_round_a_line_into_a_corner():
    straight, corner = line((5, 20), (1, 0), 55), line((14, 21), (-1, 1), 4)
    (with_it,) = contours_of(straight, corner, min_branch=0.0)
    (without,) = contours_of(straight, corner, min_branch=1.5)
    assert with_it.points[:, 1].max() == 25.5
    assert without.points[:, 1].max() == 21.5


def test_a_contour_inside_a_loop_starts_at_a_junction():
    sides = (line((20, 20), (1, 0), 30), line((20, 50), (1, 0), 31), line((20, 20), (0, 1), 30), line((50, 20), (0, 1), 30))
    inside = min(contours_of(*sides, line((51, 41), (1, 0), 30)), key=lambda path: len(path.points))
    assert np.ptp(inside.points, axis=0).tolist() == [28, 28]
    assert np.abs(inside.points[0] - (50.5, 41.5)).max() <= 2


def test_contours_are_refused_in_3d():
    coords = np.zeros((3, 3), dtype=np.int64)
    coords[:, 0] = range(3)
    with refuses("config-mode", kind=ConfigError):
        traverse(Skeleton(coords, coords.astype(float)), empty_scene(), TraverseConfig(method="contours"))


def test_the_record_of_contours_counts_the_pixels_of_spurs():
    straight, corner = line((5, 20), (1, 0), 55), line((14, 21), (-1, 1), 4)
    coords = np.unique(np.concatenate((straight, corner)), axis=0)
    config = TraverseConfig(method="contours", min_branch=1.5)
    traversal = traverse(Skeleton(coords, coords + 0.5), empty_scene(radius=4.0), config)
    assert traversal.spur_length == 4
    assert len(traversal.paths) == 1

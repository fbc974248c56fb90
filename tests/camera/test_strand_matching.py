"""Strands of the left image get their disparity from the right one, to a fraction of a pixel."""

from __future__ import annotations

import numpy as np
import pytest
from builders.pairs import BASELINE, CAMERA, RADIUS, drawn_pair, wave

from doo3d.camera.strand_matching import MAX_MISFIT, match_strands


def matched(curves, rows=0.0, hide=None, mask=None):
    images = drawn_pair(curves, rows)
    right = images.right.copy()
    if hide is not None:
        right[:, hide] = 230
    lines = [CAMERA.project(curve)[::20] for curve in curves]
    radii = [CAMERA.fx * RADIUS / curve[::20, 2] for curve in curves]
    return match_strands(lines, radii, images.left.astype(np.float32), right.astype(np.float32), CAMERA.fx, mask)


def errors(strand, curve):
    """Disparity minus the true one at the nearest point of the curve, px."""
    pixels = CAMERA.project(curve)
    nearest = np.linalg.norm(strand.points[:, None] - pixels[None], axis=2).argmin(axis=1)
    return strand.disparity - CAMERA.fx * BASELINE / curve[nearest, 2]


@pytest.mark.parametrize("rise", [0.0, 0.15])
def test_a_strand_is_matched_to_a_fifth_of_a_pixel(rise):
    curve = wave(rise=rise)
    strands, row = matched([curve])
    assert np.abs(errors(strands[0], curve)).max() < 0.2
    assert abs(row) < 0.1
    assert (strands[0].misfit < MAX_MISFIT).mean() > 0.95


def test_rows_that_the_calibration_misses_are_found_and_do_not_move_the_strand():
    curve = wave()
    strands, row = matched([curve], rows=0.8)
    assert row == pytest.approx(0.8, abs=0.15)
    assert np.abs(errors(strands[0], curve)).max() < 0.4


def test_equal_strands_side_by_side_are_not_confused():
    curves = [wave(shift=-0.015), wave(shift=0.015)]
    strands, _ = matched(curves)
    for strand, curve in zip(strands, curves, strict=True):
        assert np.abs(errors(strand, curve)).max() < 0.5


def test_a_stretch_along_the_rows_gets_its_disparity_from_its_ends():
    t = np.linspace(0.0, 1.0, 1500)
    curve = np.column_stack((-0.08 + 0.24 * t, 0.04 * np.clip(np.abs(t - 0.5) * 4 - 1, 0, None), np.full(len(t), 0.7)))
    strands, _ = matched([curve])
    assert np.abs(errors(strands[0], curve)).max() < 0.6


def test_a_stretch_hidden_in_the_right_image_is_bridged_and_said_to_be_unseen():
    curve = wave()
    strands, _ = matched([curve], hide=slice(200, 230))
    unseen = strands[0].misfit >= MAX_MISFIT
    at = strands[0].points[:, 0] - strands[0].disparity
    assert unseen[(at > 203) & (at < 227)].all()
    assert not unseen[(at < 190) | (at > 240)].any()
    assert np.abs(errors(strands[0], curve)).max() < 1.0


def test_a_mask_of_the_right_image_keeps_strands_from_other_things():
    curve, other = wave(), wave(depth=0.7, shift=0.02)
    images = drawn_pair([curve])
    both = drawn_pair([curve, other])
    lines, radii = [CAMERA.project(curve)[::20]], [CAMERA.fx * RADIUS / curve[::20, 2]]
    left, right = images.left.astype(np.float32), both.right.astype(np.float32)
    strands, _ = match_strands(lines, radii, left, right, CAMERA.fx, images.right_mask)
    assert np.abs(errors(strands[0], curve)).max() < 0.5

"""Right in the image: the same rule for chains and cables projected, so that depth does not count."""

import numpy as np
import pytest
from builders.chains import along

from doo3d.evaluation.metrics.image import project
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.scenes.model import Truth
from doo3d.types import Camera

CAMERA = Camera(900.0, 900.0, 640.0, 360.0, 1280, 720)
X = np.linspace(-0.15, 0.15, 601)
AXIS = np.column_stack((X, 0.03 * np.sin(20 * X), np.full(601, 0.6)))
TRUTH = Truth(AXIS, 0.004)


def test_depth_alone_does_not_count():
    farther = AXIS * (1 + 0.15 * np.sin(30 * X))[:, None]  # along the line of sight: up to 90 mm off
    got = score([along(farther)], [TRUTH], camera=CAMERA)
    assert not got.correct
    assert got.image_correct
    assert got.image_rms < 1.5


def test_what_is_beside_the_cable_in_the_image_is_wrong():
    got = score([along(AXIS + np.array([0, 0.03, 0]))], [TRUTH], camera=CAMERA)
    assert (got.correct, got.image_correct) == (False, False)
    near = score([along(AXIS + np.array([0, 0.002, 0]))], [TRUTH], camera=CAMERA)
    assert (near.correct, near.image_correct) == (True, True)
    assert near.image_rms == pytest.approx(0.002 * 900 / 0.6, rel=0.2)


@pytest.mark.parametrize("chains", [[], [along(AXIS), along(AXIS)], [along(AXIS[:300])]])
def test_the_rule_is_the_one_of_the_frame(chains):
    got = score(chains, [TRUTH], camera=CAMERA)
    assert (got.correct, got.image_correct) == (False, False)


def test_a_jump_between_strands_is_wrong_in_the_image_too():
    other = Truth(AXIS + np.array([0, 0.05, 0]), 0.004)
    a, b = np.array_split(AXIS, 2)
    crossed = [np.vstack((a, b + np.array([0, 0.05, 0]))), np.vstack((a + np.array([0, 0.05, 0]), b))]
    assert score([along(TRUTH.axis), along(other.axis)], [TRUTH, other], camera=CAMERA).image_correct
    assert not score([along(line) for line in crossed], [TRUTH, other], camera=CAMERA).image_correct


def test_without_a_camera_nothing_is_said():
    got = score([along(AXIS)], [TRUTH])
    assert got.image_correct is None
    assert np.isnan(got.image_rms)


def test_no_cables_and_no_chains_are_right():
    assert score([], [], camera=CAMERA).image_correct
    assert not score([along(AXIS)], [], camera=CAMERA).image_correct


def test_a_closed_ring_is_right_in_the_image():
    angle = np.linspace(0, 2 * np.pi, 1200, endpoint=False)
    ring = np.column_stack((0.1 * np.cos(angle), 0.1 * np.sin(angle), 0.6 + 0.02 * np.sin(angle)))
    found = along(np.vstack((ring, ring[:1])))
    got = score([found], [Truth(ring, 0.004, closed=True)], camera=CAMERA)
    assert got.correct
    assert got.image_correct


def test_lengths_are_pixels_at_the_median_depth():
    view = project([along(AXIS)], [TRUTH], CAMERA)
    assert view.metres_per_pixel == pytest.approx(0.6 / 900)
    assert (view.truths[0].axis[:, 2] == 0).all()
    assert view.truths[0].length == pytest.approx(TRUTH.length, rel=1e-3)
    assert view.truths[0].radius == pytest.approx(0.004)


def test_a_chain_along_the_line_of_sight_and_one_behind_the_camera():
    sight = np.column_stack((np.zeros(50), np.zeros(50), np.linspace(0.5, 0.9, 50)))
    assert len(project([along(sight)], [TRUTH], CAMERA).chains) == 1
    behind = score([along(AXIS - np.array([0, 0, 1.0]))], [TRUTH], camera=CAMERA)
    assert not behind.image_correct


@pytest.mark.parametrize("depth", [0.41, 0.6, 0.77])
def test_the_projected_chain_reaches_both_ends(depth):
    axis = AXIS * (1, 1, depth / 0.6)
    found = along(axis)
    (flat,) = project([found], [TRUTH], CAMERA).chains
    pixels = CAMERA.project(found.joints) * 0.6 / 900
    assert np.linalg.norm(flat.joints[[0, -1], :2] - pixels[[0, -1]], axis=1).max() < 0.003

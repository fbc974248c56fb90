"""The facts of a mask, against plain NumPy and against the kernels of single facts."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from doo3d import kernels
from doo3d.geometry.mask import median_half_width
from doo3d.scene.frame_facts import FrameFacts


def noisy_mask(seed, blur=2.0, shape=(60, 90)):
    noise = cv2.GaussianBlur(np.random.default_rng(seed).random(shape), (0, 0), blur)
    mask = np.zeros((shape[0] + 30, shape[1] + 40), bool)
    mask[10:-20, 25:-15] = noise > np.quantile(noise, 0.7)
    return mask


@pytest.mark.parametrize("seed", range(4))
def test_box_pixels_and_axis_are_those_of_the_mask(seed):
    mask = noisy_mask(seed)
    facts = FrameFacts(mask)
    rows, columns = np.nonzero(mask)
    assert facts.box == (rows.min(), rows.max() + 1, columns.min(), columns.max() + 1)
    assert mask[facts.slices].sum() == facts.count == mask.sum()
    np.testing.assert_array_equal(facts.pixels, np.argwhere(mask.T))
    for found, expected in zip(facts.axis, kernels.medial_axis(mask), strict=True):
        np.testing.assert_array_equal(found, expected - 0.5 if expected.dtype == np.float32 else expected)


@pytest.mark.parametrize("seed", range(4))
def test_the_skeleton_is_that_of_thinning(seed):
    mask = noisy_mask(seed, blur=1.0 + seed)
    mask[2, 3] = mask[-1, -1] = True  # pixels without neighbours stay
    inside = np.argwhere(mask)
    expected = inside[kernels.thin_pixels(inside + 1)]
    facts = FrameFacts(mask)
    assert facts.skeleton_pixels()[:, ::-1].tolist() == expected.tolist()
    pixels, bounds = facts.skeleton
    assert set(map(tuple, pixels[:, ::-1].tolist())) <= set(map(tuple, expected.tolist()))
    assert (bounds[0], bounds[-1]) == (0, len(pixels))


def test_depth_of_another_shape_or_type_is_refused():
    mask = noisy_mask(0)
    with pytest.raises(ValueError, match="different shapes"):
        FrameFacts(mask, np.ones((3, 4), np.float32))
    with pytest.raises(TypeError):
        FrameFacts(mask, np.ones(mask.shape))


def test_the_radius_of_the_facts_is_that_of_the_mask():
    mask = noisy_mask(0)
    depth = np.random.default_rng(0).uniform(0.4, 0.6, mask.shape).astype(np.float32)
    depth[::3] = 0
    rows, columns, inside = kernels.medial_axis(mask)
    assert FrameFacts(mask).radius() == median_half_width(inside - 0.5)
    scale = depth[rows, columns] / 500.0
    assert FrameFacts(mask, depth).radius(500.0) == median_half_width((inside[scale > 0] - 0.5) * scale[scale > 0])


def test_nothing_follows_from_an_empty_mask():
    facts = FrameFacts(np.zeros((5, 7), bool), np.ones((5, 7), np.float32), 4)
    assert (facts.count, facts.box, facts.radius(500.0), facts.median_depth) == (0, (0, 0, 0, 0), 0.0, 0.0)
    assert len(facts.pixels) == len(facts.skeleton[0]) == 0


def test_a_mask_without_small_regions_is_kept_as_it_is():
    mask = np.zeros((40, 50), bool)
    mask[10:20, 5:45] = True
    assert np.shares_memory(FrameFacts(mask, min_pixels=30).mask, mask)
    mask[2, 2] = True
    facts = FrameFacts(mask, min_pixels=30)
    assert not facts.mask[2, 2]
    assert not facts.mask.flags.writeable
    assert facts.removed == 1


def test_facts_cost_what_the_object_costs():
    """A frame around the mask four times as large gives the same facts."""
    mask = noisy_mask(1)
    wide = np.pad(mask, ((40, 60), (70, 65)))
    small, large = FrameFacts(mask), FrameFacts(wide)
    np.testing.assert_array_equal(small.axis[2], large.axis[2])
    np.testing.assert_array_equal(small.skeleton[0] + (70, 40), large.skeleton[0])


@pytest.mark.parametrize("reach", [1, 4, 200])
@pytest.mark.parametrize("seed", range(3))
def test_cores_against_a_dilation(seed, reach):
    mask = noisy_mask(seed)
    facts = FrameFacts(mask)
    pixels = np.random.default_rng(seed).integers((0, 0), mask.shape[::-1], (3000, 2))
    distance = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    largest = cv2.dilate(distance, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
    away = distance - np.minimum(0.7 * largest, largest - 1.5)
    core, decided = (distance > 0) & (away >= 0), np.abs(away) > 1e-3  # OpenCV's numbers have 16 bits after the point
    of_pixels = (pixels[:, 1], pixels[:, 0])
    found = facts.core_pixels(pixels, reach, 0.7, 1.5)
    np.testing.assert_array_equal(found[decided[of_pixels]], core[of_pixels][decided[of_pixels]])


@pytest.mark.parametrize("reach", [0, 1, 3])
def test_holes_of_the_depth_against_dilations(reach):
    mask = noisy_mask(3)
    random = np.random.default_rng(reach)
    blotches = cv2.GaussianBlur(random.normal(size=mask.shape), (0, 0), 3) > 0
    depth = np.where(blotches & (random.random(mask.shape) < 0.9), 0.5, 0).astype(np.float32)
    kept = mask & (depth > 0) & (random.random(mask.shape) < 0.9)
    square = np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)
    empty = mask & (depth == 0)
    far = empty & (cv2.dilate(kept.astype(np.uint8), square) == 0)
    expected = np.argwhere(empty & (cv2.dilate(far.astype(np.uint8), square) > 0))[:, ::-1]
    found = FrameFacts(mask, depth).depth_holes(np.ascontiguousarray(np.argwhere(kept)[:, ::-1]), reach)
    assert len(expected) > 10
    assert found.tolist() == expected.tolist()


@pytest.mark.parametrize(
    ("deviation", "step"), [(0.1, 0), (1, 0), (0, 0.25), (0.1, 0.25), (1, 0.25), (0, 1), (0.1, 1), (0.3, 1), (0.5, 1), (1, 1)]
)
def test_the_noise_of_inverse_depth_has_noise_and_rounding(deviation, step):
    """A slope of a stereo camera's disparity with noise, rounded to a subpixel step; both in units of 0.002 / m."""
    random, unit = np.random.default_rng(1), 0.002
    inverse = 1000 + 0.07 * np.arange(120) + random.uniform(0, 1, (90, 1)) + deviation * random.normal(size=(90, 120))
    depth = 1 / (unit * (inverse if not step else step * np.rint(inverse / step)))
    depth[random.random(depth.shape) < 0.1] = 0
    depth[:, 60:] *= 1.2  # another strand behind the first
    found = FrameFacts(np.ones(depth.shape, bool), depth.astype(np.float32)).inverse_depth_noise
    assert found == pytest.approx(unit * np.hypot(deviation, step / np.sqrt(12)), rel=0.3)


@pytest.mark.parametrize("seed", range(20))
def test_middle_pixels_are_near_the_skeleton_also_outside_of_the_mask(seed):
    random = np.random.default_rng(seed)
    mask = np.pad(random.random((20, 30)) < random.uniform(0.1, 1), 8)
    facts, reach = kernels.FrameFacts(mask), random.uniform(0, 9)
    skeleton = np.zeros_like(mask)
    u, v = facts.skeleton_pixels().T
    skeleton[v, u] = True
    pixels = np.argwhere(np.ones_like(mask))[:, ::-1].copy()
    expected = cv2.distanceTransform((~skeleton).view(np.uint8), cv2.DIST_L2, 5) < reach - 1e-4
    np.testing.assert_array_equal(facts.middle_pixels(pixels, reach), expected[pixels[:, 1], pixels[:, 0]])
    assert not kernels.FrameFacts(np.zeros_like(mask)).middle_pixels(pixels, reach).any()

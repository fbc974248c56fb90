"""Junctions against crossings in masks: drawn ones, turned and scaled, and those of a real harness."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders.paths import DATA

from doo3d import Image, detect, load_config
from doo3d.geometry.mask import half_widths
from doo3d.segment.mask_image import object_in_mask_image

CONFIG = load_config("image", {"merge.branches": True})
HARNESS = DATA / "branched" / "masks"
TRUNK = ([(-250, 0), (250, 0)], 11)


def curve(*points):
    t = np.linspace(0, 1, 200)[:, None]
    p = np.array(points, dtype=float)
    if len(p) == 2:
        return p[0] + (p[1] - p[0]) * t
    return (1 - t) ** 3 * p[0] + 3 * (1 - t) ** 2 * t * p[1] + 3 * (1 - t) * t**2 * p[2] + t**3 * p[3]


SHAPES = {
    "Y": ([TRUNK, ([(-20, 0), (130, -170)], 6)], [(-20, 0)], []),
    "Y of three arms": (
        [([(-200, 0), (0, 0)], 8), ([(0, 0), (160, -110)], 8), ([(0, 0), (160, 110)], 8)], [(0, 0)], []
    ),
    "Y that crosses itself": ([TRUNK, ([(-150, 0), (-130, 250), (90, 190), (160, -170)], 5)], [(-150, 0)], [(101, 0)]),
    "T": ([TRUNK, ([(0, 0), (0, 200)], 6)], [(0, 0)], []),
    "T of one width": ([([(-250, 0), (250, 0)], 8), ([(0, 0), (0, 200)], 8)], [(0, 0)], []),
    "X": ([([(-200, -120), (200, 120)], 9), ([(-200, 130), (200, -110)], 9)], [], [(8, 5)]),
    "X, thin over thick": ([TRUNK, ([(-60, -180), (60, 180)], 5)], [], [(0, 0)]),
    "K": ([TRUNK, ([(0, 0), (-140, 160)], 6), ([(0, 0), (140, 160)], 6)], [(0, 0)], []),
    "two T opposite": ([TRUNK, ([(-60, 0), (-60, 180)], 6), ([(60, 0), (60, -180)], 6)], [(-60, 0), (60, 0)], []),
    "arrow": ([TRUNK, ([(0, 0), (150, 130)], 6), ([(0, 0), (150, -130)], 6)], [(0, 0)], []),
}  # fmt: skip


def drawn(strands, turn, scale):
    """Return the mask of strands (points, radius px), turned by degrees and scaled, and the mapping of points into it."""
    angle, size = np.radians(turn), int(640 * scale)
    matrix = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    def placed(points):
        return np.asarray(points, dtype=float).reshape(-1, 2) @ matrix.T + size / 2

    mask = np.zeros((size, size), np.uint8)
    for points, radius in strands:
        line = np.round(placed(curve(*points)) * 16).astype(np.int32)
        cv2.polylines(mask, [line], False, 255, max(1, round(2 * radius * scale)), cv2.LINE_8, 4)
    return mask, placed


def are_at(found, truth, tolerance):
    """Tell whether as many places were found as there are, and one near each."""
    return len(found) == len(truth) and all(np.linalg.norm(np.array(found) - place, axis=1).min() < tolerance for place in truth)


@pytest.mark.parametrize("scale", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("turn", [0, 30, 75, 200])
@pytest.mark.parametrize("shape", SHAPES)
def test_drawn_masks(shape, turn, scale):
    strands, junctions, crossings = SHAPES[shape]
    mask, placed = drawn(strands, turn, scale)
    detection = detect(np.dstack([mask] * 3), CONFIG)
    assert are_at([each.position for each in detection.junctions], placed(junctions), 25 * scale)
    assert are_at([each.point for each in detection.crossings], placed(crossings), 25 * scale)


def test_chains_of_a_branch_have_the_width_of_the_branch():
    mask, _ = drawn(SHAPES["two T opposite"][0], 0, 1)
    detection = detect(np.dstack([mask] * 3), CONFIG)
    assert np.allclose(sorted(each.radius for each in detection.chains), [6, 6, 11, 11, 11], atol=1.2)


def test_a_connector_at_the_end_is_no_junction():
    """Thinning leads spurs to the corners of a region wider than the strand; at one angle two of them stay a doubtful chain."""
    chains = []
    for turn in range(0, 360, 30):
        mask, placed = drawn([TRUNK], turn, 1)
        corners = placed([(200, -45), (280, -45), (280, 45), (200, 45)])
        cv2.fillPoly(mask, [np.round(corners).astype(np.int32)], 255)
        detection = detect(np.dstack([mask] * 3), CONFIG)
        assert (len(detection.junctions), len(detection.crossings)) == (0, 0)
        chains.append(len(detection.chains))
    assert sorted(chains)[:11] == [1] * 11


def test_a_short_end_beyond_the_trunk_makes_a_crossing():
    mask, placed = drawn([TRUNK, ([(-20, -180), (-2, -18)], 5), ([(0, 0), (4, 32)], 5)], 20, 1)
    detection = detect(np.dstack([mask] * 3), CONFIG)
    assert not detection.junctions
    assert are_at([each.point for each in detection.crossings], placed([(0, 0)]), 15)


def test_an_image_that_is_a_mask_is_the_mask():
    mask, _ = drawn([TRUNK], 10, 1)
    image = np.dstack([mask] * 3)
    own, given = detect(image, "image"), detect(image, "image", mask > 0)
    assert np.array_equal(own.chains[0].joints, given.chains[0].joints)
    assert own.chains[0].radius == pytest.approx(11, abs=1)
    assert np.array_equal(object_in_mask_image(image // 255), mask > 0)
    assert object_in_mask_image(255 - image) is None
    assert object_in_mask_image(np.zeros_like(image)) is None
    colored, speck = image.copy(), image.copy()
    colored[..., 2] = 0
    speck[3, 3] = 7
    assert object_in_mask_image(colored) is None
    assert object_in_mask_image(speck) is None
    assert object_in_mask_image(np.zeros((0, 0, 3), np.uint8)) is None


def test_a_mask_that_the_image_shows_more_of_is_extended():
    mask, _ = drawn([TRUNK], 10, 1)
    part = mask > 0
    part[:, 400:] = False
    detection = detect(np.dstack([mask] * 3), "image", part)
    assert detection.chains[0].length > 350


def test_half_widths():
    mask = np.zeros((60, 80), bool)
    mask[20:41, 5:75] = True
    widths, (u, v) = half_widths(mask)
    assert np.allclose([widths[int(y - v), int(x - u)] for x, y in ((40, 30), (40, 25), (4, 19))], [10.5, 5.5, 0], atol=0.3)
    assert not half_widths(np.zeros((4, 4), bool))[0].any()


@pytest.mark.skipif(not HARNESS.is_dir(), reason="the masks of a real harness are not here")
@pytest.mark.parametrize("turn", [0, 30])
@pytest.mark.parametrize("name", [f"wh1_{i}_{state}" for i in range(0, 10, 2) for state in ("before", "after")])
def test_real_harness(name, turn):
    """One junction in each; in "before" the branch crosses the trunk as well."""
    mask = cv2.imread(str(HARNESS / f"{name}.png"), cv2.IMREAD_GRAYSCALE)
    matrix = cv2.getRotationMatrix2D((320, 240), turn, 1.0)
    matrix[:, 2] += 160, 240
    mask = cv2.warpAffine(mask, matrix, (960, 960), flags=cv2.INTER_NEAREST)
    detection = detect(Image(np.dstack([mask] * 3)), CONFIG)
    assert len(detection.junctions) == 1
    assert len(detection.crossings) == (1 if name.endswith("before") else 0)
    assert len(detection.objects) == 1

"""Strands that touch side by side are split in the mask; wide objects that are one are not."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders.drawn_masks import axis_error, frame_of
from scipy.spatial import cKDTree

import doo3d
from doo3d.pipeline import run_stages
from doo3d.scene.frame_facts import FrameFacts
from doo3d.segment.split_strands import split_strands
from doo3d.segment.wide_stretches import close_gaps, strand_radius
from doo3d.tools.scaling import draw_frame

SIZE = (240, 640)
MIDDLE = 120.0
RADIUS = 4.0


def fan(place, pitch=2 * RADIUS, spread=30.0):
    """Return a strand (P, 2) px of a bundle: `place` pitches beside its middle, and further apart towards both ends."""
    x = np.arange(30.0, 610.0)
    apart = np.clip(np.abs(x - 320) - 160, 0, None) ** 2 / 120**2
    return np.column_stack((x, MIDDLE + place * (pitch + spread * apart)))


def spiral(turns=4, pitch=2 * RADIUS):
    """Return a flat coil (P, 2) px whose outer end runs away, the turns touching."""
    angle = np.arange(0, 2 * np.pi * turns, 0.01)
    distance = 30 + pitch * angle / (2 * np.pi)
    curve = np.column_stack((320 + distance * np.cos(angle), MIDDLE + distance * np.sin(angle)))
    return np.vstack((curve, curve[-1] + np.arange(1, 120)[:, None] * np.array((0.25, 0.97))))


def knot():
    """Return a tight overhand knot (P, 2) px."""
    t = np.linspace(-2.6, 2.6, 4000)
    return np.column_stack((320 + 16 * t**3 - 60 * t, MIDDLE + 30 * np.sin(1.2 * t**2)))


def drawn(strands, radii, shaded=True):
    """Return the mask (H, W) and the picture of strands, round ones if shaded, and which strand each pixel shows (-1: none)."""
    v, u = np.mgrid[: SIZE[0], : SIZE[1]]
    pixels = np.column_stack((u.ravel(), v.ravel()))
    share = np.array([cKDTree(line).query(pixels)[0] / radius for line, radius in zip(strands, radii, strict=True)])
    which, nearest = share.argmin(axis=0).reshape(SIZE), share.min(axis=0).reshape(SIZE)
    mask = nearest <= 1
    shade = 60 + 150 * np.sqrt(np.clip(1 - nearest**2, 0, 1)) if shaded else np.full(SIZE, 180.0)
    noise = np.random.default_rng(0).normal(0, 4 * shaded, SIZE)
    gray = np.clip(np.where(mask, shade, 120) + noise, 0, 255).astype(np.uint8)
    return mask, np.repeat(gray[..., None], 3, axis=2), np.where(mask, which, -1)


def pieces(mask, which):
    """Return the number of pieces of at least 50 pixels, and the least share of a piece that shows one strand."""
    count, label = cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)
    large = [label == k for k in range(1, count) if np.count_nonzero(label == k) >= 50]
    return len(large), min(np.bincount(which[piece]).max() / np.count_nonzero(piece) for piece in large)


@pytest.mark.parametrize(
    ("count", "shaded"),
    [(2, True), (3, True), (4, True), pytest.param(2, False, id="2-mask alone"), pytest.param(3, False, id="3-mask alone")],
)
def test_strands_of_a_bundle_are_pieces_of_their_own(count, shaded):
    strands = [fan(k - (count - 1) / 2) for k in range(count)]
    mask, color, which = drawn(strands, [RADIUS] * count, shaded)
    found = split_strands(FrameFacts(mask), None, color, None)
    number, purity = pieces(found.mask, which)
    assert number == count
    assert purity > 0.95
    assert found.removed == np.count_nonzero(mask) - np.count_nonzero(found.mask) < 0.2 * np.count_nonzero(mask)
    assert found.side_by_side.size


def test_a_thick_and_a_thin_strand():
    thick, thin = fan(-1, 7.0), fan(1, 7.0)
    mask, color, which = drawn([thick, thin], [10.0, RADIUS])
    number, purity = pieces(split_strands(FrameFacts(mask), None, color, None).mask, which)
    assert number == 2
    assert purity > 0.95


def test_turns_of_a_coil_part():
    mask, color, _ = drawn([spiral()], [RADIUS])
    found = split_strands(FrameFacts(mask), None, color, None)
    before, after = (cv2.distanceTransform(m.astype(np.uint8), cv2.DIST_L2, 5).max() for m in (mask, found.mask))
    assert before > 2 * RADIUS
    assert after < 1.6 * RADIUS


def test_depth_parts_strands_without_color():
    offset = (320, MIDDLE)
    axes = [np.column_stack((5e-4 * (fan(place, 10.0) - offset), np.full(580, 0.5))) for place in (-0.5, 0.5)]
    frame, mask = frame_of(*axes, radius=0.0025)
    chains = doo3d.detect(frame, doo3d.load_config("default", {"merge.chains": 2}), mask=mask).chains
    assert len(chains) == 2
    for axis in axes:
        error = min((axis_error(chain, axis) for chain in chains), key=lambda error: error.rms)
        assert error.rms < 0.001
        assert error.uncovered < 0.01
    assert all(chain.radius == pytest.approx(0.0025, rel=0.15) for chain in chains)


def test_a_bundle_in_2d():
    strands = [fan(k - 1) for k in range(3)]
    mask, color, _ = drawn(strands, [RADIUS] * 3)
    chains = doo3d.detect(color, doo3d.load_config("image", {"merge.chains": 3}), mask=mask).chains
    assert len(chains) == 3
    for strand in strands:
        tree = cKDTree(strand)
        assert min(tree.query(chain.nodes(100))[0].max() for chain in chains) < 1.5 * RADIUS


@pytest.mark.parametrize("shaded", [True, False], ids=["image", "mask alone"])
@pytest.mark.parametrize("scene", ["strand", "plug", "knot", "crossing", "stripe", "far apart"])
def test_what_is_one_strand_is_left_alone(scene, shaded):
    line = np.column_stack((np.arange(30.0, 610.0), np.full(580, MIDDLE)))
    across = np.column_stack((np.full(180, 320.0), np.arange(30.0, 210.0)))
    strands, radii = {
        "strand": ([line], [RADIUS]),
        "plug": ([line[60:], line[:60]], [RADIUS, 3 * RADIUS]),
        "knot": ([knot()], [RADIUS]),
        "crossing": ([across, line], [RADIUS, 2.5 * RADIUS]),
        "stripe": ([line - (0, 60), line], [RADIUS, 3 * RADIUS]),
        "far apart": ([fan(-0.5, 3.5 * RADIUS), fan(0.5, 3.5 * RADIUS)], [RADIUS, RADIUS]),
    }[scene]
    mask, color, _ = drawn(strands, radii, shaded)
    if scene == "stripe":
        color[round(MIDDLE) - 1 : round(MIDDLE) + 2] //= 3
    found = split_strands(FrameFacts(mask), None, color, None)
    assert np.shares_memory(found.mask, mask)
    assert found.removed == 0
    assert not found.side_by_side.size


def test_the_radius_of_one_strand_is_that_of_the_thinnest_stretches():
    widths = np.concatenate((np.full(20, 3.0), np.full(80, 9.0)))
    assert strand_radius(widths) == pytest.approx(3.0, rel=0.05)
    assert strand_radius(np.concatenate((np.full(5, 3.0), np.full(95, 9.0)))) == pytest.approx(9.0, rel=0.05)
    assert strand_radius(np.zeros(0)) == 0


def test_gaps_are_closed_and_nothing_is_added_at_the_border():
    mask = np.zeros((9, 30), dtype=bool)
    mask[:, [1, 8, 12]] = True
    expected = mask.copy()
    expected[1:-1, 8:13] = True
    closed = close_gaps(mask, 2)
    assert not (mask & ~closed).any()
    np.testing.assert_array_equal(closed[1:-1], expected[1:-1])


def test_an_empty_mask_stays_empty():
    mask = np.zeros((20, 30), dtype=bool)
    assert np.shares_memory(split_strands(FrameFacts(mask), None, None, None).mask, mask)


def test_fifty_rows_of_cables_with_gaps_between_them_are_not_cut_by_valleys() -> None:
    frame, mask, _ = draw_frame("cables", 50)
    split = split_strands(FrameFacts(mask, frame.depth), None, frame.color, frame.depth)
    assert split.removed == 0
    assert split.side_by_side.size
    assert len(run_stages(frame, doo3d.load_config(), mask).pruned.chains) == 50

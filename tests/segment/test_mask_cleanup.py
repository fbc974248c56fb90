"""Small components, small holes and wide regions removed from a mask."""

from __future__ import annotations

import numpy as np
import pytest
from builders.blue_cable import BLUE, DEPTH, SEEN, frame, painted, scene_of
from scipy.ndimage import binary_fill_holes, gaussian_filter, label

from doo3d.config import SegmentConfig
from doo3d.scene.frame_facts import FrameFacts
from doo3d.segment.mask_cleanup import remove_wide_regions


@pytest.mark.parametrize("given", [True, False])
def test_specks_are_removed_and_pinholes_closed(given):
    random = np.random.default_rng(0)
    specks = (random.random(SEEN.shape) < 0.003) & ~SEEN
    specks[100:104, 100:104] = True
    holes = (random.random(SEEN.shape) < 0.02) & SEEN
    mask = (SEEN | specks) & ~holes
    found = scene_of(frame(np.where(DEPTH > 0, DEPTH, 0.5), painted(mask)), BLUE, mask if given else None)
    assert not found.mask[100:104, 100:104].any()
    assert (found.mask & ~SEEN).sum() < 0.1 * specks.sum()
    assert (SEEN & ~found.mask).sum() < 0.3 * holes.sum()


def slow_removal(mask, least):
    """A piece is as large as it is with its holes filled."""
    pieces, count = label(mask, np.ones((3, 3)))
    sizes = np.array([0] + [binary_fill_holes(pieces == k).sum() for k in range(1, count + 1)])
    result = mask & (sizes[pieces] >= least)
    holes, _ = label(~np.pad(result, 1))
    small = np.bincount(holes.ravel())[holes] < least
    return result | (~np.pad(result, 1) & small)[1:-1, 1:-1]


@pytest.mark.parametrize("least", [1, 2, 5, 20])
@pytest.mark.parametrize("seed", range(5))
def test_small_components_and_holes_against_labels(seed, least):
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=(60, 80)), 0.8)
    mask = noise > np.quantile(noise, 0.8 - 0.12 * seed)
    expected = slow_removal(mask, least)
    facts = FrameFacts(mask, min_pixels=least)
    np.testing.assert_array_equal(facts.image(), expected)
    assert (facts.selected, facts.removed, facts.filled) == (mask.sum(), (mask & ~expected).sum(), (expected & ~mask).sum())
    assert facts.count == expected.sum()


def test_a_wide_region_is_not_the_object():
    """A blue gripper beside a blue cable; but a mask that the caller gives is taken as it is."""
    mask = SEEN.copy()
    mask[300:420, 200:360] = True
    data = frame(np.where(mask & ~SEEN, 0.45, DEPTH), painted(mask))
    found = scene_of(data, BLUE)
    assert not found.mask[305:415, 205:355].any()
    assert (found.mask & SEEN).sum() > 0.9 * SEEN.sum()
    assert scene_of(data, BLUE, mask).mask[305:415, 205:355].all()
    everything = scene_of(frame(np.where(mask & ~SEEN, 0.45, DEPTH)), SegmentConfig(method="everything"))
    assert everything.mask[305:415, 205:355].all()


def test_a_plug_of_the_color_of_its_cable_goes():
    strands, plug = np.zeros((200, 400), dtype=bool), np.zeros((200, 400), dtype=bool)
    for row in (10, 30, 50, 70):
        strands[row : row + 7, 20:380] = True
    strands[172:179, 20:300] = True
    plug[160:190, 300:340] = True
    left = remove_wide_regions(FrameFacts(strands | plug), SegmentConfig(max_width=np.inf)).mask
    assert not left[168:182, 305:335].any()
    assert left[172:179, 20:280].all()

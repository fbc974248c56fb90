"""Masks extended along strands that an image shows beyond them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders.contexts import context_of

import doo3d
from doo3d.config import ExtendMaskConfig
from doo3d.pipeline import run_with_stages
from doo3d.segment.extend_mask import extend_mask
from doo3d.types import Chain, Foreground

WIDTH, HEIGHT, RADIUS = 300, 160, 5
CONFIG = ExtendMaskConfig(max_length=100)
U = np.arange(-20.0, WIDTH + 20)
LINE = np.column_stack((U, 80 + 30 * np.sin(U / 60)))


def strand(line=LINE, thick=2 * RADIUS):
    points = np.round(line * 16).astype(np.int32)
    return cv2.polylines(np.zeros((HEIGHT, WIDTH), np.uint8), [points], False, 1, thick, cv2.LINE_8, 4) > 0


def photograph(shown, color=(60, 50, 140)):
    image = np.random.default_rng(0).normal((170, 160, 150), 4, (HEIGHT, WIDTH, 3))
    image[shown] = np.random.default_rng(1).normal(color, 4, (shown.sum(), 3))
    return image.clip(0, 255).astype(np.uint8)


def chain(until=140.0):
    """Along the line from the left border to u = until."""
    part = LINE[(LINE[:, 0] >= 0) & (LINE[:, 0] <= until)]
    joints = [part[0]]
    for place in part:
        if np.linalg.norm(place - joints[-1]) >= 10:
            joints.append(joints[-1] + 10 * (place - joints[-1]) / np.linalg.norm(place - joints[-1]))
    return Chain(np.array(joints), 10.0, radius=float(RADIUS))


def foreground(image, mask):
    return Foreground(np.argwhere(mask)[:, ::-1].astype(float), mask=mask, color=image)


def before(mask, until):
    return mask & (np.arange(WIDTH) < until)


def dice(one, other):
    return 2 * (one & other).sum() / (one.sum() + other.sum())


def test_a_strand_goes_on_to_the_border():
    whole = strand()
    mask = before(whole, 140)
    found = extend_mask([chain()], context_of(foreground(photograph(whole), mask)), CONFIG)
    assert found is not None
    assert dice(found, whole) > 0.93 > dice(mask, whole)
    assert not (mask & ~found).any()


def test_it_ends_at_the_length_set_or_with_the_strand():
    whole = strand()
    near = extend_mask([chain()], context_of(foreground(photograph(whole), before(whole, 140))), ExtendMaskConfig(max_length=10))
    assert 140 + 5 * RADIUS < np.nonzero(near)[1].max() < 140 + 15 * RADIUS
    ended = before(whole, 200)
    found = extend_mask([chain()], context_of(foreground(photograph(ended), before(whole, 140))), CONFIG)
    assert abs(np.nonzero(found)[1].max() - 200) <= 3 * RADIUS


def test_a_mask_that_misses_nothing_stays():
    ended = before(strand(), 140)
    assert extend_mask([chain()], context_of(foreground(photograph(ended), ended)), CONFIG) is None
    assert extend_mask([], context_of(foreground(photograph(ended), ended)), CONFIG) is None
    assert extend_mask([chain()], context_of(foreground(photograph(strand()), ended)), ExtendMaskConfig()) is None  # not wanted


def test_a_background_of_the_same_color_is_not_the_strand():
    whole = strand()
    image = photograph(whole)
    image[:, 140:] = photograph(np.ones_like(whole))[:, 140:]
    assert extend_mask([chain()], context_of(foreground(image, before(whole, 140))), CONFIG) is None


@pytest.mark.parametrize(("width", "over"), [(20, True), (90, False)])
def test_a_narrow_occluder_is_jumped(width, over):
    whole = strand()
    image = photograph(whole)
    image[:, 160 : 160 + width] = (20, 120, 30)
    found = extend_mask([chain()], context_of(foreground(image, before(whole, 140))), CONFIG)
    assert (np.nonzero(before(whole, WIDTH) if found is None else found)[1].max() == WIDTH - 1) == over


def test_a_light_that_changes_along_it_is_followed():
    whole = strand()
    image = (photograph(whole) * np.linspace(1, 0.45, WIDTH)[:, None]).astype(np.uint8)
    assert dice(extend_mask([chain()], context_of(foreground(image, before(whole, 140))), CONFIG), whole) > 0.93


def test_without_a_color_image_and_in_3d_there_is_nothing_to_extend():
    assert extend_mask([chain()], context_of(Foreground(np.zeros((1, 2)), mask=strand())), CONFIG) is None
    deep = Foreground(np.zeros((1, 3)), mask=strand(), color=photograph(strand()))
    assert extend_mask([Chain(np.array([[0.0, 0, 1], [0.01, 0, 1]]), 0.01, radius=0.005)], context_of(deep), CONFIG) is None


def test_in_the_preset_image_remnants_become_one_strand():
    whole = strand()
    u = np.arange(WIDTH)
    mask = whole & ((u < 80) | (u > 265))
    config = doo3d.load_config("image")
    assert config.merge.gap < 265 - 80
    _, stages = run_with_stages(photograph(whole), config, mask)
    (found,) = stages.chains
    assert np.abs(np.interp(found.joints[:, 0], *LINE.T) - found.joints[:, 1]).max() < 2
    assert np.ptp(found.joints[:, 0]) > WIDTH - 12
    assert (stages.segmentation.method, stages.segmentation.base.method) == ("extended", "mask")
    assert stages.segmentation.selected > stages.segmentation.base.selected == mask.sum()
    short = doo3d.detect(photograph(whole), doo3d.load_config("image", {"extend_mask.max_length": 0}), mask)
    assert all(np.ptp(chain.joints[:, 0]) < 100 for chain in short.chains)

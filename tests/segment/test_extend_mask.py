"""Masks extended along strands that an image shows beyond them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders.scenes import frame_scene, image_scene

import doo3d
from doo3d.pipeline import run_stages
from doo3d.segment.extend_mask import extend_mask
from doo3d.types import Camera, Chain, Frame

WIDTH, HEIGHT, RADIUS = 300, 160, 5
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


def extended(chains, image, mask, max_length=100.0):
    return extend_mask(chains, image_scene(mask, image, extend_mask__max_length=max_length))


def before(mask, until):
    return mask & (np.arange(WIDTH) < until)


def dice(one, other):
    return 2 * (one & other).sum() / (one.sum() + other.sum())


def test_a_strand_goes_on_to_the_border():
    whole = strand()
    mask = before(whole, 140)
    found = extended([chain()], photograph(whole), mask)
    assert found is not None
    assert dice(found, whole) > 0.93 > dice(mask, whole)
    assert not (mask & ~found).any()


def test_it_ends_at_the_length_set_or_with_the_strand():
    whole = strand()
    near = extended([chain()], photograph(whole), before(whole, 140), max_length=10.0)
    assert 140 + 5 * RADIUS < np.nonzero(near)[1].max() < 140 + 15 * RADIUS
    ended = before(whole, 200)
    found = extended([chain()], photograph(ended), before(whole, 140))
    assert abs(np.nonzero(found)[1].max() - 200) <= 3 * RADIUS


def test_a_mask_that_misses_nothing_stays():
    ended = before(strand(), 140)
    assert extended([chain()], photograph(ended), ended) is None
    assert extended([], photograph(ended), ended) is None
    assert extended([chain()], photograph(strand()), ended, max_length=0.0) is None  # not wanted


def test_a_background_of_the_same_color_is_not_the_strand():
    whole = strand()
    image = photograph(whole)
    image[:, 140:] = photograph(np.ones_like(whole))[:, 140:]
    assert extended([chain()], image, before(whole, 140)) is None


@pytest.mark.parametrize(("width", "over"), [(20, True), (90, False)])
def test_a_narrow_occluder_is_jumped(width, over):
    whole = strand()
    image = photograph(whole)
    image[:, 160 : 160 + width] = (20, 120, 30)
    found = extended([chain()], image, before(whole, 140))
    assert (np.nonzero(before(whole, WIDTH) if found is None else found)[1].max() == WIDTH - 1) == over


def test_a_light_that_changes_along_it_is_followed():
    whole = strand()
    image = (photograph(whole) * np.linspace(1, 0.45, WIDTH)[:, None]).astype(np.uint8)
    assert dice(extended([chain()], image, before(whole, 140)), whole) > 0.93


def test_without_a_color_image_and_in_3d_there_is_nothing_to_extend():
    assert extend_mask([chain()], image_scene(strand(), extend_mask__max_length=100.0)) is None
    frame = Frame(photograph(strand()), np.ones((HEIGHT, WIDTH), np.float32), Camera(600.0, 600.0, 150.0, 80.0, WIDTH, HEIGHT))
    deep = frame_scene(frame, strand(), extend_mask__max_length=100.0)
    assert extend_mask([Chain(np.array([[0.0, 0, 1], [0.01, 0, 1]]), 0.01, radius=0.005)], deep) is None


def test_in_the_preset_image_remnants_become_one_strand():
    whole = strand()
    u = np.arange(WIDTH)
    mask = whole & ((u < 80) | (u > 265))
    config = doo3d.load_config("image")
    assert config.merge.gap < 265 - 80
    stages = run_stages(photograph(whole), config, mask)
    (found,) = stages.chains
    assert np.abs(np.interp(found.joints[:, 0], *LINE.T) - found.joints[:, 1]).max() < 2
    assert np.ptp(found.joints[:, 0]) > WIDTH - 12
    assert (stages.observed.segmentation.method, stages.observed.segmentation.base.method) == ("extended", "mask")
    assert stages.observed.segmentation.selected > stages.observed.segmentation.base.selected == mask.sum()
    short = doo3d.detect(photograph(whole), doo3d.load_config("image", {"extend_mask.max_length": 0}), mask)
    assert all(np.ptp(chain.joints[:, 0]) < 100 for chain in short.chains)

"""A stereo pair becomes a frame with depth on its strands, in which chains are found as in any other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders.errors import refuses
from builders.pairs import BASELINE, CAMERA, RADIUS, drawn_pair, stereo_pair, wave
from scipy.spatial import cKDTree

import doo3d
from doo3d.camera.stereo_depth import triangulate

CONFIG = doo3d.load_config()


def distances(chain, curve):
    """Distances of the chain's joints from the curve, m."""
    return cKDTree(curve).query(chain.joints)[0]


@pytest.fixture(scope="module")
def loaded():
    return triangulate(drawn_pair([wave(rise=0.1)]), stereo_pair().rectified(), CONFIG)


def test_the_frame_has_depth_on_the_strand_and_nowhere_else(loaded):
    seen = loaded.data.depth > 0
    assert not (seen & ~loaded.mask).any()
    assert (seen & loaded.mask).sum() > 0.95 * loaded.mask.sum()
    assert loaded.data.depth[seen].min() == pytest.approx(0.6 - RADIUS, abs=0.004)


def test_the_depth_is_that_of_the_front_of_the_strand(loaded):
    v, u = np.nonzero(loaded.data.depth)
    points = loaded.data.camera.unproject(np.column_stack((u, v)), loaded.data.depth[v, u])
    assert np.median(cKDTree(wave(rise=0.1)).query(points)[0]) == pytest.approx(RADIUS, rel=0.25)


def test_the_chain_lies_on_the_strand(loaded):
    detection = doo3d.detect(loaded.data, CONFIG, loaded.mask)
    (chain,) = detection.chains
    assert np.quantile(distances(chain, wave(rise=0.1)), 0.95) < 0.003
    assert chain.radius == pytest.approx(RADIUS, rel=0.15)
    length = np.linalg.norm(np.diff(wave(rise=0.1), axis=0), axis=1).sum()
    assert chain.length == pytest.approx(length, rel=0.05)


def test_the_mask_of_the_left_image_is_enough():
    images = replace(drawn_pair([wave()]), right_mask=None)
    loaded = triangulate(images, stereo_pair().rectified(), CONFIG)
    (chain,) = doo3d.detect(loaded.data, CONFIG, loaded.mask).chains
    assert np.quantile(distances(chain, wave()), 0.95) < 0.003


def test_the_chain_drawn_into_the_right_view_covers_its_mask(loaded):
    images, pair = drawn_pair([wave(rise=0.1)]), stereo_pair().rectified()
    (chain,) = doo3d.detect(loaded.data, CONFIG, loaded.mask).chains
    pixels = np.argwhere(images.right_mask)[:, ::-1]
    line = pair.pixels(chain.nodes(400), 1)
    assert (cKDTree(line).query(pixels)[0] < CAMERA.fx * 1.3 * chain.radius / 0.6 + 1).mean() > 0.97


def test_two_crossing_strands_keep_their_order():
    over = wave(depth=0.66)
    t = np.linspace(0.0, 1.0, 1500)
    under = np.column_stack((0.14 * t - 0.03, 0.16 * t - 0.08, np.full(len(t), 0.7)))
    images = drawn_pair([under, over])
    loaded = triangulate(images, stereo_pair().rectified(), CONFIG)
    detection = doo3d.detect(loaded.data, CONFIG, loaded.mask)
    assert len(detection.chains) == 2
    assert detection.crossings
    for crossing in detection.crossings:
        upper = detection.chains[crossing.upper.chain]
        assert np.median(upper.joints[:, 2]) < 0.68


def test_images_that_do_not_belong_together_are_refused():
    images = drawn_pair([wave()])
    right = np.full_like(images.right, 150)
    with refuses("pair-unmatched", "pair", "belong together"):
        triangulate(replace(images, right=right, right_mask=None), stereo_pair().rectified(), CONFIG)


def test_a_method_that_needs_depth_is_refused():
    config = doo3d.load_config("default", {"segment.method": "plane"})
    with refuses("method-needs-depth", "plane"):
        triangulate(drawn_pair([wave()]), stereo_pair().rectified(), config)


def test_the_camera_of_the_frame_is_the_rectified_one(loaded):
    assert loaded.data.camera == stereo_pair().rectified().camera
    assert loaded.data.camera.fx * BASELINE > 0

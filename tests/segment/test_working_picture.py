"""Photographs at several sizes: the same cables, with lengths in px that grow with the picture."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders.paths import SAMPLES

import doo3d
from doo3d.pipeline import run_stages
from doo3d.segment.working_picture import LENGTHS, enlarged_chain, segment_picture
from doo3d.tools.explain import explain_stages
from doo3d.tools.stage_products import products
from doo3d.types import Chain, Image

PHOTOS = {frame.name: frame for frame in doo3d.open_capture(SAMPLES / "photos").frames}
AS_IT_IS = {"segment.working_width": None, "fit.segment_length": 10, "merge.max_gap": 150}


def photo(name: str, scale: float):
    """A sample photograph and its mask, enlarged."""
    loaded = PHOTOS[name].load()
    image = cv2.resize(loaded.data.color, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    return image, cv2.resize(loaded.mask.view(np.uint8), image.shape[1::-1], interpolation=cv2.INTER_NEAREST) > 0


def detect(name: str, scale: float, given: bool, settings=None):
    image, mask = photo(name, scale)
    return doo3d.detect(image, doo3d.load_config("image", settings), mask=mask if given else None).chains


@pytest.mark.parametrize("given", [True, False])
@pytest.mark.parametrize("name", ["hidden", "tangle"])
def test_an_enlarged_photograph_has_the_same_cables(name, given):
    (usual,) = detect(name, 1, given)
    for scale in (2, 4.5):
        (chain,) = detect(name, scale, given)
        assert chain.length == pytest.approx(scale * usual.length, rel=0.02)
        assert chain.radius == pytest.approx(scale * usual.radius, rel=0.1)
        assert chain.segment_length == 10 * int(scale * (640 * 480 / (640 * 360)) ** 0.5)
        seen = np.rint(chain.joints[:-1, ::-1][~chain.occluded]).astype(int)
        assert photo(name, scale)[1][tuple(seen.T)].mean() > 0.9


def test_lengths_in_px_to_the_letter_cut_an_enlarged_cable():
    assert len(detect("tangle", 4.5, True, AS_IT_IS)) == 2


@pytest.mark.parametrize("length", [10, 37.5])
def test_the_users_segment_length_is_px_of_the_photograph(length):
    (chain,) = detect("tangle", 4.5, True, {"fit.segment_length": length})
    assert chain.segment_length == pytest.approx(length)
    steps = np.linalg.norm(np.diff(chain.joints, axis=0), axis=1)
    assert steps == pytest.approx(length, abs=1e-6 * length)


def test_the_users_longest_gap_is_px_of_the_photograph():
    assert len(detect("hidden", 4.5, True)) == 1
    assert (
        len(detect("hidden", 4.5, True, {"merge.max_gap": 150})) > 1
    )  # the occluder is some 60 px wide in the photograph itself


def test_lengths_that_are_set_are_converted_and_null_ones_are_not():
    image, mask = photo("tangle", 4.5)
    config = doo3d.load_config("image", {"prune.width": 9, "voxelize.radius": 15, "segment.max_width": 60})
    _, reduced, settings, scale = segment_picture(Image(image), config, mask)
    assert scale == 5
    assert reduced.color.shape == (432, 576, 3)
    assert (settings.prune.width, settings.voxelize.radius, settings.segment.max_width) == (9 / 5, 3, 12)
    assert settings.fit.segment_length is None
    assert settings.merge.max_gap is None
    assert all(hasattr(getattr(settings, section), key) for section, keys in LENGTHS.items() for key in keys)


@pytest.mark.parametrize("settings", [{"segment.working_width": None}, {"segment.working_width": 100}])
def test_a_photograph_is_not_reduced_below_the_width(settings):
    image, mask = photo("tangle", 2)
    config = doo3d.load_config("image", settings)
    assert segment_picture(Image(image), config, mask)[1].color.shape == image.shape


def test_the_paper_is_followed_to_the_letter_at_any_size():
    image, mask = photo("tangle", 4.5)
    stages = run_stages(image, doo3d.load_config("paper_2d"), mask)
    assert stages.observed.scale == 1
    assert stages.observed.segmentation.scene.mask.shape == mask.shape
    assert all(chain.segment_length == 10 for chain in stages.chains)


def test_an_image_that_is_a_mask_stays_one_when_it_is_reduced():
    mask = photo("tangle", 4.5)[1]
    drawn = np.repeat(np.where(mask, 255, 0).astype(np.uint8)[:, :, None], 3, axis=2)
    detection = doo3d.detect(drawn, "image")
    assert len(detection.chains) == 1
    assert detection.chains[0].segment_length == 50
    assert not any("network" in note for note in detection.notes)


def test_sides_that_are_no_multiple_of_the_factor_lose_nothing():
    mask = np.zeros((1441, 1283), dtype=bool)
    mask[700:740] = True  # from border to border
    chain = doo3d.detect(np.where(mask[..., None], 200, 30).repeat(3, axis=2).astype(np.uint8), "image", mask).chains[0]
    assert chain.segment_length == 20
    assert chain.joints[:, 1] == pytest.approx(719.5, abs=1)
    assert chain.joints[:, 0].min() < 20
    assert chain.joints[:, 0].max() > 1262
    assert chain.radius == pytest.approx(20, rel=0.05)


def test_a_pixel_of_the_reduced_picture_is_in_the_middle_of_its_pixels():
    chain = Chain(np.array([[0.0, 0.0], [10.0, 0.0]]), 10.0, 2.0)
    large = enlarged_chain(chain, 4)
    assert large.joints.tolist() == [[1.5, 1.5], [41.5, 1.5]]
    assert (large.segment_length, large.radius, large.radii.tolist()) == (40.0, 8.0, [8.0, 8.0])


def test_stage_products_are_in_px_of_the_photograph():
    image, mask = photo("tangle", 4.5)
    config = doo3d.load_config("image")
    stages = run_stages(image, config, mask)
    explanation = explain_stages(stages, config)
    made = {product.name: product for product in products(stages, explanation)}
    outside = cv2.distanceTransform((~mask).view(np.uint8), cv2.DIST_L2, 5)
    for name in ("1-mask", "3-skeleton", "6-pruned", "7-merges"):
        at = np.rint(made[name].points).astype(int)
        at = at[(at < image.shape[1::-1]).all(axis=1)]
        assert outside[at[:, 1], at[:, 0]].max() < 10
    assert made["1-mask"].mask.shape == (2160, 2880)
    text = {account.stage: account.made for account in explanation.accounts}
    assert "reduced by a factor of 5 (segment.working_width)" in text["segment"]
    assert "of 50.0 px" in text["fit"]
    assert f"chain 0, {round(5 * stages.chains[0].length)} px" in text["confidence"]


def test_only_in_2d_a_length_may_be_null():
    for key in ("fit.segment_length", "merge.max_gap"):
        with pytest.raises(doo3d.ConfigError, match=f"{key} is null, which only a 2-D config may have") as refused:
            doo3d.load_config("default", {key: None})
        assert refused.value.code == "value-invalid"

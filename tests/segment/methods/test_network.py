"""The method network: images of any size through a network of doo3d train."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders.errors import refuses
from builders.onnx_model import at_half_size, convolution

from doo3d.config import OnnxConfig, SegmentConfig
from doo3d.segment.methods import auto, network, strands
from doo3d.segment.methods.network import _with_colors, mask, object_probability
from doo3d.segment.methods.result import MethodResult
from doo3d.types import Camera, Cloud, Frame, Image

SIZE = (64, 96)


@pytest.fixture
def model(tmp_path):
    """A network to which red is the object."""
    path = tmp_path / "red.onnx"
    path.write_bytes(at_half_size(np.array([40.0, 0, 0]), -20.0, SIZE))
    return path


def picture(height: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Return an image with a red line of an odd shape, and the line."""
    rows, columns = np.mgrid[0:height, 0:width]
    line = np.abs(rows - 0.4 * height - 0.2 * columns) < 5
    return np.where(line[..., None], (220, 30, 40), (20, 90, 160)).astype(np.uint8), line


@pytest.fixture(autouse=True)
def one_size(monkeypatch):
    """The small models of these tests take images of one size."""
    monkeypatch.setattr(network, "PYRAMID", (1.0,))


def settings(path, **options) -> SegmentConfig:
    return SegmentConfig(method="network", onnx=OnnxConfig(model=str(path), **options))


@pytest.mark.parametrize("size", [SIZE, (61, 83), (64, 70)])
def test_pixels_stay_where_they_are(model, size):
    color, line = picture(*size)
    np.testing.assert_array_equal(mask(Image(color), settings(model), 0).mask, line)


def test_the_threshold_is_a_setting(model):
    color, _ = picture(*SIZE)
    assert not mask(Image(color), settings(model, threshold=1.0), 0).mask.any()


@pytest.mark.parametrize("probability", [0.3, 0.6])
def test_the_rules_decide_where_the_network_is_in_doubt(tmp_path, probability):
    path = tmp_path / "doubtful.onnx"
    size = (128, 192)
    path.write_bytes(at_half_size(np.zeros(3), np.log(probability / (1 - probability)), size))
    color, line = picture(*size)
    found = mask(Image(color), settings(path), 0)
    by_rules = strands.mask(Image(color), SegmentConfig(), 0).mask
    np.testing.assert_array_equal(found.probability > 0.5, by_rules)
    assert (found.mask & line).sum() > 0.8 * line.sum()
    assert (found.mask & ~line).sum() < 0.02 * line.sum()


def test_colors_remove_false_pixels_of_the_network_beside_a_strand(monkeypatch):
    rows = np.mgrid[0:200, 0:300][0]
    pair = (abs(rows - 90) < 6) | (abs(rows - 108) < 6)
    color = np.where(pair[..., None], (220, 30, 40), (150, 140, 130)).astype(np.uint8)
    around = abs(rows - 99) < 15
    monkeypatch.setattr(network, "object_probability", lambda *_: np.where(around, 0.7, 0.1).astype(np.float32))
    monkeypatch.setattr(strands, "select_in_image", lambda *_: MethodResult(pair))
    found = mask(Image(color), SegmentConfig(method="network"), 0)
    np.testing.assert_array_equal(found.mask, pair)
    np.testing.assert_array_equal(found.probability > 0.5, around)


def test_uniform_colors_do_not_change_the_probability():
    some = np.zeros((60, 80), np.float32)
    some[20:30] = 0.7
    noise = np.random.default_rng(0).random((60, 80), np.float32)
    for probability in (np.zeros_like(some), np.ones_like(some), some, noise):
        same = _with_colors(probability, np.full((60, 80, 3), 90, np.uint8))
        np.testing.assert_array_equal(same > 0, probability > 0.5)
        assert np.isfinite(same).all()


def test_the_probability_is_that_after_the_vote(model):
    color, line = picture(*SIZE)
    found = mask(Image(color), settings(model), 0)
    assert found.probability.dtype == np.float32
    np.testing.assert_array_equal(found.probability > 0.5, line)


@pytest.fixture
def frame():
    """A frame of a surface with a blue strand, and a raised part as noise of depth makes it."""
    v, u = np.mgrid[0:240, 0:320]
    color = np.random.default_rng(0).normal((200, 190, 170), 1, (240, 320, 3))
    color[np.abs(v - 60 - 0.1 * u) < 3] = (30, 60, 200)
    depth = np.full((240, 320), 0.8, np.float32)
    depth[150:156, 100:290] = 0.79
    return Frame(np.clip(color, 0, 255).astype(np.uint8), depth, Camera(300.0, 300.0, 160.0, 120.0, 320, 240))


def of_probability(path, probability: float) -> SegmentConfig:
    """Return the settings of a network to which every pixel of an image of 240 x 320 is equally probable."""
    path.write_bytes(at_half_size(np.zeros(3), np.log(probability / (1 - probability)), (256, 320)))
    return settings(path)


def test_a_frame_whose_parts_are_all_strands_by_color_is_not_judged(frame, monkeypatch):
    monkeypatch.setattr(network, "object_probability", None)
    without_noise = Frame(frame.color, np.full_like(frame.depth, 0.8), frame.camera)
    found, by_rules = (method.mask(without_noise, SegmentConfig(method="network"), 0) for method in (network, strands))
    assert by_rules.is_certain
    np.testing.assert_array_equal(found.mask, by_rules.mask)
    assert found.mask.any()


def test_the_network_judges_raised_parts_of_the_color_of_the_surface(frame, tmp_path):
    found = strands.mask(frame, SegmentConfig(), 0)
    by_rules = found.mask
    assert not found.is_certain
    assert by_rules[150:156, 100:290].mean() > 0.9
    doubted = mask(frame, of_probability(tmp_path / "low.onnx", 0.1), 0).mask
    assert not doubted[140:166, 90:300].any()
    np.testing.assert_array_equal(doubted[:130], by_rules[:130])
    np.testing.assert_array_equal(mask(frame, of_probability(tmp_path / "some.onnx", 0.3), 0).mask, by_rules)


def test_a_band_of_varying_width_is_detected_by_its_color_where_the_network_finds_it(frame, tmp_path):
    """Three strands that touch over half of their length, and a part of noise that keeps the rules uncertain."""
    color, depth = frame.color.copy(), frame.depth.copy()
    u = np.arange(320)
    bundle = np.zeros(color.shape[:2], dtype=bool)
    for k in range(3):
        row = 195 + 7 * k + (2 * (k - 1) * np.clip(u - 160, 0, None) / 12).astype(int)
        for column in range(10, 310):
            bundle[row[column] : row[column] + 7, column] = True
    color[bundle] = (30, 60, 200)
    with_bundle = Frame(color, depth, frame.camera)
    assert not strands.mask(with_bundle, SegmentConfig(), 0).mask[bundle].any()
    found = mask(with_bundle, of_probability(tmp_path / "some.onnx", 0.3), 0)
    assert found.mask[bundle].mean() > 0.95
    assert not mask(with_bundle, of_probability(tmp_path / "low.onnx", 0.1), 0).mask[bundle].any()


def test_a_certain_network_outdoes_the_rules(tmp_path):
    for probability, share in ((0.1, 0.0), (0.9, 1.0)):
        (tmp_path / "certain.onnx").write_bytes(at_half_size(np.zeros(3), np.log(probability / (1 - probability)), SIZE))
        assert mask(Image(picture(*SIZE)[0]), settings(tmp_path / "certain.onnx"), 0).mask.mean() == share


def test_large_images_are_scaled_down(model, monkeypatch):
    monkeypatch.setattr(network, "IMAGE_PIXELS", 64 * 96)
    color, line = picture(256, 384)
    found = mask(Image(color), settings(model), 0).mask
    assert found.shape == line.shape
    assert (found != line).mean() < 0.03


@pytest.fixture
def looked_at(monkeypatch):
    """The images that the network is given, of which it finds nothing."""
    images = []

    def run(path, image, is_trusted):
        images.append(image[0].transpose(1, 2, 0))
        return np.zeros((1, 8, image.shape[2] // 2, image.shape[3] // 2), np.float32)

    monkeypatch.setattr(network, "run_model", run)
    return images


def test_a_large_image_is_scaled_to_sides_that_the_network_takes_and_not_padded(looked_at):
    ramp = np.tile(np.linspace(0, 255, 1280).astype(np.uint8)[None, :, None], (720, 1, 3))
    assert object_probability(ramp, None, (1.0, 1.5)).shape == (720, 1280)
    assert [image.shape[:2] for image in looked_at] == [(352, 640), (544, 960)]


def test_a_small_image_keeps_its_pixels(looked_at):
    color = np.random.default_rng(0).integers(0, 256, (50, 70, 3), np.uint8)
    object_probability(color)
    np.testing.assert_allclose(looked_at[0][:50, :70] * 255, color, atol=1e-3)


def test_probabilities_are_within_zero_and_one(model):
    values = object_probability(picture(*SIZE)[0], str(model))
    assert 0 <= values.min() < 0.1
    assert 0.9 < values.max() <= 1


def test_a_network_of_another_shape_is_refused(tmp_path):
    (tmp_path / "other.onnx").write_bytes(convolution(np.eye(3), np.zeros(3), SIZE))
    with refuses("onnx-output", "other.onnx", "method onnx"):
        mask(Image(picture(*SIZE)[0]), settings(tmp_path / "other.onnx"), 0)


def test_data_without_color_is_refused(model):
    with refuses("method-needs-color"):
        mask(Cloud(np.random.default_rng(0).random((20, 3))), settings(model), 0)


def test_without_a_network_the_setting_is_named(monkeypatch):
    monkeypatch.setattr(network, "IS_PACKAGED", False)
    with refuses("network-missing", "segment.onnx.model"):
        mask(Image(picture(*SIZE)[0]), SegmentConfig(method="network"), 0)


def test_auto_takes_the_network_if_there_is_one(monkeypatch):
    image = Image(picture(*SIZE)[0])
    monkeypatch.setattr(auto, "IS_PACKAGED", False)
    assert auto.choose_method(image, SegmentConfig()) == "strands"
    monkeypatch.setattr(auto, "IS_PACKAGED", True)
    assert auto.choose_method(image, SegmentConfig()) == "network"


@pytest.mark.parametrize(("probability", "is_said"), [(0.5, True), (0.9, False)])
def test_a_note_names_shadows_that_the_network_rejects_too(tmp_path, probability, is_said):
    rows = np.mgrid[0:240, 0:320][0] - np.linspace(150, 190, 320)
    shade = cv2.GaussianBlur((np.abs(rows) < 5).astype(np.float32), (0, 0), 2.5)
    color = ((200, 190, 170) * (1 - 0.35 * shade[..., None])).astype(np.uint8)
    (tmp_path / "any.onnx").write_bytes(at_half_size(np.zeros(3), np.log(probability / (1 - probability)), (256, 320)))
    found = mask(Image(color), settings(tmp_path / "any.onnx"), 0)
    assert "only darker" in strands.mask(Image(color), SegmentConfig(), 0).note
    assert found.mask.mean() == (not is_said)
    assert ("segment (network): left out 1 band that is only darker" in found.note) == is_said

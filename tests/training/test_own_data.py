"""Images of the user become images to train on."""

import shutil

import numpy as np
import pytest
from builders.errors import refuses
from builders.paths import SAMPLES

import doo3d
from doo3d.inputs import open_capture
from doo3d.runs.run import run as run_capture
from doo3d.training.own_data import centre_of, cropped, own_images


def test_a_capture_with_masks():
    images = own_images(SAMPLES / "photos")
    capture = open_capture(SAMPLES / "photos", images_only=True)
    assert len(images) == sum(frame.load().mask is not None for frame in capture)
    mask = capture[0].load().mask
    assert images[0].shape == (*mask.shape, 5)
    np.testing.assert_array_equal(images[0][..., 3] > 127, mask)


@pytest.mark.parametrize(("sample", "preset"), [("photos", "image"), ("crossing", "default")])
def test_accepted_results_are_drawn_as_masks(tmp_path, sample, preset):
    capture = open_capture(SAMPLES / sample, preset == "image")
    run_capture(capture, tmp_path / "out", doo3d.load_config(preset))
    images = own_images(tmp_path / "out")
    overlaps = []
    for image, frame in zip(images, capture, strict=True):
        loaded, drawn = frame.load(), image[..., 3] > 127
        color = loaded.data.color.astype(int)
        # the cable of the capture is the one yellow thing in it
        mask = color[..., 2] < color[..., 0] - 50 if sample == "crossing" else loaded.mask
        if mask is not None:
            overlaps.append((mask & drawn).sum() / (mask | drawn).sum())
    assert overlaps
    assert min(overlaps) > 0.6


def test_data_without_masks_is_refused(tmp_path):
    shutil.copy(SAMPLES / "photos" / "loop.jpg", tmp_path / "loop.jpg")
    with refuses("training-data", str(tmp_path)):
        own_images(tmp_path)


def test_results_whose_capture_is_gone_are_refused(tmp_path):
    shutil.copytree(SAMPLES / "crossing", tmp_path / "capture")
    run_capture(open_capture(tmp_path / "capture"), tmp_path / "out", doo3d.load_config("default"))
    shutil.rmtree(tmp_path / "capture")
    with refuses("training-data", "capture"):
        own_images(tmp_path / "out")


def test_the_centre_of_a_mask_is_relative_to_the_width_of_each_strand():
    mask = np.zeros((60, 80), bool)
    mask[10:21] = mask[40:45] = True
    centre = centre_of(mask)
    assert centre[15, 40] == centre[42, 40] == 255
    assert 0 < centre[10, 40] < 80
    assert not centre[30].any()
    assert not centre_of(np.zeros((5, 5), bool)).any()


def test_parts_of_an_image_have_the_size_asked_for():
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (90, 140, 5), dtype=np.uint8)
    assert {cropped(rng, image, 64).shape for _ in range(9)} == {(64, 64, 5)}
    assert cropped(rng, image[:20, :30], 64).shape == (64, 64, 5)

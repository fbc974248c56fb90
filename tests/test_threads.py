"""Detection in several threads of one process."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from builders.onnx_model import convolution
from builders.paths import SAMPLES

import doo3d
from doo3d.inputs import open_capture
from doo3d.outputs.detection_json import encode

THREADS = 4


def sample(path, config, index=0):
    """Return the arguments of the detection of a sample's frame."""
    loaded = open_capture(SAMPLES / path).frames[index].load()
    return loaded.data, doo3d.load_config(config), loaded.mask


def result(arguments):
    """Return the bytes of a frame's file, without the seconds that each stage took."""
    data, config, mask = arguments
    detection = doo3d.detect(data, config, mask)
    detection.seconds.clear()
    return encode(detection)


@pytest.fixture(scope="module")
def frames():
    places = ["crossing", "occluder", "photos/four.jpg", "photos/hidden.jpg", "clouds/crossing.ply", "clouds/two_cables.npz"]
    samples = [(place, "image" if place.startswith("photos") else "default") for place in places]
    return [sample(*each) for each in (*samples, ("hand", "default", 19), ("t_piece", "harness"))]


@pytest.fixture
def often_switched():
    """Let Python's threads take turns every 50 microseconds instead of every 5 milliseconds."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(5e-5)
    yield
    sys.setswitchinterval(before)


@pytest.mark.usefixtures("often_switched")
def test_frames_in_several_threads_give_the_bytes_of_one_thread(frames):
    one_by_one = [result(each) for each in frames]
    with ThreadPoolExecutor(THREADS) as threads:
        assert list(threads.map(result, frames * 2)) == one_by_one * 2
    assert all(b'"joints"' in each for each in one_by_one)


@pytest.mark.usefixtures("often_switched")
def test_one_frame_in_several_threads_gives_the_same_bytes_in_each(frames):
    for each in (frames[0], frames[2], frames[-1]):
        with ThreadPoolExecutor(THREADS) as threads:
            assert len(set(threads.map(result, [each] * THREADS))) == 1


@pytest.mark.usefixtures("often_switched")
def test_threads_that_share_a_network_get_the_masks_of_their_own_images(tmp_path):
    size = (240, 320)
    (tmp_path / "net.onnx").write_bytes(convolution(np.array([[1.0, 0, 0]]), np.zeros(1), size))
    config = doo3d.load_config("image", {"segment.method": "onnx", "segment.onnx.model": str(tmp_path / "net.onnx")})
    images = [np.zeros((*size, 3), np.uint8) for _ in range(16)]
    for k, image in enumerate(images):
        image[20 + 10 * k : 28 + 10 * k, 40:280] = 255
    frames = [(image, config, None) for image in images]
    one_by_one = [result(each) for each in frames]
    assert len(set(one_by_one)) == len(images)
    with ThreadPoolExecutor(THREADS) as threads:
        assert list(threads.map(result, frames * 4)) == one_by_one * 4

"""The user's own segmentation network; damaged ones do not end the process."""

from __future__ import annotations

import os
import random
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from builders.errors import refuses
from builders.onnx_model import convolution, mixed
from builders.paths import ROOT

from doo3d.config import OnnxConfig, SegmentConfig
from doo3d.errors import InputError
from doo3d.segment.methods import onnx
from doo3d.segment.methods.onnx import mask
from doo3d.types import Cloud, Image

SIZE = (24, 40)
RED = np.zeros((*SIZE, 3), np.uint8) + np.array((20, 90, 160), np.uint8)
RED[8:14, 5:35] = (220, 30, 40)
OBJECT = RED[..., 0] > 128
DAMAGED = (*range(12), 14, 29, 60)  # with OpenCV 5.0, 14 and 29 end a process by SIGFPE, 60 by SIGSEGV


def model(tmp_path, weights, bias=None, size=SIZE, name="net.onnx"):
    weights = np.array(weights, float)
    (tmp_path / name).write_bytes(convolution(weights, np.zeros(len(weights)) if bias is None else np.array(bias), size))
    return tmp_path / name


def select(path, image=RED, **settings):
    return mask(Image(image), SegmentConfig(method="onnx", onnx=OnnxConfig(model=str(path), **settings)), 0)


def test_one_class_and_a_threshold(tmp_path):
    path = model(tmp_path, [[1, 0, 0]])
    np.testing.assert_array_equal(select(path), OBJECT)
    assert select(path, threshold=0.05).all()
    assert not select(path, threshold=0.9).any()
    np.testing.assert_array_equal(select(path, channels="bgr", threshold=0.3), ~OBJECT)


def test_mean_and_scale(tmp_path):
    path = model(tmp_path, [[1, 0, 0]])
    settings = {"mean": (200, 0, 0), "scale": (0.1, 1, 1)}
    np.testing.assert_array_equal(select(path, threshold=1.9, **settings), OBJECT)
    assert not select(path, threshold=2.1, **settings).any()


def test_of_several_classes_the_one_that_scores_most(tmp_path):
    path = model(tmp_path, [[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(select(path, class_index=1), OBJECT)
    np.testing.assert_array_equal(select(path), ~OBJECT)
    assert not select(path, class_index=2).any()


def test_the_image_is_scaled_to_the_network(tmp_path):
    path = model(tmp_path, [[1, 0, 0]])
    large = np.repeat(np.repeat(RED, 4, axis=0), 4, axis=1)
    found = select(path, large, input_size=SIZE[::-1])
    assert found.shape == (96, 160)
    assert (found != np.repeat(np.repeat(OBJECT, 4, axis=0), 4, axis=1)).mean() < 0.02


def test_a_file_written_again_is_read_again(tmp_path):
    path = model(tmp_path, [[1, 0, 0]])
    assert select(path).any()
    model(tmp_path, [[0, 0, 0], [1, 0, 0]])
    assert not select(path).any()


def test_files_that_are_no_model(tmp_path):
    with refuses("file-missing", "net.onnx"):
        select(tmp_path / "net.onnx")
    for content in (b"", b"not a model", convolution(np.ones((1, 3)), np.zeros(1), SIZE)[:60]):
        (tmp_path / "net.onnx").write_bytes(content)
        with refuses("onnx-unreadable", "net.onnx"):
            select(tmp_path / "net.onnx")


def test_a_class_that_the_model_has_not(tmp_path):
    with refuses("onnx-class", "3", "2 classes"):
        select(model(tmp_path, np.ones((2, 3))), class_index=3)


def test_an_output_that_is_no_image(tmp_path, monkeypatch):
    class Network:
        def setInput(self, image):
            pass

        def forward(self):
            return np.zeros((1, 5, 4, 3, 2), np.float32)

    monkeypatch.setattr("doo3d.segment.methods.onnx._load", lambda *_: Network())
    with refuses("onnx-output", "1, 5, 4, 3, 2", "classes"):
        select(model(tmp_path, np.ones((1, 3))))


def test_an_input_that_the_model_does_not_take(tmp_path, monkeypatch):
    import cv2

    class Network:
        def setInput(self, image):
            raise cv2.error("sizes differ")

    monkeypatch.setattr("doo3d.segment.methods.onnx._load", lambda *_: Network())
    with refuses("onnx-input", "sizes differ", "input_size"):
        select(model(tmp_path, np.ones((1, 3))))


def _end(*_) -> None:
    import os
    import signal

    os.kill(os.getpid(), signal.SIGSEGV)


def _sleep(*_) -> None:
    time.sleep(60)


def test_a_model_that_ends_the_process_or_hangs_is_refused(tmp_path, monkeypatch):
    path = model(tmp_path, [[0.3, 0.3, 0.3]])
    monkeypatch.setattr(onnx, "_forward", _end)
    with refuses("onnx-unreadable", "net.onnx", "ended on it"):
        select(path)
    monkeypatch.setattr(onnx, "_forward", _sleep)
    monkeypatch.setattr(onnx, "_MAX_FIRST_RUN_S", 0.5)
    with refuses("onnx-unreadable", "net.onnx", "no answer within 0.5 s"):
        select(path)
    monkeypatch.undo()
    assert not select(path, threshold=0.9).any()


def test_a_model_is_tried_once_for_its_content_and_the_size_of_its_input(tmp_path, monkeypatch):
    tried = []
    monkeypatch.setattr(onnx, "isolated", lambda *args, **_: tried.append(args[1].name.rpartition("/")[2]))
    weights = [[0.11, 0.12, 0.13]]
    for _ in range(3):
        select(model(tmp_path, weights))
    select(model(tmp_path, weights, name="copy.onnx"))
    assert len(tried) == 1
    select(model(tmp_path, weights, size=(48, 80)), input_size=(80, 48))
    select(model(tmp_path, [[0.21, 0.12, 0.13]]))
    assert len(tried) == 3


def damaged(number: int) -> bytes:
    sys.path.insert(0, str(ROOT / "tests" / "campaigns"))
    from fuzz_mutations import mutated

    choice = random.Random(number)
    return mutated(choice.choice((convolution(np.ones((2, 3)), np.zeros(2), SIZE), mixed(SIZE))), choice)


def use_damaged_models(folder) -> int:
    """Select by damaged models; return the number of those refused."""
    refused = []
    for number in DAMAGED:
        (folder / "net.onnx").write_bytes(damaged(number))
        try:
            assert select(folder / "net.onnx").shape == SIZE
        except InputError as error:
            refused.append(error.code)
    assert set(refused) <= {"onnx-unreadable", "onnx-input", "onnx-output"}
    return len(refused)


def test_damaged_models_are_results_or_sentences(tmp_path):
    (tmp_path / "net.onnx").write_bytes(mixed(SIZE))
    assert select(tmp_path / "net.onnx", threshold=-1e9).all()
    code = "import sys, pathlib, test_onnx; sys.exit(test_onnx.use_damaged_models(pathlib.Path(sys.argv[1])))"
    paths = os.pathsep.join(map(str, (ROOT / "tests", Path(__file__).parent)))
    done = subprocess.run(
        [sys.executable, "-c", code, tmp_path], env={**os.environ, "PYTHONPATH": paths}, capture_output=True, text=True
    )
    assert len(DAMAGED) / 2 < done.returncode <= len(DAMAGED), done.stderr[-2000:]


def test_without_color_or_a_model():
    with refuses("method-needs-color", "onnx"):
        mask(Cloud(np.zeros((3, 3))), SegmentConfig(method="onnx", onnx=OnnxConfig(model="net.onnx")), 0)
    with pytest.raises(ValueError, match=r"segment\.onnx\.model is not set"):
        SegmentConfig(method="onnx")
